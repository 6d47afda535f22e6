"""Moves of the trunk and of the feet, and what is made of them: paths, a gaze, one joint alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Self

from go2_wbc.arguments import typed
from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from motions import arguments
from motions.arguments import is_number, positive, quantity, word
from motions.language.keys import (
    BODY_CHANNELS,
    ON_GROUND,
    BalanceShift,
    BodyKey,
    BodyPathKey,
    EaseWord,
    Frame,
    JointKey,
    Key,
    LegKey,
    LegTarget,
    PostureKey,
    easing,
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
EYES = 0.31
"""Height [m] of the standing trunk's axis, which passes through the head, over the ground."""
NEAREST = 0.4
"""Least distance [m] from the trunk's middle to what it looks at: the head is 0.35 m ahead."""
_JOINTS = ("hip", "thigh", "calf")
_FRAMES = {frame.value: frame for frame in (Frame.GROUND, Frame.BODY)}
_POSTURES = {posture.value: posture for posture in Posture}


class BodyAndFeet(TimelineData):
    """What the body and the feet do."""

    __slots__ = ()

    # --- what the body does ---------------------------------------------------------------

    def body(
        self,
        *,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        roll: float | None = None,
        pitch: float | None = None,
        yaw: float | None = None,
        over: float,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> Self:
        """Move the trunk [m, rad]; what is left out keeps its value.

        Angles follow the right hand: pitch > 0 lowers the nose, roll > 0 leans right, yaw > 0
        turns left.

        Raises:
            TimelineError: for no channel, a value that is no length or angle, or a wrong ease.
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

    def posture(self, stance: Posture | str, *, over: float) -> Self:
        """Move the trunk to another resting posture, on four feet; offsets count from there.

        Raises:
            TimelineError: for an unknown posture.
        """
        which = word("posture", stance, _POSTURES)
        start, end = self._span(over)
        return self._longer([PostureKey(start, end, Ease.MINIMUM_JERK, which)], end)

    @typed("name", error=TimelineError)
    def pose(self, name: str, *, over: float, ease: EaseWord = Ease.MINIMUM_JERK) -> Self:
        """Move the trunk to a named pose: see ``POSES``.

        Raises:
            TimelineError: for an unknown pose.
        """
        if name not in POSES:
            raise TimelineError(unknown_name("pose", name, POSES))
        return self.body(**POSES[name], over=over, ease=ease)

    @typed("times", error=TimelineError)
    def body_path(
        self,
        points: Sequence[Mapping[str, float]],
        *,
        over: float,
        times: Sequence[float] | None = None,
    ) -> Self:
        """Move the trunk through ``points`` without a stop, by a smooth curve.

        Args:
            points: places to pass, each with the same channels of ``body`` (x, y, z [m], roll,
                pitch, yaw [rad]); the last one is where it ends, at rest.
            over: time for all of them.
            times: when each is passed, counted from the start of this move in the unit of ``over``;
                the last one is ``over``. Without them they are evenly spaced.

        Raises:
            TimelineError: for points, times or values that are not as above.
        """
        if not (
            isinstance(points, Sequence) and all(isinstance(point, Mapping) for point in points)
        ):
            raise TimelineError(
                f"body_path() needs a list of points such as dict(x=0.05), got {points!r}"
            )
        shares = _shares(len(points), over, times)
        for point in points:
            for channel in point:
                if channel not in BODY_CHANNELS:
                    raise TimelineError(unknown_name("channel", channel, BODY_CHANNELS))
            if set(point) != set(points[0]) or not point:
                raise TimelineError(
                    f"body_path() needs the same channels in every point, got {dict(points[0])} "
                    f"and {dict(point)}"
                )
        start, end = self._span(over)
        keys = []
        for channel in points[0]:
            *through, last = (quantity(channel, point[channel]) for point in points)
            way = (Ease.LINEAR, channel, last, tuple(through), shares)
            keys.append(BodyPathKey(start, end, *way))
        return self._longer(keys, end)

    @typed("x", "y", "z", error=TimelineError)
    def look_at(
        self, x: float, y: float, z: float, *, over: float, ease: EaseWord = Ease.MINIMUM_JERK
    ) -> Self:
        """Turn the trunk (yaw, pitch) so that its axis, and the head, points at a place.

        Args:
            x, y, z: the place [m], x ahead and y left of where the motion starts, z above the
                ground. The trunk looks from where it is standing with its present offsets.
            over, ease: as for ``body``.

        Raises:
            TimelineError: for a place that is too near, or a value that is no length.
        """
        for name, value in {"x": x, "y": y, "z": z}.items():
            if not is_number(value):
                raise TimelineError(f"look_at(): {name} must be a finite number, got {value!r}")
        ahead, left = x - self.body_value("x"), y - self.body_value("y")
        up, level = z - EYES - self.body_value("z"), math.hypot(ahead, left)
        if level < NEAREST:
            raise TimelineError(
                f"look_at() needs a place {NEAREST} m or farther from the trunk's middle, level; "
                f"this one is {level:.2f} m"
            )
        yaw, pitch = math.atan2(left, ahead), -math.atan2(up, level)
        return self.body(yaw=yaw, pitch=pitch, over=over, ease=ease)

    # --- what the feet do -----------------------------------------------------------------

    def foot(
        self,
        leg: Leg | str,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        over: float,
        frame: Frame | str = Frame.GROUND,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> Self:
        """Move a foot [m] from where it stands; with ``frame="body"`` it goes with the trunk.

        It is on the ground again when x, y and z are 0 in the frame of the ground.

        Raises:
            TimelineError: for an unknown foot, a place below the ground, or a wrong value.
        """
        place = (quantity("x", x), quantity("y", y), quantity("z", z))
        in_frame = word("frame", frame, _FRAMES)
        if in_frame is Frame.GROUND and place[2] < 0.0:
            raise TimelineError(f"foot() cannot go below the ground: z is {z}")
        target = LegTarget(in_frame, place)
        return self._move_leg(arguments.foot(leg), target, over, ease)

    def leg(
        self,
        leg: Leg | str,
        *,
        hip: float,
        thigh: float,
        calf: float,
        over: float,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> Self:
        """Move the joints of a raised leg to these angles [rad].

        Raises:
            TimelineError: for an unknown leg, or a value that is no angle.
        """
        angles = (quantity("hip", hip), quantity("thigh", thigh), quantity("calf", calf))
        target = LegTarget(Frame.JOINTS, angles)
        return self._move_leg(arguments.foot(leg), target, over, ease)

    def joint(
        self,
        leg: Leg | str,
        joint: str,
        angle: float,
        *,
        over: float,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> Self:
        """Move one joint of a raised leg, "hip", "thigh" or "calf", to ``angle`` [rad].

        The leg's other joints keep the angles that they have; so it must have been raised by
        ``leg``, or by ``foot`` in the frame of the body: on its way with the ground it has no
        angles of its own.

        Raises:
            TimelineError: for an unknown joint, a foot on the ground, or a wrong value.
        """
        which = arguments.foot(leg)
        if str(joint) not in _JOINTS:
            raise TimelineError(unknown_name("joint", str(joint), _JOINTS))
        before = [key.target for key in self.in_order(LegKey) if key.leg is which]
        if not before or before[-1].frame is Frame.GROUND:
            raise TimelineError(
                f"joint(): foot {which.name} is held in the frame of the ground: raise it first by "
                'leg(), or by foot(frame="body")'
            )
        index, value = _JOINTS.index(joint), quantity(joint, angle)
        hip, thigh, calf = (value if k == index else 0.0 for k in range(3))
        target, (start, end) = LegTarget(Frame.JOINTS, (hip, thigh, calf)), self._span(over)
        return self._longer([JointKey(start, end, easing(ease), which, target, index)], end)

    def unweight(self, leg: Leg | str, *, over: float) -> Self:
        """Move the trunk over the other feet, so that this one can be raised.

        ``foot`` and ``leg`` do so by themselves; this is for choosing when, and how fast.
        """
        start, end = self._span(over)
        raised = self.raised | {arguments.foot(leg)}
        return self._longer([BalanceShift(start, end, Ease.MINIMUM_JERK, raised)], end)

    def down(self, leg: Leg | str, *, over: float, ease: EaseWord = Ease.MINIMUM_JERK) -> Self:
        """Put a raised foot back where it stood; with ``ease="in"`` it touches at the end.

        One that comes to rest on the ground touches it earlier, as the trunk is some mm too low.

        Raises:
            TimelineError: if the foot is not raised.
        """
        which = arguments.foot(leg)
        if which not in self.raised:
            raise TimelineError(f"down(): foot {which.name} is not raised")
        return self._move_leg(which, ON_GROUND, over, ease)

    def home(self, *, over: float) -> Self:
        """Put every raised foot down, then bring the trunk back to its posture."""
        line = self
        for leg in sorted(self.raised):
            line = replace(line, cursor=self.cursor).down(leg, over=over)
        values, (start, end) = line._body_values, line._span(over)
        keys: list[Key] = [
            BodyKey(start, end, Ease.MINIMUM_JERK, channel, 0.0)
            for channel in BODY_CHANNELS
            if values.get(channel)
        ]
        if line.shifted_for:
            keys.append(BalanceShift(start, end, Ease.MINIMUM_JERK, frozenset()))
        return line._longer(keys, end)

    def _move_leg(self, leg: Leg, target: LegTarget, over: float, ease: EaseWord) -> Self:
        line, is_raised = self, leg in self.raised
        if target.is_on_ground and not is_raised:
            raise TimelineError(f"foot {leg.name} is on the ground already: raise it, z > 0")
        if not is_raised:
            line = self._shifted(self.raised | {leg})
        start, end = line._span(over)
        return line._longer([LegKey(start, end, easing(ease), leg, target)], end)


def _shares(count: int, over: float, times: Sequence[float] | None) -> tuple[float, ...]:
    """Shares of the time at which all points but the last are passed."""
    if count < 2:
        raise TimelineError(f"body_path() needs two points or more, got {count}")
    if times is None:
        return tuple((k + 1) / count for k in range(count - 1))
    whole, passed = positive("over", over), list(times)
    is_rising = all(is_number(t) for t in passed) and all(
        b > a for a, b in zip([0.0, *passed], passed, strict=False)
    )
    if len(passed) != count or not is_rising or not math.isclose(passed[-1], whole):
        raise TimelineError(
            f"body_path() needs a time above 0 for each of its {count} points, one after the "
            f"other, the last of them over={over:g}, got {passed}"
        )
    return tuple(t / whole for t in passed[:-1])
