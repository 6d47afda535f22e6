"""The high five: how high, how steady, and how far from every limit."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.ground_truth import Track
from benchmarks.rows import Direction, Family, Measurement, Row
from benchmarks.trials import Failed, Subject, Trial
from go2_wbc.geometry import support_margin
from go2_wbc.legs import LEGS, SIDES, Leg
from go2_wbc.robot.model import RobotModel

HOLD = 2.0
"""Time [s] for which the paw is asked to be held."""
HELD_TIME = 1.9
"""Length [s] of the window in which the paw's height is measured: the hold without its edges."""

_ITEM = "high five, either side"
ROWS = (
    Row("five.height", _ITEM, "paw height held 2 s", "m", 0.60, Direction.AT_LEAST),
    Row("five.margin", _ITEM, "least CoM margin, held", "cm", 6.0, Direction.AT_LEAST),
    Row("five.margin_phase", _ITEM, "the same, on three legs", "cm", None, Direction.AT_LEAST),
    Row("five.load", _ITEM, "least foot load, held", "N", 25.0, Direction.AT_LEAST),
    Row("five.load_phase", _ITEM, "the same, on three legs", "N", None, Direction.AT_LEAST),
    Row("five.slip", _ITEM, "support slip at contact", "mm", 2.0),
    Row("five.torque", _ITEM, "peak torque / limit", "", 0.4),
    Row("five.joints", _ITEM, "least joint distance, held", "rad", 0.03, Direction.AT_LEAST),
    Row("five.joints_phase", _ITEM, "the same, on three legs", "rad", None, Direction.AT_LEAST),
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
    with Subject(trial) as robot:
        try:
            robot.require(robot.go2.stand())
            for side, leg in SIDES.items():
                robot.truth.clear()
                robot.require(robot.go2.high_five(side, hold=HOLD))
                figures = _figures(robot.truth.track(), leg)
                worst = {row.name: _worse(row, figures, worst) for row in ROWS}
        except Failed as failed:
            reason = str(failed)
            return Measurement(worst, {row.name: reason for row in ROWS}, reason)
    return Measurement(worst)


def _worse(row: Row, new: Mapping[str, float], old: Mapping[str, float]) -> float:
    values = {i: found[row.name] for i, found in enumerate((new, old)) if row.name in found}
    return values[row.direction.worst(values)]


def _figures(track: Track, leg: Leg) -> dict[str, float]:
    in_air = longest_run(track.foot_forces[:, leg] == 0.0)
    phase = track.part(in_air)
    held = phase.part(highest_window(phase.p_world_feet[:, leg, 2], _ticks(track, HELD_TIME)))
    support = [other for other in LEGS if other is not leg]
    model = RobotModel()
    return {
        "five.height": float(held.p_world_feet[:, leg, 2].min()),
        "five.margin": 100.0 * least_margin(held, support),
        "five.margin_phase": 100.0 * least_margin(phase, support),
        "five.load": float(held.foot_forces[:, support].min()),
        "five.load_phase": float(phase.foot_forces[:, support].min()),
        "five.slip": 1000.0 * largest_slip(phase, support),
        "five.torque": float((np.abs(phase.tau) / model.torque_limits).max()),
        "five.joints": _joint_distance(held, model),
        "five.joints_phase": _joint_distance(phase, model),
    }


def _ticks(track: Track, seconds: float) -> int:
    return round(seconds / float(track.time[-1] - track.time[-2]))


def longest_run(flags: Bool[np.ndarray, " n"]) -> slice:
    """Where ``flags`` is true for the longest time; empty if nowhere."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    if len(starts) == 0:
        return slice(0, 0)
    longest = int(np.argmax(ends - starts))
    return slice(int(starts[longest]), int(ends[longest]))


def highest_window(heights: Float[np.ndarray, " n"], length: int) -> slice:
    """The ``length`` consecutive samples whose least height is greatest.

    Raises:
        Failed: if there are fewer samples.
    """
    if len(heights) < length:
        raise Failed(f"the paw was in the air for {len(heights)} ticks, {length} were asked")
    least = np.lib.stride_tricks.sliding_window_view(heights, length).min(axis=1)
    start = int(np.argmax(least))
    return slice(start, start + length)


def least_margin(track: Track, support: list[Leg]) -> float:
    """Least distance [m] of the CoM to the edges of the supporting contact points."""
    feet, com = track.p_world_contacts[:, support, :2], track.p_world_com[:, :2]
    if not np.isfinite(feet).all():
        return -math.inf  # a supporting foot left the ground
    return min(support_margin(points, p) for points, p in zip(feet, com, strict=True))


def largest_slip(track: Track, support: list[Leg]) -> float:
    """Largest distance [m] that the material of a supporting foot slides at its contact point."""
    steps = np.diff(track.time)[:, None, None] * track.v_world_contacts[1:, support]
    return float(np.linalg.norm(np.cumsum(steps, axis=0), axis=2).max())


def _joint_distance(track: Track, model: RobotModel) -> float:
    q = track.q[:, 7:]
    return float(np.minimum(q - model.q_lower, model.q_upper - q).min())


FAMILY = Family("high-five", ROWS, measure)
