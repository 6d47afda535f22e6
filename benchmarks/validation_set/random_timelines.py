"""Timelines drawn at random over the whole language, to set limits and chances by.

Families of the validation set are structures that somebody thought of. These are what a grammar
makes: one to three blocks, each of a kind that is drawn with all its numbers, one after the other.
A timeline is written six times, ever larger, quicker or both, until most cannot be done. None of
them judges.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from benchmarks.validation_set.drawing import BODY_SIZES, CHANNELS, Draw, moved
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS
from motions import Timeline, deg, load_motion, motion_names

_Item = TypeVar("_Item")
FACTORS = (0.5, 0.8, 1.1, 1.5, 2.1, 3.0)  # By which a timeline grows, each times 0.9 to 1.1
_EASES = ("minimum_jerk", "minimum_jerk", "cubic", "in", "out")
_GAITS = ("walk", "trot")
_JOINTS = ("hip", "thigh", "calf")
_NAMES = tuple(leg.name for leg in LEGS)
_STREAM, _GROWTH = 4242, 10_000_000


@dataclass(frozen=True, slots=True)
class RandomTimeline:
    """One timeline, at one size."""

    number: int  #: of the timeline
    step: int  #: which of ``FACTORS``
    amplitude: float  #: by which all its sizes are multiplied
    pace: float  #: by which all its times are divided

    @property
    def name(self) -> str:
        """Unique: number and step."""
        return f"sentence {self.number} {self.step}"

    @property
    def line(self) -> Timeline:
        """As it is written.

        Raises:
            TimelineError: if it cannot be written as large as that.
        """
        draw = _Draw(self.number)
        parts = [
            draw.one_of(_BLOCKS)(draw, self.amplitude, self.pace)
            for _ in range(draw.one_of((1, 1, 2, 3)))
        ]
        return parts[0].then(*parts[1:]) if len(parts) > 1 else parts[0]


def random_timelines(count: int) -> list[RandomTimeline]:
    """All sizes of the first ``count`` timelines that can be written."""
    found: list[RandomTimeline] = []
    for one in (size for number in range(count) for size in sizes_of(number)):
        with suppress(TimelineError):
            found += [one] if one.line.keys else []
    return found


def sizes_of(number: int) -> Iterator[RandomTimeline]:
    """A timeline at its sizes, the smallest first."""
    draw = _Draw(number + _GROWTH)
    kind = draw.one_of(("amplitude", "amplitude", "tempo", "both"))
    for step, factor in enumerate(FACTORS):
        size = factor * draw.between(0.9, 1.1)
        amplitude = 0.8 if kind == "tempo" else size
        pace = {"amplitude": 1.0, "tempo": size, "both": size**0.5}[kind]
        yield RandomTimeline(number, step, amplitude, pace)


class _Draw(Draw):
    """Random numbers of one timeline, in the order in which they are asked for."""

    def __init__(self, number: int) -> None:
        self._rng = np.random.default_rng([number, _STREAM])

    def either(self, low: float, high: float) -> float:
        return self.between(low, high) * self.sign()

    def happens(self, chance: float) -> bool:
        return self.between(0.0, 1.0) < chance


def _lean(draw: _Draw, a: float, pace: float, line: Timeline) -> Timeline:
    """The trunk on one to three channels, and now and then a while there."""
    channels = draw.some(CHANNELS, draw.count(1, 3))
    goals = {channel: a * draw.either(0.25, 1.0) * BODY_SIZES[channel] for channel in channels}
    line = moved(line, goals, draw.between(0.35, 1.2) / pace, draw.one_of(_EASES))
    return line.hold(draw.between(0.0, 0.5)) if draw.happens(0.5) else line


def _leans(draw: _Draw, a: float, pace: float) -> Timeline:
    line = Timeline()
    for _ in range(draw.count(1, 4)):
        line = _lean(draw, a, pace, line)
    return line.home(over=draw.between(0.5, 1.0) / pace)


def _to_and_fro(draw: _Draw, a: float, pace: float) -> Timeline:
    channel = draw.one_of(CHANNELS)
    size = a * draw.either(0.3, 0.8) * BODY_SIZES[channel]
    over, line = draw.between(0.3, 0.7) / pace, Timeline()
    for _ in range(draw.count(1, 4)):
        line = moved(line, {channel: size}, over)
        line = moved(line, {channel: -size * draw.between(0.5, 1.0)}, over)
    return line.home(over=draw.between(0.5, 0.9) / pace)


def _raised(draw: _Draw, a: float, pace: float) -> Timeline:
    """A foot raised, and what is done with it or over it."""
    leg, line = draw.one_of(_NAMES), Timeline()
    if draw.happens(0.3):
        line = line.unweight(leg, over=draw.between(0.4, 0.8) / pace)
    z = a * draw.between(0.03, 0.16)
    frame: Literal["ground", "body"] = draw.one_of(("ground", "ground", "body"))
    x, y = a * draw.either(0.0, 0.06), a * draw.either(0.0, 0.05)
    line = line.foot(leg, x=x, y=y, z=z, over=draw.between(0.35, 0.9) / pace, frame=frame)
    for _ in range(draw.count(0, 3)):
        which = draw.count(0, 2)
        if which == 0:
            line = _lean(draw, 0.6 * a, pace, line)
        elif which == 1:
            x, y = a * draw.either(0.0, 0.12), a * draw.either(0.0, 0.1)
            up, over = max(0.02, z + a * draw.either(0.0, 0.08)), draw.between(0.3, 0.9) / pace
            line = line.foot(leg, x=x, y=y, z=up, over=over, frame=frame)
        else:
            line = line.hold(draw.between(0.05, 0.6))
    if draw.happens(0.5):
        line = line.down(leg, over=draw.between(0.3, 0.8) / pace)
    return line.home(over=draw.between(0.5, 1.0) / pace)


def _quick(draw: _Draw, a: float, pace: float) -> Timeline:
    leg, line, z = draw.one_of(_NAMES), Timeline(), a * draw.between(0.02, 0.08)
    up, down = draw.between(0.15, 0.4) / pace, draw.between(0.12, 0.35) / pace
    for _ in range(draw.count(1, 4)):
        line = line.foot(leg, z=z, over=up)
        if draw.happens(0.3):
            line = line.hold(draw.between(0.02, 0.2))
        line = line.down(leg, over=down)
    return line.home(over=draw.between(0.5, 0.9) / pace)


def _in_turn(draw: _Draw, a: float, pace: float) -> Timeline:
    line = Timeline(shift_time=draw.between(0.5, 0.9) / pace)
    over = draw.between(0.3, 0.7) / pace
    for leg in draw.some(_NAMES, draw.count(2, 4)):
        x, z = a * draw.either(0.0, 0.04), a * draw.between(0.03, 0.12)
        line = line.foot(leg, x=x, z=z, over=over).down(leg, over=over * draw.between(0.7, 1.2))
        if draw.happens(0.3):
            line = _lean(draw, 0.4 * a, pace, line)
    return line.home(over=draw.between(0.5, 1.0) / pace)


def _wave(draw: _Draw, a: float, pace: float) -> Timeline:
    """One joint of a raised front leg, to and fro."""
    leg, thigh, calf = draw.one_of(_NAMES[:2]), draw.between(-0.9, 0.4), draw.between(-2.1, -1.1)
    line = Timeline().leg(leg, hip=0.0, thigh=thigh, calf=calf, over=draw.between(0.7, 1.2) / pace)
    over, joint = draw.between(0.2, 0.5) / pace, draw.one_of(_JOINTS)
    rest = {"hip": 0.0, "thigh": thigh, "calf": calf}[joint]
    for _ in range(draw.count(1, 4)):
        size = a * draw.either(0.15, 0.5)
        line = line.joint(leg, joint, rest + size, over=over)
        line = line.joint(leg, joint, rest - 0.5 * size, over=over)
    return line.home(over=draw.between(0.7, 1.2) / pace)


def _steps(draw: _Draw, a: float, pace: float) -> Timeline:
    line = Timeline()
    for leg in draw.some(_NAMES, draw.count(1, 4)):
        if draw.happens(0.7):
            x, y = a * draw.either(0.0, 0.09), a * draw.either(0.0, 0.06)
            line = line.step(leg, x, y, over=draw.between(0.3, 0.7) / pace)
        else:
            yaw = deg(a * draw.either(5.0, 15.0))
            line = line.step(leg, yaw=yaw, over=draw.between(0.3, 0.7) / pace)
        if draw.happens(0.2):
            line = _lean(draw, 0.4 * a, pace, line)
    return line.home(over=draw.between(0.6, 0.9) / pace)


def _going(draw: _Draw, a: float, _: float) -> Timeline:
    """A walk, a turn, a side step or a path, now and then with the trunk swaying on the way."""
    gait, which = draw.one_of(_GAITS), draw.count(0, 3)
    if which == 0:
        x, turn = a * draw.either(0.08, 0.35), deg(a * draw.either(0.0, 30.0))
        line = Timeline().walk(x, turn=turn, gait=gait)
    elif which == 1:
        line = Timeline().turn(deg(a * draw.either(15.0, 70.0)), gait=gait)
    elif which == 2:
        line = Timeline().side_step(a * draw.either(0.04, 0.18), gait=gait)
    else:
        ways = ((0.08, 0.25, 0.1), (0.25, 0.4, 0.15))
        points = [(a * draw.between(x, to), a * draw.either(0.0, y)) for x, to, y in ways]
        line = Timeline().path(points, gait=gait)
    if not draw.happens(0.5):
        return line
    channels = draw.some(CHANNELS[2:], draw.count(1, 2))
    over, leans = line.end / (2 * draw.count(1, 2) + 1), Timeline()
    for move in range(round(line.end / over) - 1):
        sign = (1.0, -0.5)[move % 2]
        goals = {c: sign * a * draw.either(0.1, 0.6) * BODY_SIZES[c] for c in channels}
        leans = moved(leans, goals, over)
    return Timeline().together(line, leans.home(over=over))


def _low(draw: _Draw, a: float, pace: float) -> Timeline:
    """A foot along the ground, or little above it."""
    leg = draw.one_of(_NAMES)
    z = draw.one_of((0.0, draw.between(0.003, 0.01), draw.between(0.01, 0.04)))
    line = Timeline()
    for again in (False, True):
        if not again or draw.happens(0.5):
            x, y = a * draw.either(0.0, 0.06), a * draw.either(0.0, 0.05)
            line = line.foot(leg, x=x, y=y, z=z, over=draw.between(0.3, 0.8) / pace)
    return line.home(over=draw.between(0.5, 0.9) / pace)


def _path(draw: _Draw, a: float, pace: float) -> Timeline:
    channels = draw.some(CHANNELS, draw.count(2, 3))
    points = [
        {c: a * draw.either(0.1, 0.7) * BODY_SIZES[c] for c in channels}
        for _ in range(draw.count(3, 7))
    ]
    points.append(dict.fromkeys(channels, 0.0))
    line = Timeline().body_path(points, over=len(points) * draw.between(0.3, 0.7) / pace)
    return line.home(over=draw.between(0.5, 0.8) / pace)


def _of_the_library(draw: _Draw, a: float, pace: float) -> Timeline:
    while True:
        line = load_motion(draw.one_of(tuple(motion_names())))
        if not line.is_dynamic:
            return line.scale(a).scale_time(1.0 / pace)


_BLOCKS: tuple[Callable[[_Draw, float, float], Timeline], ...] = (
    *(_leans, _leans, _to_and_fro, _to_and_fro, _raised, _raised, _raised, _quick, _in_turn),
    *(_wave, _steps, _going, _going, _low, _path, _of_the_library),
)
"""As often as they are drawn."""
