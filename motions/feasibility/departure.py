"""How far the nearest motion that the robot can do had to depart from what was written."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions.compiled_plan import CompiledPlan
from motions.dynamic_span import feet_at
from motions.dynamics.nearest import Written
from motions.feasibility.misses import of_written

SUBJECTS = ("trunk", *FOOT_NAMES)


@dataclass(frozen=True, slots=True)
class Departure:
    """Of one part of a motion, which could not be done as it was written.

    Attributes:
        start, end: when [s] of the motion.
        place: greatest distance [m] of the trunk, or of a foot that lands, from what was written.
        subject: of what.
        place_time: when [s].
        angle: greatest angle [rad] of the trunk from what was written.
        angle_time: when [s].
        lag: how late [s] the trunk is as a whole; below 0, early.
    """

    start: float
    end: float
    place: float
    subject: str
    place_time: float
    angle: float
    angle_time: float
    lag: float

    def __str__(self) -> str:
        """Two lines for a person, at most 80 columns wide."""
        late = "late" if self.lag >= 0.0 else "early"
        return (
            f"{self.start:.2f} to {self.end:.2f} s is the nearest to what was written: "
            f"{1e3 * self.place:.0f} mm off\n"
            f"({self.subject} at {self.place_time:.2f} s), {np.degrees(self.angle):.1f} deg "
            f"(at {self.angle_time:.2f} s), {1e3 * abs(self.lag):.0f} ms {late}."
        )


def departures(plan: MotionPlan, model: RobotModel) -> tuple[Departure, ...]:
    """Of every part of ``plan`` that is the nearest to what was written, in order."""
    found = []
    for span in plan.dynamic if isinstance(plan, CompiledPlan) else ():
        if not isinstance(span.asked, Written):
            continue
        solved = span.trajectory
        misses = of_written(span, feet_at(solved.q, solved.v, model)[0], model)
        away, turned = np.nan_to_num(misses.away), np.nan_to_num(misses.turned[:, 0])
        row, column = np.unravel_index(int(np.argmax(away)), away.shape)
        worst = int(np.argmax(turned))
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
    return {
        "plan off what was written [m]": farthest.place,
        "the same, at [s]": farthest.place_time,
        "plan turned off what was written [deg]": float(np.degrees(most_turned.angle)),
        "the same turn, at [s]": most_turned.angle_time,
        "plan late [s]": max((one.lag for one in found), key=abs),
    }
