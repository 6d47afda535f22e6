"""Every motion of the library on the robot's own sensors: done, and is it true when it says so?

A row of ``python -m benchmarks locomotion``, under the conditions of ``benchmarks.sensed``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.library import plan_of
from benchmarks.sensed import sensing_plant
from benchmarks.study import Direction, Measurement, Metric, Study
from controller.checks import END_HEADING, END_PLACE
from controller.motion_measurement import during_motion, measure_motion
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.reference import Anchor, MotionPlan
from go2_wbc.robot.model import FOOT_RADIUS, RobotModel
from go2_wbc.robot.rotations import wrap_angle
from motions import motion_names

DRIFT, TURN_DRIFT = 0.015, 0.02
"""What leg odometry may add to where a motion ends: a share of its way, and an angle [rad].

The heading of the longest motion, of 67 s, drifted by 0.37 deg (rms of 18 other seeds, at most
0.66); the estimator itself is unsure of it by 0.8 deg then. The angle is three times the former.
"""
_ITEM = "sensors: every motion of the library"
DONE = Metric("sensed_library.done", _ITEM, "share of motions done", "", 0.95, Direction.AT_LEAST)
TRUE = Metric("sensed_library.true", _ITEM, "share of True that is true", "", 1.0, DONE.direction)
PLACE = Metric("sensed_library.place", _ITEM, "end place off, worst", "mm", None)
TURN = Metric("sensed_library.turn", _ITEM, "end heading off, worst", "deg", None)


@dataclass(frozen=True, slots=True)
class Ending:
    """Where the feet of a motion ended in truth, seen from where they stood at first.

    Attributes:
        off: distance [m], on the level, of their middle from where the motion ends.
        turned: angle [rad] by which they are turned from there.
        way: what the motion moves them on [m].
    """

    off: float
    turned: float
    way: float

    @property
    def is_as_said(self) -> bool:
        """Whether ``play`` may say True: its own tolerance, and the drift of the odometry."""
        most = END_PLACE + DRIFT * self.way
        return self.off < most and self.turned < END_HEADING + TURN_DRIFT


def ending(recorded: TruthRecording, plan: MotionPlan) -> Ending:
    """The ending of a ``plan`` that was played while ``recorded`` was."""
    begun, ended = (Anchor.of_feet(recorded.p_world_feet[k].copy(), FOOT_RADIUS) for k in (0, -1))
    planned = plan.at(plan.duration).placed(begun).p_world_feet
    wanted = Anchor.of_feet(planned, FOOT_RADIUS)
    off = (ended.p_world - wanted.p_world)[:2]
    way = (wanted.p_world - begun.p_world)[:2]
    turned = abs(wrap_angle(ended.yaw - wanted.yaw))
    return Ending(float(np.linalg.norm(off)), turned, float(np.linalg.norm(way)))


def measure(trial: Trial) -> Measurement:
    """Play the motions one after the other on one robot; a new robot after a failure.

    - done: ``play`` said True, and the robot is upright for MuJoCo;
    - true: of the motions of which ``play`` said True, those that leave the robot upright where
      they end, in truth, within what ``play`` allows itself plus the drift.
    """
    model, names = RobotModel(), motion_names()
    values = {PLACE.name: 0.0, TURN.name: 0.0}
    lost: dict[str, str] = {}
    false: dict[str, str] = {}
    remaining = list(names)
    while remaining:
        with TrialRobot(sensing_plant(trial)) as robot:
            robot.require(robot.go2.stand())
            is_well = True
            while remaining and is_well:
                name = remaining.pop(0)
                plan = plan_of(name)
                run = measure_motion(robot.go2, robot.truth, plan, model)
                if run.said:
                    end = ending(during_motion(robot.go2, robot.truth, name), plan)
                    values[PLACE.name] = max(values[PLACE.name], 1000.0 * end.off)
                    values[TURN.name] = max(values[TURN.name], math.degrees(end.turned))
                    if run.fall is not None or not end.is_as_said:
                        false[name] = run.fall or f"{1000.0 * end.off:.0f} mm off"
                if not run.ok:
                    lost[name] = run.fall or run.reason
                is_well = run.ok
    said = len(names) - len(lost.keys() - false.keys())
    values[DONE.name] = 1.0 - len(lost) / len(names)
    values[TRUE.name] = 1.0 - len(false) / max(said, 1)
    notes = {DONE.name: _listed(lost), TRUE.name: _listed(false)}
    return Measurement(values, notes={name: words for name, words in notes.items() if words})


def _listed(reasons: dict[str, str]) -> str:
    return "; ".join(f"{name}: {why}" for name, why in reasons.items())


STUDY = Study("sensed-library", (DONE, TRUE, PLACE, TURN), measure, group="sensors")
