"""Motions made by the dozen from a seed: some that the Go2 can do, some that it cannot.

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

Maker = Callable[[np.random.Generator], Timeline]


@dataclass(frozen=True, slots=True)
class GeneratedMotion:
    """A motion with its origin.

    Attributes:
        kind: the maker's name.
        is_broken: whether it is meant to be impossible; None if that is left to chance.
        line: as it is written.
        start: time [s] at which the plan is entered; above 0 for a wrong entry.
    """

    kind: str
    is_broken: bool | None
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


def _move(
    line: Timeline, way: Mapping[str, float], over: float, ease: Ease = Ease.MINIMUM_JERK
) -> Timeline:
    return line.body(**way, over=over, ease=ease)


def _leg(rng: np.random.Generator) -> Leg:
    return LEGS[int(rng.integers(4))]


def _front(rng: np.random.Generator) -> Leg:
    return LEGS[int(rng.integers(2))]


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


# --- what the robot can do --------------------------------------------------------------------


def _crouch(rng: np.random.Generator) -> Timeline:
    line, over = Timeline(), float(rng.uniform(0.6, 1.2))
    for _ in range(int(rng.integers(1, 4))):
        line = line.body(z=float(rng.uniform(-0.11, -0.03)), over=over).body(z=0.01, over=over)
    return line.home(over=0.5)


def _sway(rng: np.random.Generator) -> Timeline:
    aside, over = float(rng.uniform(0.02, 0.06)), float(rng.uniform(0.7, 1.2))
    way = {"x": aside} if rng.random() < 0.5 else {"y": aside}
    back = {name: -value for name, value in way.items()}
    return _move(_move(Timeline(), way, over), back, over).home(over=over)


def _tilt(rng: np.random.Generator) -> Timeline:
    line, over = Timeline(), float(rng.uniform(0.7, 1.2))
    for _ in range(int(rng.integers(1, 4))):
        channel = str(rng.choice(["roll", "pitch", "yaw"]))
        line = _move(line, {channel: _sign(rng) * float(rng.uniform(0.08, 0.22))}, over)
    return line.home(over=over)


def _bow(rng: np.random.Generator) -> Timeline:
    pitch, z = deg(float(rng.uniform(5.0, 15.0))), float(rng.uniform(-0.07, -0.02))
    line = Timeline().body(pitch=pitch, z=z, over=float(rng.uniform(0.7, 1.1)))
    return line.hold(float(rng.uniform(0.2, 0.8))).home(over=0.9)


def _raise(rng: np.random.Generator) -> Timeline:
    leg, z = _leg(rng), float(rng.uniform(0.04, 0.12))
    line = Timeline().foot(leg, z=z, over=float(rng.uniform(0.5, 0.9)))
    return line.hold(float(rng.uniform(0.2, 0.8))).home(over=0.8)


def _reach_out(rng: np.random.Generator) -> Timeline:
    leg = _front(rng)
    x, z = float(rng.uniform(0.02, 0.09)), float(rng.uniform(0.05, 0.12))
    line = Timeline().foot(leg, z=z, over=0.7)
    line = line.foot(leg, x=x, z=z, over=float(rng.uniform(0.6, 1.0)))
    return line.hold(0.3).home(over=0.9)


def _tap(rng: np.random.Generator) -> Timeline:
    leg, line = _leg(rng), Timeline()
    for _ in range(int(rng.integers(1, 4))):
        line = line.foot(leg, z=float(rng.uniform(0.03, 0.07)), over=float(rng.uniform(0.35, 0.6)))
        line = line.down(leg, over=float(rng.uniform(0.35, 0.6)))
    return line.home(over=0.8)


def _wave(rng: np.random.Generator) -> Timeline:
    leg, thigh = _front(rng), float(rng.uniform(-0.9, -0.5))
    outward = -1.0 if leg is Leg.FR else 1.0
    line = Timeline().leg(leg, hip=0.0, thigh=thigh, calf=-1.3, over=1.2)
    for _ in range(int(rng.integers(1, 4))):
        aside = outward * float(rng.uniform(0.1, 0.35))
        line = line.leg(leg, hip=aside, thigh=thigh, calf=-1.3, over=0.4)
        line = line.leg(leg, hip=0.0, thigh=thigh, calf=-1.3, over=0.4)
    return line.home(over=1.2)


def _sit_down(rng: np.random.Generator) -> Timeline:
    over = float(rng.uniform(1.2, 1.8))
    line = Timeline().posture("sit", over=over).hold(float(rng.uniform(0.2, 0.8)))
    return line.posture("stand", over=float(rng.uniform(1.2, 1.8)))


def _raise_and_nod(rng: np.random.Generator) -> Timeline:
    leg, pitch = _front(rng), _sign(rng) * float(rng.uniform(0.03, 0.1))
    line = Timeline().foot(leg, z=float(rng.uniform(0.04, 0.10)), over=0.7)
    return line.body(pitch=pitch, over=float(rng.uniform(0.6, 0.9))).home(over=0.9)


GOOD: Mapping[str, Maker] = {
    "crouch": _crouch,
    "sway": _sway,
    "tilt": _tilt,
    "bow": _bow,
    "raise a foot": _raise,
    "reach out": _reach_out,
    "tap": _tap,
    "wave": _wave,
    "sit down": _sit_down,
    "raise and nod": _raise_and_nod,
}

# --- what it cannot do ------------------------------------------------------------------------


def _too_high(rng: np.random.Generator) -> Timeline:
    if rng.random() < 0.5:
        return Timeline().body(z=float(rng.uniform(0.17, 0.3)), over=1.0).hold(0.3).home(over=1.0)
    line = Timeline().foot(_front(rng), x=0.1, z=float(rng.uniform(0.9, 1.3)), over=1.5)
    return line.hold(0.3).home(over=1.5)


def _too_far(rng: np.random.Generator) -> Timeline:
    if rng.random() < 0.5:
        aside = _sign(rng) * float(rng.uniform(0.28, 0.4))
        way = {"x": aside} if rng.random() < 0.5 else {"y": aside}
        return _move(Timeline(), way, 1.5).hold(0.3).home(over=1.5)
    leg = _front(rng)
    line = Timeline().foot(leg, z=0.08, over=0.8)
    return line.foot(leg, x=float(rng.uniform(0.45, 0.7)), z=0.1, over=1.2).hold(0.3).home(over=1.5)


def _too_fast(rng: np.random.Generator) -> Timeline:
    over, line = float(rng.uniform(0.05, 0.09)), Timeline()
    if rng.random() < 0.5:
        angle = float(rng.uniform(0.25, 0.35))
        for _ in range(3):
            line = line.body(pitch=angle, over=over).body(pitch=-angle, over=over)
        return line.home(over=over)
    leg = _front(rng)
    line = line.leg(leg, hip=0.0, thigh=0.9, calf=-1.8, over=0.8)
    for _ in range(3):
        line = line.leg(leg, hip=0.0, thigh=-0.9, calf=-1.8, over=over)
        line = line.leg(leg, hip=0.0, thigh=0.9, calf=-1.8, over=over)
    return line.home(over=1.0)


def _off_balance(rng: np.random.Generator) -> Timeline:
    leg = _leg(rng)
    outward = 1.0 if leg in (Leg.FL, Leg.RL) else -1.0
    line = Timeline(balance=False).body(y=outward * float(rng.uniform(0.03, 0.07)), over=0.8)
    return line.foot(leg, z=float(rng.uniform(0.08, 0.15)), over=0.6).hold(1.0).home(over=0.8)


def _feet_unloaded(rng: np.random.Generator) -> Timeline:
    first, second = (Leg.FL, Leg.FR) if rng.random() < 0.5 else (Leg.FL, Leg.RL)
    z, over = float(rng.uniform(0.06, 0.12)), float(rng.uniform(0.5, 0.8))
    line = Timeline(balance=bool(rng.random() < 0.5)).foot(first, z=z, over=over)
    return line.foot(second, z=z, over=over).hold(1.0).home(over=0.8)


def _colliding(rng: np.random.Generator) -> Timeline:
    leg = _front(rng)
    inward = -1.0 if leg is Leg.FL else 1.0
    y, z = inward * float(rng.uniform(0.28, 0.34)), float(rng.uniform(0.03, 0.06))
    line = Timeline().foot(leg, z=0.10, over=0.8).foot(leg, y=y, z=z, over=0.9)
    return line.hold(0.4).home(over=1.2)


def _slipping(rng: np.random.Generator) -> Timeline:
    aside, over = float(rng.uniform(0.06, 0.08)), float(rng.uniform(0.14, 0.18))
    name = "x" if rng.random() < 0.5 else "y"
    line = Timeline()
    for _ in range(3):
        line = _move(_move(line, {name: aside}, over), {name: -aside}, over)
    return line.home(over=0.4)


def _discontinuous(rng: np.random.Generator) -> Timeline:
    name, size = (("z", -0.13), ("y", 0.10), ("pitch", 0.4))[int(rng.integers(3))]
    jump = size * float(rng.uniform(0.9, 1.2))
    return _move(Timeline(), {name: jump}, 0.6, Ease.HOLD).hold(0.5).home(over=1.0)


def _torque_hungry(rng: np.random.Generator) -> Timeline:
    depth, over = float(rng.uniform(0.11, 0.13)), float(rng.uniform(0.10, 0.14))
    line = Timeline().body(z=-depth, over=0.9)
    for _ in range(int(rng.integers(2, 4))):
        line = line.body(z=0.03, over=over).body(z=-depth, over=over)
    return line.home(over=0.9)


def _wrong_entry(rng: np.random.Generator) -> Timeline:
    z, y = -float(rng.uniform(0.10, 0.13)), _sign(rng) * float(rng.uniform(0.05, 0.08))
    return Timeline().body(z=z, y=y, over=1.0).hold(0.5).home(over=1.0)


BROKEN: Mapping[str, Maker] = {
    "too high": _too_high,
    "too far": _too_far,
    "too fast": _too_fast,
    "off balance": _off_balance,
    "foot unloaded": _feet_unloaded,
    "colliding": _colliding,
    "slipping": _slipping,
    "discontinuous": _discontinuous,
    "wrong entry": _wrong_entry,
    "torque-hungry": _torque_hungry,
}
# --- from easy to impossible ------------------------------------------------------------------


def _up(rng: np.random.Generator) -> Timeline:
    return Timeline().body(z=float(rng.uniform(0.02, 0.16)), over=1.0).hold(0.3).home(over=1.0)


def _aside(rng: np.random.Generator) -> Timeline:
    aside = _sign(rng) * float(rng.uniform(0.04, 0.26))
    way = {"x": aside} if rng.random() < 0.5 else {"y": aside}
    return _move(Timeline(), way, 1.2).hold(0.3).home(over=1.2)


def _faster_sway(rng: np.random.Generator) -> Timeline:
    aside, over, line = float(rng.uniform(0.03, 0.06)), float(rng.uniform(0.16, 0.5)), Timeline()
    for _ in range(3):
        line = line.body(y=aside, over=over).body(y=-aside, over=over)
    return line.home(over=0.5)


def _higher_paw(rng: np.random.Generator) -> Timeline:
    line = Timeline().foot(_front(rng), x=0.05, z=float(rng.uniform(0.1, 0.8)), over=1.2)
    return line.hold(0.3).home(over=1.2)


def _farther_paw(rng: np.random.Generator) -> Timeline:
    leg = _front(rng)
    line = Timeline().foot(leg, z=0.1, over=0.8)
    return line.foot(leg, x=float(rng.uniform(0.05, 0.5)), z=0.1, over=1.0).home(over=1.2)


def _closer_legs(rng: np.random.Generator) -> Timeline:
    leg = _front(rng)
    inward = (-1.0 if leg is Leg.FL else 1.0) * float(rng.uniform(0.12, 0.30))
    line = Timeline().foot(leg, z=0.08, over=0.8).foot(leg, y=inward, z=0.05, over=0.9)
    return line.hold(0.3).home(over=1.2)


def _leaning(rng: np.random.Generator) -> Timeline:
    leg = _leg(rng)
    inward = -1.0 if leg in (Leg.FL, Leg.RL) else 1.0
    line = Timeline(balance=False).body(y=inward * float(rng.uniform(0.0, 0.08)), over=0.8)
    return line.foot(leg, z=0.08, over=0.6).hold(0.8).home(over=0.8)


def _harder_push(rng: np.random.Generator) -> Timeline:
    over, line = float(rng.uniform(0.12, 0.5)), Timeline().body(z=-0.10, over=0.8)
    for _ in range(2):
        line = line.body(z=0.02, over=over).body(z=-0.10, over=over)
    return line.home(over=0.8)


NEAR: Mapping[str, Maker] = {
    "up": _up,
    "aside": _aside,
    "faster sway": _faster_sway,
    "higher paw": _higher_paw,
    "farther paw": _farther_paw,
    "closer legs": _closer_legs,
    "leaning": _leaning,
    "harder push-up": _harder_push,
}
LATE = 1.0
"""When [s] a motion with a wrong entry is entered: it is where its first move has led."""


def generated_motion(seed: int) -> GeneratedMotion:
    """The motion of a seed: even seeds give good ones, odd ones broken, each kind in turn."""
    is_broken = bool(seed % 2)
    return _made(BROKEN if is_broken else GOOD, seed // 2, seed, is_broken=is_broken)


def near_specimen(seed: int) -> GeneratedMotion:
    """The motion of a seed among those from easy to impossible, each kind in turn."""
    return _made(NEAR, seed, seed, is_broken=None)


def _made(
    makers: Mapping[str, Maker], turn: int, seed: int, *, is_broken: bool | None
) -> GeneratedMotion:
    kind = list(makers)[turn % len(makers)]
    line = replace(makers[kind](np.random.default_rng([seed, 7])), name=f"{kind} {seed}")
    return GeneratedMotion(kind, is_broken, line, LATE if kind == "wrong entry" else 0.0)
