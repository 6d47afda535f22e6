"""Every motion of the library, played over seeds.

On the true state: does the robot stay up, on its feet, and on its plan? On its own sensors, under
the conditions of ``benchmarks.locomotion``: is it done, and is it true when ``play`` says so?
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.robots import UNTOLD, plan_of, plant_of
from benchmarks.study import Study, TrialResult
from controller.acceptance import END_HEADING, END_PLACE
from controller.motion_measurement import MotionMeasurement, during_motion, measure_motion
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.reference import Anchor
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle
from motions import motion_names

FIRST_SEED = 14000  # Of the first trial on sensors that is judged
DRIFT, TURN_DRIFT = 0.015, 0.02
"""What leg odometry may add to where a motion ends: a share of its way, and an angle [rad].

The heading of the longest motion, of 67 s, drifted by 0.37 deg (rms of 18 other seeds, at most
0.66); the estimator itself is unsure of it by 0.8 deg then. The angle is three times the former.
"""
EVERY = "every motion of the library"
MOST_SLIP = 7.0
"""Of feet that stay [mm], 6.4 in the dance, on soft contacts. It was 4.7, with a bar of 5, as the
joints' friction kept the trunk up to 4 deg from what is asked; 0.4 now."""
ROWS = (
    ("done", "share of motions done", ">= 1"),
    ("slip", "slip of feet that stay", f"<= {MOST_SLIP:g} mm"),
    ("landed_slip", "slip of feet that step", "mm"),
    ("torque", "peak torque / limit", "<= 1"),
    ("speed", "peak joint speed / limit", "<= 1"),
    ("tracking", "CoM off its plan, worst", "mm"),
)
SENSED_ROWS = (
    ("done", "share of motions done", ">= 0.95"),
    ("true", "share of True that is true", ">= 1"),
    ("place", "end place off, worst", "mm"),
    ("turn", "end heading off, worst", "deg"),
)
Look = Callable[[TrialRobot, str, MotionPlan, MotionMeasurement], None]
"""Looks at a motion that has just been played."""


def play_all(plant: Callable[[], MujocoPlant], look: Look) -> dict[str, str]:
    """Play the motions one after the other on one robot; a new robot after a failure.

    Returns:
        Why motions were not done, by name. Done is: ``play`` said True and the robot is upright.
    """
    lost: dict[str, str] = {}
    remaining = list(motion_names())
    while remaining:
        with TrialRobot(plant()) as robot:
            robot.require(robot.go2.stand())
            is_well = True
            while remaining and is_well:
                name = remaining.pop(0)
                plan = plan_of(name)
                run = measure_motion(robot.go2, robot.truth, plan, RobotModel())
                look(robot, name, plan, run)
                is_well = run.ok
                if not is_well:
                    lost[name] = run.fall or run.reason
    return lost


def measure(trial: Trial, found: TrialResult) -> None:
    """The largest of what was measured on the true state.

    Slip: largest distance that a standing foot's material slid at its contact point, from 0.1 s
    after a touchdown to 0.1 s before a lift-off; of motions whose feet stay where they are, and of
    those that step or jump: on little friction a foot that lands fast slides for longer.
    """
    worst = TrialResult({name: 0.0 for name, *_ in ROWS})

    def look(_robot: TrialRobot, _name: str, plan: MotionPlan, run: MotionMeasurement) -> None:
        worst.worsen("slip" if plan.footsteps is None else "landed_slip", 1000.0 * run.slip)
        worst.worsen("torque", run.torque)
        worst.worsen("speed", run.speed)
        worst.worsen("tracking", 1000.0 * run.tracking)

    lost = play_all(trial.plant, look)
    found.values = worst.values | {"done": 1.0 - len(lost) / len(motion_names())}
    if lost:
        found.failures["done"] = _listed(lost)


@dataclass(frozen=True, slots=True)
class Ending:
    """Where the feet of a motion ended in truth, seen from where they stood at first."""

    off: float  #: distance [m], on the level, of their middle from where the motion ends
    turned: float  #: angle [rad] by which they are turned from there
    way: float  #: what the motion moves them on [m]

    @property
    def is_as_said(self) -> bool:
        """Whether ``play`` may say True: its own tolerance, and the drift of the odometry."""
        most = END_PLACE + DRIFT * self.way
        return self.off < most and self.turned < END_HEADING + TURN_DRIFT


def ending(recorded: TruthRecording, plan: MotionPlan) -> Ending:
    """The ending of a ``plan`` that was played while ``recorded`` was."""
    radius = find_profile().foot_radius
    begun, ended = (Anchor.of_feet(recorded.p_world_feet[k].copy(), radius) for k in (0, -1))
    planned = plan.at(plan.duration).placed(begun).p_world_feet
    wanted = Anchor.of_feet(planned, radius)
    off = (ended.p_world - wanted.p_world)[:2]
    way = (wanted.p_world - begun.p_world)[:2]
    turned = abs(wrap_angle(ended.yaw - wanted.yaw))
    return Ending(float(np.linalg.norm(off)), turned, float(np.linalg.norm(way)))


def measure_sensed(trial: Trial, found: TrialResult) -> None:
    """On the robot's own sensors; judged is the simulator.

    True: of the motions of which ``play`` said True, those that leave the robot upright where they
    end, in truth, within what ``play`` allows itself plus the drift.
    """
    worst, false = TrialResult({"place": 0.0, "turn": 0.0}), dict[str, str]()

    def look(robot: TrialRobot, name: str, plan: MotionPlan, run: MotionMeasurement) -> None:
        if not run.said:
            return
        end = ending(during_motion(robot.go2, robot.truth, name), plan)
        worst.worsen("place", 1000.0 * end.off)
        worst.worsen("turn", math.degrees(end.turned))
        if run.fall is not None or not end.is_as_said:
            false[name] = run.fall or f"{1000.0 * end.off:.0f} mm off"

    lost = play_all(lambda: plant_of(trial, FIRST_SEED, UNTOLD), look)
    said = len(motion_names()) - len(lost.keys() - false.keys())
    done, true = 1.0 - len(lost) / len(motion_names()), 1.0 - len(false) / max(said, 1)
    found.values = worst.values | {"done": done, "true": true}
    notes = {"done": _listed(lost), "true": _listed(false)}
    found.notes = {name: words for name, words in notes.items() if words}


def _listed(reasons: dict[str, str]) -> str:
    return "; ".join(f"{name}: {why}" for name, why in reasons.items())


ON_TRUTH = Study("library", {EVERY: ROWS}, measure)
_SENSED = Study("library", {EVERY: SENSED_ROWS}, measure_sensed).sensed("sensors")
ON_SENSORS = replace(_SENSED, prefix="sensed_library")
