"""Families that go somewhere: steps, walks, turns and trots, with other tracks beside them."""

from __future__ import annotations

from benchmarks.exam.drawing import BODY_SIZES, Draw, Family, moved, writer_name
from go2_wbc.legs import LEGS
from motions import Timeline, deg


def _long_step(draw: Draw, s: float) -> Timeline:
    axis, size = draw.one_of((("x", 0.12), ("y", 0.08)))
    leg, way = draw.leg(), s * draw.sign() * size
    x, y = (way, 0.0) if axis == "x" else (0.0, way)
    line = Timeline().step(leg, x, y, over=draw.between(0.4, 0.8))
    return line.home(over=0.8)


def _hasty_step(draw: Draw, s: float) -> Timeline:
    x, y, over = draw.either(0.02, 0.07), draw.either(0.01, 0.05), draw.between(0.15, 0.25) / s
    return Timeline().step(draw.leg(), x, y, over=over).home(over=0.8)


def _four_steps(draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for leg in draw.some(LEGS, 4):
        x, y = s * draw.either(0.02, 0.08), s * draw.either(0.01, 0.06)
        line = line.step(leg, x, y, over=draw.between(0.4, 0.8))
    return line.home(over=0.8)


def _high_steps(draw: Draw, s: float) -> Timeline:
    line, over = Timeline(), draw.between(0.4, 0.7)
    for leg in draw.some(LEGS, 2):
        line = line.step(leg, draw.either(0.02, 0.05), over=over, height=0.12 * s)
    return line.home(over=0.8)


def _step_round(draw: Draw, s: float) -> Timeline:
    line, yaw = Timeline(), draw.either(10.0, 20.0)
    for leg in draw.some(LEGS, 4):
        line = line.step(leg, yaw=deg(s * yaw), over=draw.between(0.4, 0.6))
    return line.home(over=0.8)


def _leaning(going: Timeline, draw: Draw, s: float) -> Timeline:
    channel, count = draw.one_of(("roll", "pitch", "yaw", "z")), draw.count(1, 2)
    size = s * draw.either(0.3, 0.6) * BODY_SIZES[channel]
    over, lean = going.end / (2 * count + 1), Timeline()
    for _ in range(count):
        lean = moved(moved(lean, {channel: size}, over), {channel: -0.5 * size}, over)
    return Timeline().together(going, lean.home(over=over))


def _leaning_walk(draw: Draw, s: float) -> Timeline:
    walk = Timeline().walk(draw.either(0.1, 0.3), turn=deg(draw.either(0.0, 20.0)))
    return _leaning(walk, draw, s)


def _leaning_trot(draw: Draw, s: float) -> Timeline:
    walk = Timeline().walk(draw.either(0.1, 0.4), turn=deg(draw.either(0.0, 30.0)), gait="trot")
    return _leaning(walk, draw, s)


def _nodding_side_step(draw: Draw, s: float) -> Timeline:
    walk = Timeline().side_step(draw.either(0.06, 0.15), gait=draw.one_of(("walk", "trot")))
    return _leaning(walk, draw, s)


def _low_path(draw: Draw, s: float) -> Timeline:
    x, y, gait = draw.between(0.15, 0.3), draw.either(0.05, 0.15), draw.one_of(("walk", "trot"))
    line = Timeline().body(z=-s * draw.between(0.04, 0.08), over=0.8)
    return line.path([(x, 0.5 * y), (2.0 * x, y)], gait=gait).home(over=0.8)


def _high_walk(draw: Draw, s: float) -> Timeline:
    line = Timeline().body(z=s * draw.between(0.03, 0.05), over=0.8)
    return line.walk(draw.either(0.1, 0.2), gait=draw.one_of(("walk", "trot"))).home(over=0.8)


def _walk_then_paw(draw: Draw, s: float) -> Timeline:
    line = Timeline().walk(draw.either(0.1, 0.3), turn=deg(draw.either(5.0, 30.0)))
    line = line.foot(draw.leg(), x=s * draw.either(0.0, 0.06), z=0.12 * s, over=0.8)
    return line.hold(0.2).home(over=0.8)


def _trot_then_bow(draw: Draw, s: float) -> Timeline:
    line = Timeline().turn(deg(draw.either(15.0, 60.0)), gait="trot")
    line = line.body(pitch=s * draw.either(0.2, 0.3), z=-s * draw.between(0.02, 0.05), over=0.8)
    return line.hold(0.2).home(over=0.8)


def _paw_then_walk(draw: Draw, s: float) -> Timeline:
    paw = Timeline().foot(draw.front(), z=0.10, over=0.6 / s).home(over=0.6 / s)
    walk = Timeline().walk(draw.either(0.1, 0.2), gait=draw.one_of(("walk", "trot")))
    return paw.then(walk)


_WRITERS = (
    _long_step, _hasty_step, _four_steps, _high_steps, _step_round, _leaning_walk, _leaning_trot,
    _nodding_side_step, _low_path, _high_walk, _walk_then_paw, _trot_then_bow, _paw_then_walk,
)  # fmt: skip
GOING = tuple(Family(writer_name(write), write) for write in _WRITERS)
