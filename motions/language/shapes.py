"""Moves that are made of others: paths through many points, a gaze, one joint alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeVar

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import Leg
from motions import arguments
from motions.arguments import is_number, positive, quantity
from motions.language.body_and_feet import BodyAndFeet
from motions.language.easing import EaseWord, easing
from motions.language.keys import BODY_CHANNELS, BodyPathKey, Frame, JointKey, LegKey, LegTarget

EYES = 0.31
"""Height [m] of the standing trunk's axis, which passes through the head, over the ground."""
NEAREST = 0.4
"""Least distance [m] from the trunk's middle to what it looks at: the head is 0.35 m ahead."""
_JOINTS = ("hip", "thigh", "calf")

_Line = TypeVar("_Line", bound="Shapes")


class Shapes(BodyAndFeet):
    """Paths, gaze, single joints."""

    __slots__ = ()

    def body_path(
        self: _Line,
        points: Sequence[Mapping[str, float]],
        *,
        over: float,
        times: Sequence[float] | None = None,
    ) -> _Line:
        """Move the trunk through ``points`` without a stop, by a smooth curve.

        Args:
            points: places to pass, each with the same channels of ``body`` (x, y, z [m], roll,
                pitch, yaw [rad]); the last one is where it ends, at rest.
            over: time for all of them.
            times: when each is passed, counted from the start of this move in the unit of ``over``;
                the last one is ``over``. Without them they are evenly spaced.
        """
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

    def look_at(
        self: _Line,
        x: float,
        y: float,
        z: float,
        *,
        over: float,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> _Line:
        """Turn the trunk (yaw, pitch) so that its axis, and the head, points at a place.

        Args:
            x, y, z: the place [m], x ahead and y left of where the motion starts, z above the
                ground. The trunk looks from where it is standing with its present offsets.
            over, ease: as for ``body``.
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

    def joint(
        self: _Line,
        leg: Leg | str,
        joint: str,
        angle: float,
        *,
        over: float,
        ease: EaseWord = Ease.MINIMUM_JERK,
    ) -> _Line:
        """Move one joint of a raised leg, "hip", "thigh" or "calf", to ``angle`` [rad].

        The leg's other joints keep the angles that they have; so it must have been raised by
        ``leg``, or by ``foot`` in the frame of the body: on its way with the ground it has no
        angles of its own.
        """
        which = arguments.foot(leg)
        if joint not in _JOINTS:
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
