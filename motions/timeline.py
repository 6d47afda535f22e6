"""The authoring language: what body and feet do, and when.

A ``Timeline`` is a value; every method returns a longer one. Time is a cursor that each call moves
on by ``over`` seconds (beats, after ``bpm``); ``at`` puts it elsewhere and ``together`` runs parts
side by side. Places are offsets from the pose in which the motion starts: x ahead, y left, z up.

    Timeline().body(pitch=deg(15), z=-0.05, over=0.8).hold(0.4).home(over=0.8)

A foot that is raised is off the ground until it is put down; the body first moves over the feet
that stay, unless the motion is made with ``balance=False``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import Leg
from go2_wbc.reference import Posture
from motions.arguments import is_number, positive, quantity, word
from motions.keys import (
    BODY_CHANNELS,
    BalanceShift,
    BodyKey,
    Frame,
    Key,
    LegKey,
    LegTarget,
    Mark,
    PostureKey,
)
from motions.poses import POSES

SHIFT_TIME = 0.9
"""Time [s] in which the body moves over the feet that stay, before another one is raised."""
SAME = 1e-9
"""Times this close [s] are the same: absorbs rounding of sums."""
_EASES = {ease.value: ease for ease in Ease}
_FRAMES = {frame.value: frame for frame in (Frame.GROUND, Frame.BODY)}
_POSTURES = {posture.value: posture for posture in Posture}

_KeyType = TypeVar("_KeyType", bound=Key)


def deg(angle: float) -> float:
    """``angle`` degrees in radians."""
    return math.radians(angle)


@dataclass(frozen=True, slots=True)
class Timeline:
    """An authored motion.

    Attributes:
        entry: posture in which it starts.
        exit: posture in which it ends.
        name: what to call it.
        balance: whether the body moves over the standing feet before one is raised.
        shift_time: how long [s] that takes, before a tempo is set.
        shift_beats: how many beats it takes with a tempo; 0 without one.
        keys: what was written so far.
        cursor: when [s] the next call starts.
        beat: seconds that one unit of ``over`` lasts.
        last_start: when [s] the last call's move starts.
        floor: the cursor does not fall behind this time [s] after ``also``.
    """

    entry: Posture = Posture.STAND
    exit: Posture = Posture.STAND
    name: str = field(default="motion", kw_only=True)
    balance: bool = field(default=True, kw_only=True)
    shift_time: float = field(default=SHIFT_TIME, kw_only=True)
    keys: tuple[Key, ...] = field(default=(), kw_only=True)
    cursor: float = field(default=0.0, kw_only=True)
    beat: float = field(default=1.0, kw_only=True)
    shift_beats: float = field(default=0.0, kw_only=True)
    last_start: float = field(default=0.0, kw_only=True)
    floor: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        """Raise TimelineError for postures that are none, or a track that moves twice at once."""
        for name in ("entry", "exit"):
            if not isinstance(getattr(self, name), Posture):
                valid = ", ".join(f"Posture.{posture.name}" for posture in Posture)
                raise TimelineError(f"{name} must be one of {valid}, got {getattr(self, name)!r}")
        positive("shift_time", self.shift_time)
        _require_no_overlap(self.keys)

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
        ease: Ease | str = Ease.MINIMUM_JERK,
    ) -> Timeline:
        """Move the trunk [m, rad]; what is left out keeps its value.

        Angles follow the right hand: pitch > 0 lowers the nose, roll > 0 leans right, yaw > 0
        turns left.
        """
        values = {"x": x, "y": y, "z": z, "roll": roll, "pitch": pitch, "yaw": yaw}
        given = {name: value for name, value in values.items() if value is not None}
        if not given:
            raise TimelineError(f"body() needs one of {', '.join(BODY_CHANNELS)}")
        start, end = self._span(over)
        curve = word("ease", ease, _EASES)
        keys = [
            BodyKey(start, end, curve, name, quantity(name, value)) for name, value in given.items()
        ]
        return self._longer(keys, end)

    def posture(self, stance: Posture | str, *, over: float) -> Timeline:
        """Move the trunk to another resting posture, on four feet; offsets count from there."""
        which = word("posture", stance, _POSTURES)
        start, end = self._span(over)
        return self._longer([PostureKey(start, end, Ease.MINIMUM_JERK, which)], end)

    def pose(self, name: str, *, over: float, ease: Ease | str = Ease.MINIMUM_JERK) -> Timeline:
        """Move the trunk to a named pose: see ``POSES``."""
        if name not in POSES:
            raise TimelineError(unknown_name("pose", name, POSES))
        return self.body(**POSES[name], over=over, ease=ease)

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
        ease: Ease | str = Ease.MINIMUM_JERK,
    ) -> Timeline:
        """Move a foot [m] from where it stands; with ``frame="body"`` it goes with the trunk.

        It is on the ground again when x, y and z are 0 in the frame of the ground.
        """
        place = (quantity("x", x), quantity("y", y), quantity("z", z))
        in_frame = word("frame", frame, _FRAMES)
        if in_frame is Frame.GROUND and place[2] < 0.0:
            raise TimelineError(f"foot() cannot go below the ground: z is {z}")
        target = LegTarget(in_frame, place)
        return self._move_leg(word("foot", leg, Leg.__members__), target, over, ease)

    def leg(
        self,
        leg: Leg | str,
        *,
        hip: float,
        thigh: float,
        calf: float,
        over: float,
        ease: Ease | str = Ease.MINIMUM_JERK,
    ) -> Timeline:
        """Move the joints of a raised leg to these angles [rad]."""
        angles = (quantity("hip", hip), quantity("thigh", thigh), quantity("calf", calf))
        target = LegTarget(Frame.JOINTS, angles)
        return self._move_leg(word("foot", leg, Leg.__members__), target, over, ease)

    def unweight(self, leg: Leg | str, *, over: float) -> Timeline:
        """Move the trunk over the other feet, so that this one can be raised.

        ``foot`` and ``leg`` do so by themselves; this is for choosing when, and how fast.
        """
        start, end = self._span(over)
        raised = self.raised | {word("foot", leg, Leg.__members__)}
        return self._longer([BalanceShift(start, end, Ease.MINIMUM_JERK, raised)], end)

    def down(self, leg: Leg | str, *, over: float) -> Timeline:
        """Put a raised foot back where it stood."""
        which = word("foot", leg, Leg.__members__)
        if which not in self.raised:
            raise TimelineError(f"down(): foot {which.name} is not raised")
        return self._move_leg(which, LegTarget.on_ground(), over, Ease.MINIMUM_JERK)

    # --- time -----------------------------------------------------------------------------

    def hold(self, seconds: float, *, name: str = "") -> Timeline:
        """Stay as it is for this long; ``name`` marks the span for who looks at the result."""
        start, end = self._span(seconds)
        marks = [Mark(start, end, Ease.LINEAR, name)] if name else []
        return self._longer(marks, end)

    def also(self) -> Timeline:
        """Let the next call start when the last one's move starts, not when it ends."""
        return replace(self, cursor=self.last_start, floor=self.cursor)

    def home(self, *, over: float) -> Timeline:
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

    def at(self, t: float) -> Timeline:
        """Put the cursor ``t`` seconds (beats) after the start of the motion."""
        if not (is_number(t) and t >= 0.0):
            raise TimelineError(f"at() needs a time of 0 s or later, got {t!r}")
        return replace(self, cursor=t * self.beat)

    def bpm(self, beats_per_minute: float, *, shift_time: float | None = None) -> Timeline:
        """Count ``over``, ``hold`` and ``at`` in beats from here on.

        Before a foot is raised the trunk then moves aside in ``shift_time`` beats; by default in
        the fewest whole beats that are no shorter than the timeline's ``shift_time``.
        """
        beat = 60.0 / positive("bpm", beats_per_minute)
        if shift_time is None:
            return replace(self, beat=beat, shift_beats=math.ceil(self.shift_time / beat - SAME))
        return replace(self, beat=beat, shift_beats=positive("shift_time", shift_time))

    # --- putting motions together ---------------------------------------------------------

    def then(self, *others: Timeline) -> Timeline:
        """This motion, then the others; each starts in the posture in which the last one ends.

        Raises:
            TimelineError: if the postures differ, or one before the last does not end at home.
        """
        line = self
        for other in others:
            if other.entry is not line.exit:
                raise TimelineError(
                    f"then(): this ends in {line.exit.value}, the next starts in "
                    f"{other.entry.value}"
                )
            line._require_home("then()")
            line = replace(line._joined(other, line.end), exit=other.exit)
        return line

    def together(self, *others: Timeline) -> Timeline:
        """Do all of ``others`` at the same time, from the cursor on; they may not share a part."""
        line, start = self, self.cursor
        for other in others:
            line = line._joined(other, start)
        return replace(line, cursor=max([start, *(start + other.end for other in others)]))

    def repeat(self, times: int) -> Timeline:
        """This whole motion, ``times`` times one after another; it must end as it began."""
        if isinstance(times, bool) or not isinstance(times, int) or times < 1:
            raise TimelineError(f"repeat() needs a whole number of 1 or more, got {times!r}")
        return self.then(*[self] * (times - 1))

    def mirror(self) -> Timeline:
        """The same motion with left and right exchanged."""
        return replace(self, keys=tuple(key.mirrored for key in self.keys))

    # --- what is written ------------------------------------------------------------------

    @property
    def end(self) -> float:
        """When [s] the last part ends."""
        return max([self.cursor, *(key.end for key in self.keys)])

    @property
    def raised(self) -> frozenset[Leg]:
        """Legs whose last key leaves them in the air."""
        last = {key.leg: key.target for key in self.in_order(LegKey)}
        return frozenset(leg for leg, target in last.items() if not target.is_on_ground)

    @property
    def shifted_for(self) -> frozenset[Leg]:
        """Legs for whose absence the trunk has moved over the other feet."""
        shifts = self.in_order(BalanceShift)
        return shifts[-1].raised if shifts else frozenset()

    def body_value(self, channel: str) -> float:
        """Where the last key leaves a channel of the body."""
        values = [key.value for key in self.in_order(BodyKey) if key.channel == channel]
        return values[-1] if values else 0.0

    def in_order(self, kind: type[_KeyType]) -> list[_KeyType]:
        """Its keys of one kind, by their starts."""
        keys = [key for key in self.keys if isinstance(key, kind)]
        return sorted(keys, key=lambda key: key.start)

    # --- how it is written ----------------------------------------------------------------

    def _move_leg(self, leg: Leg, target: LegTarget, over: float, ease: Ease | str) -> Timeline:
        line, is_raised = self, leg in self.raised
        if target.is_on_ground and not is_raised:
            raise TimelineError(f"foot {leg.name} is on the ground already: raise it, z > 0")
        if not is_raised:
            line = self._shifted(self.raised | {leg})
        start, end = line._span(over)
        return line._longer([LegKey(start, end, word("ease", ease, _EASES), leg, target)], end)

    def _shifted(self, raised: frozenset[Leg]) -> Timeline:
        if not self.balance or self.shifted_for == raised:
            return self
        end = self.cursor + (self.shift_beats * self.beat or self.shift_time)
        return self._longer([BalanceShift(self.cursor, end, Ease.MINIMUM_JERK, raised)], end)

    def _longer(self, keys: Sequence[Key], cursor: float) -> Timeline:
        return replace(
            self,
            keys=(*self.keys, *keys),
            cursor=max(cursor, self.floor),
            last_start=min((key.start for key in keys), default=self.cursor),
            floor=0.0,
        )

    def _joined(self, other: Timeline, start: float) -> Timeline:
        return self._longer([key.later(start) for key in other.keys], start + other.end)

    def _require_home(self, what: str) -> None:
        away = [f"body {name}" for name in BODY_CHANNELS if self.body_value(name) != 0.0]
        away += [f"foot {leg.name}" for leg in sorted(self.raised)]
        if self.shifted_for:
            away.append("balance")
        if away:
            raise TimelineError(f"{what} needs motions that end at home(); away: {', '.join(away)}")

    def _span(self, over: float) -> tuple[float, float]:
        return self.cursor, self.cursor + positive("over", over) * self.beat


def _require_no_overlap(keys: Sequence[Key]) -> None:
    last: dict[str, Key] = {}
    for key in sorted(keys, key=lambda key: key.start):
        before = last.get(key.track)
        if before is not None and key.start < before.end - SAME:
            raise TimelineError(
                f"{key.track} moves twice at once: {before.start:.2f} to {before.end:.2f} s and "
                f"{key.start:.2f} to {key.end:.2f} s"
            )
        last[key.track] = key
