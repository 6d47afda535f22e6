"""Motions generated from a seed: some that the Go2 can do, some that it cannot.

Every maker draws its numbers from a range. Those of ``GOOD`` stay well inside of what the robot can
do; each of ``BROKEN`` goes wrong in the way that it is named after; those of ``NEAR`` range from
easy to impossible, so that many come out close to a limit. Nothing here knows what the feasibility
check says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.curves import Ease
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import MotionPlan, Posture, Reference
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline, deg


@dataclass(frozen=True, slots=True)
class GeneratedMotion:
    """A motion with its origin.

    Attributes:
        kind: the maker's name.
        line: as it is written.
        start: time [s] at which the plan is entered; above 0 for a wrong entry.
    """

    kind: str
    line: Timeline
    start: float = 0.0

    def plan(self, model: RobotModel) -> MotionPlan:
        """What is checked and played."""
        plan = compile_timeline(self.line, model)
        if self.start == 0.0:
            return plan
        left = plan.duration - self.start
        return LateStart(plan.name, plan.entry, plan.exit, left, plan, self.start)


@dataclass(frozen=True, slots=True)
class LateStart(MotionPlan):
    """A plan without its first ``start`` seconds, as if it began where that leaves the robot."""

    name: str
    entry: Posture
    exit: Posture
    duration: float
    inner: MotionPlan
    start: float

    def at(self, t: float) -> Reference:
        """The reference ``t`` seconds after the late start."""
        return self.inner.at(max(t, 0.0) + self.start)


class _Draw:
    """The random numbers of one motion, in the order in which they are asked for."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng([seed, 7])

    def between(self, low: float, high: float) -> float:
        return float(self._rng.uniform(low, high))

    def either(self, low: float, high: float) -> float:
        return float(self._rng.choice([-1.0, 1.0])) * self.between(low, high)

    def times(self, low: int, high: int) -> range:
        return range(int(self._rng.integers(low, high + 1)))

    def coin(self) -> bool:
        return bool(self._rng.random() < 0.5)

    def axis(self) -> str:
        return "x" if self.coin() else "y"

    def index(self, count: int) -> int:
        return int(self._rng.integers(count))

    def leg(self) -> Leg:
        return LEGS[self.index(4)]

    def front(self) -> Leg:
        return LEGS[self.index(2)]


Maker = Callable[[_Draw], Timeline]


def _by_kind(*makers: Maker) -> dict[str, Maker]:
    return {maker.__name__.strip("_").replace("_", " "): maker for maker in makers}


def _move(
    line: Timeline, channel: str, value: float, over: float, ease: Ease = Ease.MINIMUM_JERK
) -> Timeline:
    return line.body(**{channel: value}, over=over, ease=ease)


def _to_and_fro(
    line: Timeline, times: range, channel: str, ends: tuple[float, float], over: float
) -> Timeline:
    for _ in times:
        line = _move(_move(line, channel, ends[0], over), channel, ends[1], over)
    return line


# --- what the robot can do --------------------------------------------------------------------


def _crouch(draw: _Draw) -> Timeline:
    line, over = Timeline(), draw.between(0.6, 1.2)
    for _ in draw.times(1, 3):
        line = line.body(z=draw.between(-0.11, -0.03), over=over).body(z=0.01, over=over)
    return line.home(over=0.5)


def _sway(draw: _Draw) -> Timeline:
    aside, over, axis = draw.between(0.02, 0.06), draw.between(0.7, 1.2), draw.axis()
    return _to_and_fro(Timeline(), range(1), axis, (aside, -aside), over).home(over=over)


def _tilt(draw: _Draw) -> Timeline:
    line, over = Timeline(), draw.between(0.7, 1.2)
    for _ in draw.times(1, 3):
        channel = ("roll", "pitch", "yaw")[draw.index(3)]
        line = _move(line, channel, draw.either(0.08, 0.22), over)
    return line.home(over=over)


def _bow(draw: _Draw) -> Timeline:
    pitch, z = deg(draw.between(5.0, 15.0)), draw.between(-0.07, -0.02)
    line = Timeline().body(pitch=pitch, z=z, over=draw.between(0.7, 1.1))
    return line.hold(draw.between(0.2, 0.8)).home(over=0.9)


def _raise_a_foot(draw: _Draw) -> Timeline:
    leg, z = draw.leg(), draw.between(0.04, 0.12)
    line = Timeline().foot(leg, z=z, over=draw.between(0.5, 0.9))
    return line.hold(draw.between(0.2, 0.8)).home(over=0.8)


def _reach_out(draw: _Draw) -> Timeline:
    leg, x, z = draw.front(), draw.between(0.02, 0.09), draw.between(0.05, 0.12)
    line = Timeline().foot(leg, z=z, over=0.7)
    return line.foot(leg, x=x, z=z, over=draw.between(0.6, 1.0)).hold(0.3).home(over=0.9)


def _tap(draw: _Draw) -> Timeline:
    leg, line = draw.leg(), Timeline()
    for _ in draw.times(1, 3):
        line = line.foot(leg, z=draw.between(0.03, 0.07), over=draw.between(0.35, 0.6))
        line = line.down(leg, over=draw.between(0.35, 0.6))
    return line.home(over=0.8)


def _wave(draw: _Draw) -> Timeline:
    leg, thigh = draw.front(), draw.between(-0.9, -0.5)
    line = Timeline().leg(leg, hip=0.0, thigh=thigh, calf=-1.3, over=1.2)
    for _ in draw.times(1, 3):
        for hip in (leg.side * draw.between(0.1, 0.35), 0.0):
            line = line.leg(leg, hip=hip, thigh=thigh, calf=-1.3, over=0.4)
    return line.home(over=1.2)


def _sit_down(draw: _Draw) -> Timeline:
    line = Timeline().posture("sit", over=draw.between(1.2, 1.8)).hold(draw.between(0.2, 0.8))
    return line.posture("stand", over=draw.between(1.2, 1.8))


def _raise_and_nod(draw: _Draw) -> Timeline:
    leg, pitch = draw.front(), draw.either(0.03, 0.1)
    line = Timeline().foot(leg, z=draw.between(0.04, 0.10), over=0.7)
    return line.body(pitch=pitch, over=draw.between(0.6, 0.9)).home(over=0.9)


GOOD = _by_kind(
    _crouch, _sway, _tilt, _bow, _raise_a_foot, _reach_out, _tap, _wave, _sit_down, _raise_and_nod
)

# --- what it cannot do ------------------------------------------------------------------------


def _too_high(draw: _Draw) -> Timeline:
    if draw.coin():
        return Timeline().body(z=draw.between(0.17, 0.3), over=1.0).hold(0.3).home(over=1.0)
    line = Timeline().foot(draw.front(), x=0.1, z=draw.between(0.9, 1.3), over=1.5)
    return line.hold(0.3).home(over=1.5)


def _too_far(draw: _Draw) -> Timeline:
    if draw.coin():
        aside = draw.either(0.28, 0.4)
        line = _move(Timeline(), draw.axis(), aside, 1.5)
    else:
        leg = draw.front()
        line = Timeline().foot(leg, z=0.08, over=0.8)
        line = line.foot(leg, x=draw.between(0.45, 0.7), z=0.1, over=1.2)
    return line.hold(0.3).home(over=1.5)


def _too_fast(draw: _Draw) -> Timeline:
    over = draw.between(0.05, 0.09)
    if draw.coin():
        angle = draw.between(0.25, 0.35)
        return _to_and_fro(Timeline(), range(3), "pitch", (angle, -angle), over).home(over=over)
    leg = draw.front()
    line = Timeline().leg(leg, hip=0.0, thigh=0.9, calf=-1.8, over=0.8)
    for thigh in 3 * (-0.9, 0.9):
        line = line.leg(leg, hip=0.0, thigh=thigh, calf=-1.8, over=over)
    return line.home(over=1.0)


def _off_balance(draw: _Draw) -> Timeline:
    leg = draw.leg()
    line = Timeline(balance=False).body(y=leg.side * draw.between(0.03, 0.07), over=0.8)
    return line.foot(leg, z=draw.between(0.08, 0.15), over=0.6).hold(1.0).home(over=0.8)


def _foot_unloaded(draw: _Draw) -> Timeline:
    second = Leg.FR if draw.coin() else Leg.RL
    z, over = draw.between(0.06, 0.12), draw.between(0.5, 0.8)
    line = Timeline(balance=draw.coin()).foot(Leg.FL, z=z, over=over)
    return line.foot(second, z=z, over=over).hold(1.0).home(over=0.8)


def _colliding(draw: _Draw) -> Timeline:
    leg = draw.front()
    y, z = -leg.side * draw.between(0.28, 0.34), draw.between(0.03, 0.06)
    line = Timeline().foot(leg, z=0.10, over=0.8).foot(leg, y=y, z=z, over=0.9)
    return line.hold(0.4).home(over=1.2)


def _slipping(draw: _Draw) -> Timeline:
    aside, over, axis = draw.between(0.06, 0.08), draw.between(0.14, 0.18), draw.axis()
    return _to_and_fro(Timeline(), range(3), axis, (aside, -aside), over).home(over=0.4)


def _discontinuous(draw: _Draw) -> Timeline:
    channel, size = (("z", -0.13), ("y", 0.10), ("pitch", 0.4))[draw.index(3)]
    line = _move(Timeline(), channel, size * draw.between(0.9, 1.2), 0.6, Ease.HOLD)
    return line.hold(0.5).home(over=1.0)


def _torque_hungry(draw: _Draw) -> Timeline:
    depth, over = draw.between(0.11, 0.13), draw.between(0.10, 0.14)
    line = Timeline().body(z=-depth, over=0.9)
    return _to_and_fro(line, draw.times(2, 3), "z", (0.03, -depth), over).home(over=0.9)


def _wrong_entry(draw: _Draw) -> Timeline:
    z, y = -draw.between(0.10, 0.13), draw.either(0.05, 0.08)
    return Timeline().body(z=z, y=y, over=1.0).hold(0.5).home(over=1.0)


BROKEN = _by_kind(
    _too_high,
    _too_far,
    _too_fast,
    _off_balance,
    _foot_unloaded,
    _colliding,
    _slipping,
    _discontinuous,
    _wrong_entry,
    _torque_hungry,
)
# --- from easy to impossible ------------------------------------------------------------------


def _up(draw: _Draw) -> Timeline:
    return Timeline().body(z=draw.between(0.02, 0.16), over=1.0).hold(0.3).home(over=1.0)


def _aside(draw: _Draw) -> Timeline:
    aside = draw.either(0.04, 0.26)
    return _move(Timeline(), draw.axis(), aside, 1.2).hold(0.3).home(over=1.2)


def _faster_sway(draw: _Draw) -> Timeline:
    aside, over = draw.between(0.03, 0.06), draw.between(0.16, 0.5)
    return _to_and_fro(Timeline(), range(3), "y", (aside, -aside), over).home(over=0.5)


def _higher_paw(draw: _Draw) -> Timeline:
    line = Timeline().foot(draw.front(), x=0.05, z=draw.between(0.1, 0.8), over=1.2)
    return line.hold(0.3).home(over=1.2)


def _farther_paw(draw: _Draw) -> Timeline:
    leg = draw.front()
    line = Timeline().foot(leg, z=0.1, over=0.8)
    return line.foot(leg, x=draw.between(0.05, 0.5), z=0.1, over=1.0).home(over=1.2)


def _closer_legs(draw: _Draw) -> Timeline:
    leg = draw.front()
    line = Timeline().foot(leg, z=0.08, over=0.8)
    line = line.foot(leg, y=-leg.side * draw.between(0.12, 0.30), z=0.05, over=0.9)
    return line.hold(0.3).home(over=1.2)


def _leaning(draw: _Draw) -> Timeline:
    leg = draw.leg()
    line = Timeline(balance=False).body(y=-leg.side * draw.between(0.0, 0.08), over=0.8)
    return line.foot(leg, z=0.08, over=0.6).hold(0.8).home(over=0.8)


def _harder_push_up(draw: _Draw) -> Timeline:
    over, line = draw.between(0.12, 0.5), Timeline().body(z=-0.10, over=0.8)
    return _to_and_fro(line, range(2), "z", (0.02, -0.10), over).home(over=0.8)


NEAR = _by_kind(
    _up, _aside, _faster_sway, _higher_paw, _farther_paw, _closer_legs, _leaning, _harder_push_up
)
LATE = 1.0
"""When [s] a motion with a wrong entry is entered: it is where its first move has led."""


def generated_motion(seed: int) -> GeneratedMotion:
    """The motion of a seed: even seeds give good ones, odd ones broken, each kind in turn."""
    return _made((GOOD, BROKEN)[seed % 2], seed // 2, seed)


def near_limit_motion(seed: int) -> GeneratedMotion:
    """The motion of a seed among those from easy to impossible, each kind in turn."""
    return _made(NEAR, seed, seed)


def _made(makers: Mapping[str, Maker], turn: int, seed: int) -> GeneratedMotion:
    kind = list(makers)[turn % len(makers)]
    line = replace(makers[kind](_Draw(seed)), name=f"{kind} {seed}")
    return GeneratedMotion(kind, line, LATE if kind == "wrong entry" else 0.0)
