"""Moves of the trunk and of the feet."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from motions import arguments
from motions.arguments import quantity, word
from motions.language.easing import EaseWord, easing
from motions.language.keys import (
    BODY_CHANNELS,
    ON_GROUND,
    BalanceShift,
    BodyKey,
    Frame,
    Key,
    LegKey,
    LegTarget,
    PostureKey,
)
from motions.language.timeline_data import TimelineData

POSES: Mapping[str, Mapping[str, float]] = {
    "home": {"x": 0.0, "y": 0.0, "z": 0.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.0},
    "low": {"z": -0.10},
    "high": {"z": 0.03},
    "bow": {"pitch": math.radians(18.0), "z": -0.05},
    "look_up": {"pitch": math.radians(-18.0)},
    "look_down": {"pitch": math.radians(15.0)},
    "look_left": {"yaw": math.radians(18.0)},
    "look_right": {"yaw": math.radians(-18.0)},
    "lean_left": {"roll": math.radians(-12.0), "y": 0.02},
    "lean_right": {"roll": math.radians(12.0), "y": -0.02},
}
"""Named poses of the trunk, as offsets [m, rad] from the posture in which the motion is; all are
reached from standing."""
_FRAMES = {frame.value: frame for frame in (Frame.GROUND, Frame.BODY)}
_POSTURES = {posture.value: posture for posture in Posture}


_Line = TypeVar("_Line", bound="BodyAndFeet")


class BodyAndFeet(TimelineData):
    """What the body and the feet do."""

    __slots__ = ()

    # --- what the body does ---------------------------------------------------------------

    def body(
        self: _Line,
        *,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        roll: float | None = None,
        pitch: float | None = None,
        yaw: float | None = None,
        over: float,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> _Line:
        """Move the trunk [m, rad]; what is left out keeps its value.

        Angles follow the right hand: pitch > 0 lowers the nose, roll > 0 leans right, yaw > 0
        turns left.
        """
        values = {"x": x, "y": y, "z": z, "roll": roll, "pitch": pitch, "yaw": yaw}
        given = {name: value for name, value in values.items() if value is not None}
        if not given:
            raise TimelineError(f"body() needs one of {', '.join(BODY_CHANNELS)}")
        start, end = self._span(over)
        curve = easing(ease)
        keys = [
            BodyKey(start, end, curve, name, quantity(name, value)) for name, value in given.items()
        ]
        return self._longer(keys, end)

    def posture(self: _Line, stance: Posture | str, *, over: float) -> _Line:
        """Move the trunk to another resting posture, on four feet; offsets count from there."""
        which = word("posture", stance, _POSTURES)
        start, end = self._span(over)
        return self._longer([PostureKey(start, end, Ease.MINIMUM_JERK, which)], end)

    def pose(self: _Line, name: str, *, over: float, ease: EaseWord = Ease.MINIMUM_JERK) -> _Line:
        """Move the trunk to a named pose: see ``POSES``."""
        if name not in POSES:
            raise TimelineError(unknown_name("pose", name, POSES))
        return self.body(**POSES[name], over=over, ease=ease)

    # --- what the feet do -----------------------------------------------------------------

    def foot(
        self: _Line,
        leg: Leg | str,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        over: float,
        frame: Frame | str = Frame.GROUND,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> _Line:
        """Move a foot [m] from where it stands; with ``frame="body"`` it goes with the trunk.

        It is on the ground again when x, y and z are 0 in the frame of the ground.
        """
        place = (quantity("x", x), quantity("y", y), quantity("z", z))
        in_frame = word("frame", frame, _FRAMES)
        if in_frame is Frame.GROUND and place[2] < 0.0:
            raise TimelineError(f"foot() cannot go below the ground: z is {z}")
        target = LegTarget(in_frame, place)
        return self._move_leg(arguments.foot(leg), target, over, ease)

    def leg(
        self: _Line,
        leg: Leg | str,
        *,
        hip: float,
        thigh: float,
        calf: float,
        over: float,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> _Line:
        """Move the joints of a raised leg to these angles [rad]."""
        angles = (quantity("hip", hip), quantity("thigh", thigh), quantity("calf", calf))
        target = LegTarget(Frame.JOINTS, angles)
        return self._move_leg(arguments.foot(leg), target, over, ease)

    def unweight(self: _Line, leg: Leg | str, *, over: float) -> _Line:
        """Move the trunk over the other feet, so that this one can be raised.

        ``foot`` and ``leg`` do so by themselves; this is for choosing when, and how fast.
        """
        start, end = self._span(over)
        raised = self.raised | {arguments.foot(leg)}
        return self._longer([BalanceShift(start, end, Ease.MINIMUM_JERK, raised)], end)

    def down(self: _Line, leg: Leg | str, *, over: float) -> _Line:
        """Put a raised foot back where it stood."""
        which = arguments.foot(leg)
        if which not in self.raised:
            raise TimelineError(f"down(): foot {which.name} is not raised")
        return self._move_leg(which, ON_GROUND, over, Ease.MINIMUM_JERK)

    def home(self: _Line, *, over: float) -> _Line:
        """Put every raised foot down, then bring the trunk back to its posture."""
        line = self
        for leg in sorted(self.raised):
            line = replace(line, cursor=self.cursor).down(leg, over=over)
        start, end = line._span(over)
        keys: list[Key] = [
            BodyKey(start, end, Ease.MINIMUM_JERK, channel, 0.0)
            for channel in BODY_CHANNELS
            if line.body_value(channel) != 0.0
        ]
        if line.shifted_for:
            keys.append(BalanceShift(start, end, Ease.MINIMUM_JERK, frozenset()))
        return line._longer(keys, end)

    def _move_leg(self: _Line, leg: Leg, target: LegTarget, over: float, ease: EaseWord) -> _Line:
        line, is_raised = self, leg in self.raised
        if target.is_on_ground and not is_raised:
            raise TimelineError(f"foot {leg.name} is on the ground already: raise it, z > 0")
        if not is_raised:
            line = self._shifted(self.raised | {leg})
        start, end = line._span(over)
        return line._longer([LegKey(start, end, easing(ease), leg, target)], end)
