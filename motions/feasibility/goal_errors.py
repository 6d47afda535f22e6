"""How far a solved plan is from what was asked, measured on the plan itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from go2_wbc.legs import FOOT_NAMES, LEGS, Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions.dynamics.dynamic_trajectory import feet_at
from motions.dynamics.phases import PhaseProblem
from motions.dynamics.solver import PlanTarget
from motions.plan.compiled_plan import CompiledPlan, DynamicSpan, attitude_angles

SUBJECTS = ("trunk", *FOOT_NAMES)
_Places = Float[np.ndarray, "n1 4 3"]


@dataclass(frozen=True, slots=True)
class Misses:
    """Of trunk and feet, at k instants; nan where nothing was asked."""

    times: Float[np.ndarray, " k"]  #: (k,) after the start of the span [s]
    away: Float[np.ndarray, "k 5"]  #: (k, 5) distances [m]
    turned: Float[np.ndarray, "k 5"]  #: (k, 5) angles [rad], of the trunk only
    feet: Float[np.ndarray, "k 4"]
    """(k, 4) distances [m] of the feet, in the air too; of what was written as a whole only."""


def misses_of(span: DynamicSpan, places: _Places, model: RobotModel) -> Misses:
    """What ``span`` misses of what it was asked, its feet at ``places`` (n+1, 4, 3) [m]."""
    if isinstance(span.asked, PhaseProblem):
        return _of_phases(span, span.asked, places)
    return _of_written(span, places, model)


def _of_phases(span: DynamicSpan, asked: PhaseProblem, places: _Places) -> Misses:
    """What is missed at the ends of phases; whole turns count."""
    plan = span.trajectory
    R, angles = yaw_rotation(span.frame.yaw), attitude_angles(plan.q)
    shifts = asked.foot_shifts @ R.T
    ends = np.cumsum([phase.duration for phase in asked.phases])
    away, turned = (np.full((len(ends), 5), np.nan) for _ in range(2))
    nothing: frozenset[Leg] = frozenset()
    following = [*(phase.stance for phase in asked.phases[1:]), nothing]
    for row, (phase, after) in enumerate(zip(asked.phases, following, strict=True)):
        knot = int(np.argmin(np.abs(plan.times - ends[row])))
        for leg in LEGS:
            if leg in phase.feet or leg in after - phase.stance:
                goal = places[0, leg] + shifts[row, leg]
                away[row, 1 + leg] = np.linalg.norm(places[knot, leg] - goal)
        if phase.body is not None:
            p = plan.q[0, :3] + R @ np.array(phase.body[:3])
            away[row, 0] = np.linalg.norm(plan.q[knot, :3] - p)
            turned[row, 0] = np.abs(angles[knot] - angles[0] - phase.body[3:]).max()
    return Misses(ends, away, turned, away[:, 1:])


def _of_written(span: DynamicSpan, places: _Places, model: RobotModel) -> Misses:
    """What the trunk misses at every knot, and the feet where they land."""
    plan = span.trajectory
    wanted = span.written(span.start + plan.times)
    away, turned = (np.full((len(wanted), 5), np.nan) for _ in range(2))
    away[:, 0] = np.linalg.norm(plan.q[:, :3] - wanted[:, :3], axis=1)
    asked, done = (Rotation.from_quat(q[:, 3:7]) for q in (wanted, plan.q))
    turned[:, 0] = (asked.inv() * done).magnitude()
    asked_feet = feet_at(wanted, np.zeros((len(wanted), 18)), model)[0]
    feet = np.linalg.norm(places - asked_feet, axis=2)
    lands = plan.stance[1:] & ~plan.stance[:-1]
    for row, leg in np.argwhere(lands) + [1, 0]:
        away[row, 1 + leg] = feet[row, leg]
    return Misses(plan.times, away, turned, feet)


@dataclass(frozen=True, slots=True)
class Departure:
    """Of one part of a motion, which could not be done as it was written."""

    start: float  #: when it begins [s]
    end: float  #: when it ends [s]
    place: float
    """Greatest distance [m] of the trunk, or of a foot that lands, from what was written."""
    subject: str  #: of what
    place_time: float  #: when [s]
    angle: float  #: greatest angle [rad] of the trunk from what was written
    angle_time: float  #: when [s]
    lag: float  #: how late [s] the trunk is as a whole; below 0, early
    foot_place: float  #: greatest distance [m] of a foot from what was written, in the air too
    foot: str  #: of which foot
    foot_time: float  #: when [s]

    @property
    def farther_foot(self) -> str:
        """The foot that is farther from what was written than ``subject``, in words; else ""."""
        if self.foot_place <= self.place:
            return ""
        return f"{1e3 * self.foot_place:.0f} mm ({self.foot} at {self.foot_time:.2f} s)"

    def __str__(self) -> str:
        """Two lines for a person or three, at most 80 columns wide."""
        late = "late" if self.lag >= 0.0 else "early"
        return (
            f"{self.start:.2f} to {self.end:.2f} s is the nearest to what was written: "
            f"{1e3 * self.place:.0f} mm off\n"
            f"({self.subject} at {self.place_time:.2f} s), {np.degrees(self.angle):.1f} deg "
            f"(at {self.angle_time:.2f} s), {1e3 * abs(self.lag):.0f} ms {late}."
            + (f"\nIn the air it is {self.farther_foot} off." if self.farther_foot else "")
        )


def departures(plan: MotionPlan, model: RobotModel) -> tuple[Departure, ...]:
    """Of every part of ``plan`` that is the nearest to what was written, in order."""
    found = []
    for span in plan.dynamic if isinstance(plan, CompiledPlan) else ():
        if not isinstance(span.asked, PlanTarget):
            continue
        solved = span.trajectory
        misses = misses_of(span, feet_at(solved.q, solved.v, model)[0], model)
        away, turned = np.nan_to_num(misses.away), np.nan_to_num(misses.turned[:, 0])
        row, column = np.unravel_index(int(np.argmax(away)), away.shape)
        worst = int(np.argmax(turned))
        far, leg = np.unravel_index(int(np.argmax(misses.feet)), misses.feet.shape)
        found.append(
            Departure(
                start=span.start,
                end=span.end,
                place=float(away[row, column]),
                subject=SUBJECTS[column],
                place_time=span.start + float(misses.times[row]),
                angle=float(turned[worst]),
                angle_time=span.start + float(misses.times[worst]),
                lag=solved.lag,
                foot_place=float(misses.feet[far, leg]),
                foot=FOOT_NAMES[leg],
                foot_time=span.start + float(misses.times[far]),
            )
        )
    return tuple(found)


def departure_measurements(plan: MotionPlan, model: RobotModel) -> dict[str, float]:
    """How far ``plan`` is from what was written, at most, by name with unit; else nothing."""
    found = departures(plan, model)
    if not found:
        return {}
    farthest = max(found, key=lambda one: one.place)
    most_turned = max(found, key=lambda one: one.angle)
    foot = max(found, key=lambda one: one.foot_place)
    return {
        "plan off what was written [m]": farthest.place,
        "the same, at [s]": farthest.place_time,
        "plan turned off what was written [deg]": float(np.degrees(most_turned.angle)),
        "the same turn, at [s]": most_turned.angle_time,
        "plan's feet off what was written [m]": foot.foot_place,
        "the same foot, at [s]": foot.foot_time,
        "plan late [s]": max((one.lag for one in found), key=abs),
    }
