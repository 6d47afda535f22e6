"""Whether a motion that was played was done: by its held feet, its end, and what touched."""

from __future__ import annotations

from statistics import fmean

from controller.behaviours.plans import PlayPlan
from controller.checks import (
    arrival_measurements,
    deviation_measurements,
    ground_height,
    has_arrived,
    is_small,
)
from controller.modes import Aborted, Measurements, listed
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.plant import Plant
from go2_wbc.robot.snapshot import Snapshot

TOUCH_FORCE = 1.0
"""Force [N] of the ground on trunk or legs that counts as a touch."""
TOUCH_TIME = 0.01
"""Time [s] for which they may touch it in a motion: what the benchmarks call a touch."""
PAW_TOLERANCE = 0.03
"""Distance [m] that a foot, on the average of its hold, may be below its planned height."""


class Touches:
    """Counts for how long more than the feet touches the ground, on a plant that can tell."""

    def __init__(self, plant: Plant) -> None:
        """Count on ``plant``."""
        self._plant, self._time = plant, 0.0

    def note(self) -> None:
        """Once a tick."""
        force = self._plant.body_contact_force
        if force is not None and force > TOUCH_FORCE:
            self._time += self._plant.control_period

    def require_few(self, plan: MotionPlan) -> None:
        """Raise ``Aborted`` if it was for longer than ``TOUCH_TIME``, unless the robot may lie."""
        if self._time > TOUCH_TIME and Posture.LIE not in (plan.entry, plan.exit):
            raise Aborted(
                f"{plan.name} touched the ground with trunk or legs for {self._time:.2f} s"
            )


class HeldFeet:
    """Measures how high the feet are held that a plan holds up."""

    def __init__(self, plan: MotionPlan) -> None:
        """None may be held."""
        self._plan, self._held = plan, plan.held_feet
        self._heights: list[list[float]] = [[] for _ in self._held]

    def note(self, snapshot: Snapshot, t: float) -> None:
        """Once a tick, ``t`` seconds into the plan."""
        for foot, heights in zip(self._held, self._heights, strict=True):
            if foot.start <= t <= foot.end:
                heights.append(float(snapshot.p_world_feet[foot.leg, 2]) - ground_height(snapshot))

    def judged(self, measured: Measurements) -> Measurements:
        """``measured`` with the heights, if they are those of the plan; else raise ``Aborted``."""
        found, is_low = dict(measured), False
        for foot, heights in zip(self._held, self._heights, strict=True):
            where = f" in {foot.name}" if len(self._held) > 1 else ""
            found[f"planned paw height{where} [m]"] = round(foot.height, 9)  # of a curve
            found[f"least paw height{where} [m]"] = min(heights)
            found[f"mean paw height{where} [m]"] = fmean(heights)
            is_low = is_low or fmean(heights) < foot.height - PAW_TOLERANCE
        if is_low:
            name = self._plan.name
            raise Aborted(f"{name} held no paw at its height: {listed(found)}", found)
        return found


def judged(played: PlayPlan, snapshot: Snapshot, at_rest: Measurements) -> Measurements:
    """What was measured of a motion, if that shows that it was done; else raise ``Aborted``.

    Args:
        played: the motion, which is over.
        snapshot: of the robot at rest.
        at_rest: what was measured of it then.
    """
    deviation, name = played.deviation, played.plan.name
    measured = {**at_rest, **deviation_measurements(deviation)}
    if played.plan.footsteps is not None:
        arrival = *played.end_error(snapshot), played.landings
        measured |= arrival_measurements(*arrival)
        if not has_arrived(*arrival):
            raise Aborted(f"{name} ended elsewhere: {listed(measured)}", measured)
    if not is_small(deviation, is_dynamic=played.plan.has_dynamic_spans):
        raise Aborted(f"{name} went another way: {listed(measured)}", measured)
    return measured
