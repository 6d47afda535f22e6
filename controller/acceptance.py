"""Whether a motion that was played was done: by its held feet, its end, and what touched."""

from __future__ import annotations

import math
from statistics import fmean

from controller.behaviours.plans import PlayPlan
from controller.modes import Aborted, Limited, Measurements, are_within, ground_height, told
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.plant import Plant
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.landing import Landings
from go2_wbc.tracking.plan_tracking import Deviation

TOUCH_FORCE = 1.0  #: Force [N] of the ground on trunk or legs that counts as a touch
TOUCH_TIME = 0.01
"""Time [s] for which they may touch it in a motion: what the benchmarks call a touch."""
PAW_TOLERANCE = 0.03
"""Distance [m] that a foot, on the average of its hold, may be below its planned height."""
PLACE_DEVIATION, ATTITUDE_DEVIATION = 0.03, 0.1
"""Distance [m] of the tracked point, and angle [rad] of the trunk, that it may be off its plan, on
the average."""
DYNAMIC_PLACE, DYNAMIC_ATTITUDE = 0.05, math.radians(8.0)
"""The same of plans with jumps, rears and lifts: as far as a plan may be from what was asked
(``motions.dynamics.Tolerance``). A rear at -25 deg was up to 32 mm and 6.6 deg off."""
JOINT_DEVIATION = 0.2
"""Angle [rad] that the worst joint of a raised leg may be off its plan, on the average."""
END_PLACE = 0.05
"""Distance [m] from its planned end at which a motion that moves on may end: what is asked of a
walk of 2 m."""
END_HEADING = math.radians(4.0)  #: Angle [rad] by which its end may be turned


class Acceptance:
    """Watches a motion while it is played, and judges it."""

    def __init__(self, plan: MotionPlan, plant: Plant) -> None:
        self._plan, self._plant, self._held = plan, plant, plan.held_feet
        self._touched = 0.0
        self._heights: list[list[float]] = [[] for _ in self._held]

    def note(self, snapshot: Snapshot, t: float) -> None:
        """Once a tick, ``t`` seconds into the plan."""
        force = self._plant.body_contact_force  # None from a plant that cannot tell
        if force is not None and force > TOUCH_FORCE:
            self._touched += self._plant.control_period
        for foot, heights in zip(self._held, self._heights, strict=True):
            if foot.start <= t <= foot.end:
                heights.append(float(snapshot.p_world_feet[foot.leg, 2]) - ground_height(snapshot))

    def judged(self, played: PlayPlan, snapshot: Snapshot, at_rest: Measurements) -> Measurements:
        """What was measured of it, if that shows that it was done; else raise ``Aborted``.

        Args:
            played: the motion, which is over.
            snapshot: of the robot at rest.
            at_rest: what was measured of it then.
        """
        plan = self._plan
        if self._touched > TOUCH_TIME and Posture.LIE not in (plan.entry, plan.exit):
            raise Aborted(
                f"{plan.name} touched the ground with trunk or legs for {self._touched:.2f} s"
            )
        deviation = off_plan(played.deviation, is_dynamic=plan.has_dynamic_spans)
        end: Limited = {}
        if plan.footsteps is not None:
            end = arrival(*played.end_error(snapshot), played.landings)
        found = {name: value for name, (value, _) in {**deviation, **end}.items()}
        measured = {**at_rest, **found}
        if not are_within(end):
            raise Aborted(f"{plan.name} ended elsewhere: {told(end)}", measured)
        if not are_within(deviation):
            raise Aborted(f"{plan.name} went another way: {told(deviation)}", measured)
        return self.with_held_feet(measured)

    def with_held_feet(self, measured: Measurements) -> Measurements:
        """``measured`` and how high feet were held, if that is as planned; else ``Aborted``."""
        found, low = dict(measured), list[str]()
        for foot, heights in zip(self._held, self._heights, strict=True):
            where = f" in {foot.name}" if len(self._held) > 1 else ""
            found[f"planned paw height{where} [m]"] = round(foot.height, 9)  # of a curve
            found[f"least paw height{where} [m]"] = min(heights)
            found[name := f"mean paw height{where} [m]"] = mean = fmean(heights)
            if mean < (least := foot.height - PAW_TOLERANCE):
                low.append(f"{name} {mean:.3g}, at least {least:.3g}")
        if low:
            reason = f"{self._plan.name} held no paw at its height: {', '.join(low)}"
            raise Aborted(reason, found)
        return found


def off_plan(deviation: Deviation, *, is_dynamic: bool = False) -> Limited:
    """How far the robot was off its plan; ``is_dynamic`` if that has spans that are solved."""
    place = DYNAMIC_PLACE if is_dynamic else PLACE_DEVIATION
    attitude = DYNAMIC_ATTITUDE if is_dynamic else ATTITUDE_DEVIATION
    degrees = math.degrees
    found: dict[str, tuple[float, float | None]] = {
        "mean place off plan [m]": (deviation.place, place),
        "mean attitude off plan [deg]": (degrees(deviation.attitude), degrees(attitude)),
    }
    if deviation.joints is not None:
        joints = degrees(deviation.joints), degrees(JOINT_DEVIATION)
        found["mean joints off plan [deg]"] = joints
    return found


def arrival(place: float, heading: float, landings: Landings) -> Limited:
    """How a motion that moves on has ended: where it was to end, and every foot landed?

    Args:
        place: distance [m] of the feet's middle from there.
        heading: angle [rad] by which they are turned.
        landings: what came of its steps.
    """
    landed = {} if landings.error is None else {"worst landing error [m]": (landings.error, None)}
    return {
        "end place error [m]": (place, END_PLACE),
        "end heading error [rad]": (heading, END_HEADING),
        **landed,
        "missed landings": (float(landings.missed), 1.0),
    }
