"""The high five: how high, how steady, and how far from every limit."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.study import Direction, Measurement, Metric, Study
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.geometry import moving_support_margins
from go2_wbc.legs import LEGS, SIDES, Leg
from go2_wbc.plant.mujoco.ground_truth import TruthRecording, true_runs
from go2_wbc.robot.model import RobotModel

HOLD = 2.0
"""Time [s] for which the paw is asked to be held."""
HELD_TIME = 1.9
"""Length [s] of the window in which the paw's height is measured: the hold without its edges."""

_ITEM = "high five, either side"
METRICS = (
    Metric("five.height", _ITEM, "paw height held 2 s", "m", 0.60, Direction.AT_LEAST),
    Metric("five.margin", _ITEM, "least CoM margin, held", "cm", 6.0, Direction.AT_LEAST),
    Metric("five.margin_phase", _ITEM, "the same, on three legs", "cm", None, Direction.AT_LEAST),
    Metric("five.load", _ITEM, "least foot load, held", "N", 25.0, Direction.AT_LEAST),
    Metric("five.load_phase", _ITEM, "the same, on three legs", "N", None, Direction.AT_LEAST),
    Metric("five.slip", _ITEM, "support slip at contact", "mm", 2.0),
    Metric("five.torque", _ITEM, "peak torque / limit", "", 0.4),
    Metric("five.joints", _ITEM, "least joint distance, held", "rad", 0.03, Direction.AT_LEAST),
    Metric("five.joints_phase", _ITEM, "the same, on three legs", "rad", None, Direction.AT_LEAST),
)


def measure(trial: Trial) -> Measurement:
    """Give a high five with either paw; every value is the worse of both sides.

    - on three legs: the longest time in which the raised foot touches nothing;
    - held: the ticks of the 1.9 s in which the paw's lowest point in time is highest;
    - paw height held 2 s: the least height of the foot's centre over the floor while held;
    - CoM margin: least distance of MuJoCo's CoM, on the ground, to the edges of the triangle of
      the contact points of the other three feet;
    - least foot load: least normal force on any of these three;
    - support slip: largest distance, at any time on three legs, that the material of a supporting
      foot has slid at its contact point: the norm of its integrated tangential velocity. (The
      foot's centre moves further, because round feet roll.);
    - peak torque: largest |tau| / limit of any joint on three legs;
    - joint distance: least distance of any joint to its limit, the tighter published one for hips.
    """
    worst: dict[str, float] = {}
    with TrialRobot(trial) as robot:
        try:
            robot.require(robot.go2.stand())
            for side, leg in SIDES.items():
                robot.truth.clear()
                robot.require(robot.go2.high_five(side, hold=HOLD))
                measured = _measured(robot.truth.recording(), leg)
                for metric in METRICS:
                    value = measured[metric.name]
                    values = {0: value, 1: worst.get(metric.name, value)}
                    worst[metric.name] = values[metric.direction.worst(values)]
        except TrialFailed as failed:
            reason = str(failed)
            return Measurement(worst, {metric.name: reason for metric in METRICS}, reason)
    return Measurement(worst)


def _measured(recorded: TruthRecording, leg: Leg) -> dict[str, float]:
    on_three_legs = recorded.part(longest_run(recorded.foot_forces[:, leg] == 0.0))
    ticks = round(HELD_TIME / float(recorded.time[-1] - recorded.time[-2]))
    held = on_three_legs.part(highest_window(on_three_legs.p_world_feet[:, leg, 2], ticks))
    support = [other for other in LEGS if other is not leg]
    model = RobotModel()
    return {
        "five.height": float(held.p_world_feet[:, leg, 2].min()),
        "five.margin": 100.0 * least_margin(held, support),
        "five.margin_phase": 100.0 * least_margin(on_three_legs, support),
        "five.load": float(held.foot_forces[:, support].min()),
        "five.load_phase": float(on_three_legs.foot_forces[:, support].min()),
        "five.slip": 1000.0 * largest_slip(on_three_legs, support),
        "five.torque": float(on_three_legs.torque_shares(model).max()),
        "five.joints": held.joint_distance(model),
        "five.joints_phase": on_three_legs.joint_distance(model),
    }


def longest_run(flags: Bool[np.ndarray, " n"]) -> slice:
    """Where ``flags`` is true for the longest time; empty if nowhere."""
    return max(true_runs(flags), key=lambda run: run.stop - run.start, default=slice(0, 0))


def highest_window(heights: Float[np.ndarray, " n"], length: int) -> slice:
    """The ``length`` consecutive samples whose least height is greatest.

    Raises:
        TrialFailed: if there are fewer samples.
    """
    if len(heights) < length:
        raise TrialFailed(f"the paw was in the air for {len(heights)} ticks, {length} were asked")
    least = np.lib.stride_tricks.sliding_window_view(heights, length).min(axis=1)
    start = int(np.argmax(least))
    return slice(start, start + length)


def least_margin(recorded: TruthRecording, support: list[Leg]) -> float:
    """Least distance [m] of the CoM to the edges of the supporting contact points."""
    feet, com = recorded.p_world_contacts[:, support, :2], recorded.p_world_com[:, :2]
    if not np.isfinite(feet).all():
        return -math.inf  # a supporting foot left the ground
    return float(moving_support_margins(feet, com).min())


def largest_slip(recorded: TruthRecording, support: list[Leg]) -> float:
    """Largest distance [m] that the material of a supporting foot slides at its contact point."""
    steps = np.diff(recorded.time)[:, None, None] * recorded.v_world_contacts[1:, support]
    return float(np.linalg.norm(np.cumsum(steps, axis=0), axis=2).max())


STUDY = Study("high-five", METRICS, measure)
