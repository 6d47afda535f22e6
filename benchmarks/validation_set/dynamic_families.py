"""Families of solved motions: jumps, hops, rears, pounces, pairs, phases, nearest motions."""

from collections.abc import Sequence

from benchmarks.validation_set.drawing import Draw, Family, Write, named
from go2_wbc.legs import LEGS, Leg
from motions import Timeline, deg

_Places = dict[Leg | str, Sequence[float]]
PAIRS = (("FL", "RR"), ("FR", "RL"))


def _jump_up(draw: Draw, s: float) -> Timeline:
    return Timeline().hold(draw.between(0.1, 0.3)).jump(height=0.16 * s).hold(0.3)


def _jump_ahead(draw: Draw, s: float) -> Timeline:
    return Timeline().jump(x=0.4 * s, height=draw.between(0.06, 0.12)).hold(0.3)


def _jump_back(draw: Draw, s: float) -> Timeline:
    return Timeline().jump(x=-0.3 * s, height=draw.between(0.06, 0.12)).hold(0.3)


def _jump_aside(draw: Draw, s: float) -> Timeline:
    return Timeline().jump(y=draw.sign() * 0.25 * s, height=draw.between(0.06, 0.12)).hold(0.3)


def _spin(draw: Draw, s: float) -> Timeline:
    return Timeline().spin_jump(deg(80.0 * draw.sign() * s), height=draw.between(0.08, 0.14))


def _jump_anywhere(draw: Draw, s: float) -> Timeline:
    x, y, yaw = draw.either(0.1, 0.25), draw.either(0.05, 0.15), draw.either(10.0, 50.0)
    return Timeline().jump(s * x, s * y, deg(s * yaw), height=draw.between(0.06, 0.10)).hold(0.2)


def _higher_hops(draw: Draw, s: float) -> Timeline:
    return Timeline().hop(draw.count(1, 3), height=0.07 * s, period=draw.between(0.6, 0.7))


def _faster_hops(draw: Draw, s: float) -> Timeline:
    height = draw.between(0.05, 0.07)
    return Timeline().hop(draw.count(2, 3), height=height, period=0.45 + 0.1 / s)


def _hops_to_beats(draw: Draw, s: float) -> Timeline:
    line = Timeline().bpm(draw.between(100.0, 125.0))
    return line.hop(draw.count(1, 2), height=0.05 * s, period=1)


def _rear_steeper(draw: Draw, s: float) -> Timeline:
    return Timeline().rear(-deg(25.0 * s), hold=draw.between(0.4, 0.7))


def _rear_longer(draw: Draw, s: float) -> Timeline:
    return Timeline().rear(-deg(draw.between(15.0, 30.0)), hold=0.5 * s)


def _lift_longer(draw: Draw, s: float) -> Timeline:
    return Timeline().lift(draw.one_of(PAIRS), hold=0.35 * s, height=draw.between(0.03, 0.06))


def _lift_higher(draw: Draw, s: float) -> Timeline:
    return Timeline().lift(draw.one_of(PAIRS), hold=draw.between(0.25, 0.4), height=0.07 * s)


def _pounce_farther(draw: Draw, s: float) -> Timeline:
    crouch = draw.between(0.4, 0.8)
    return Timeline().pounce(0.35 * s, height=draw.between(0.06, 0.10), crouch=crouch).hold(0.2)


def _phased_dip(draw: Draw, s: float) -> Timeline:
    low, over = s * draw.between(0.04, 0.07), draw.between(0.16, 0.24)
    tilt = {"z": -low, "pitch": s * draw.either(0.05, 0.15), "y": s * draw.either(0.0, 0.03)}
    line = Timeline().phase(over, body=tilt, label="dip")
    return line.phase(over, label="rise").phase(0.3, body={"z": 0.0}, label="stand")


def _phased_leap(draw: Draw, s: float) -> Timeline:
    x, z = draw.either(0.05, 0.2), draw.between(0.03, 0.06)
    air: _Places = {leg.name: (0.5 * s * x, 0.0, s * z) for leg in LEGS}
    down: _Places = {leg.name: (s * x, 0.0, 0.0) for leg in LEGS}
    line = Timeline().phase(0.3, body={"z": -draw.between(0.04, 0.07)}).phase(0.2)
    line = line.phase(0.1, stance=(), feet=air).phase(0.1, stance=(), feet=down)
    return line.phase(0.2).phase(0.3, body={"x": s * x})


def _phased_paw(draw: Draw, s: float) -> Timeline:
    leg, over = draw.leg(), draw.between(0.2, 0.4)
    others = [other.name for other in LEGS if other is not leg]
    up: _Places = {leg.name: (0.0, 0.0, 0.10 * s)}
    down: _Places = {leg.name: (0.0, 0.0, 0.0)}
    line = Timeline().phase(0.4).phase(over, stance=others, feet=up)
    return line.phase(over, stance=others, feet=down).phase(0.2).phase(0.3, body={"x": 0.0})


def _jump_then_paw(draw: Draw, s: float) -> Timeline:
    line = Timeline().jump(x=draw.between(0.1, 0.25), height=0.06).hold(0.2)
    return line.foot(draw.leg(), z=0.15 * s, over=0.7).hold(0.2).home(over=0.8)


def _bow_then_jump(draw: Draw, s: float) -> Timeline:
    line = Timeline().body(pitch=draw.between(0.1, 0.25), over=0.7).home(over=0.7)
    return line.jump(x=0.35 * s, height=0.08).hold(0.2)


def _two_jumps(draw: Draw, s: float) -> Timeline:
    x, yaw = draw.between(0.15, 0.25), draw.either(20.0, 50.0)
    line = Timeline().jump(x=s * x, height=0.06).hold(0.2)
    return line.jump(yaw=deg(s * yaw), height=0.06).hold(0.2)


def _jump_then_trot(draw: Draw, s: float) -> Timeline:
    line = Timeline().jump(yaw=deg(60.0 * s * draw.sign()), height=0.08).hold(0.2)
    return line.walk(draw.between(0.1, 0.2), gait="trot")


def _lift_then_sway(draw: Draw, s: float) -> Timeline:
    line = Timeline().lift(draw.one_of(PAIRS), hold=0.3).hold(0.1)
    y, over = s * draw.either(0.03, 0.06), draw.between(0.4, 0.6)
    return line.body(y=y, over=over).body(y=-y, over=over).home(over=over)


def _nearest_sway(draw: Draw, s: float) -> Timeline:
    y, over, line = draw.between(0.06, 0.09), 0.2 / s, Timeline(physics="nearest")
    for _ in range(draw.count(1, 2)):
        line = line.body(y=y, over=over).body(y=-y, over=over)
    return line.home(over=0.4)


def _nearest_pair(draw: Draw, s: float) -> Timeline:
    first, second = draw.one_of(PAIRS)
    over, line = 0.25 * s, Timeline(physics="nearest", balance=False)
    line = line.foot(first, z=0.04, over=over).also().foot(second, z=0.04, over=over)
    return line.down(first, over=over).also().down(second, over=over).home(over=0.5)


_BOUNDS: dict[Write, tuple[float, float]] = {
    _jump_up: (0.3, 2.4),
    _jump_ahead: (0.2, 2.4),
    _jump_back: (0.2, 3.2),
    _jump_aside: (0.2, 2.3),
    _spin: (0.2, 2.2),
    _jump_anywhere: (0.3, 3.5),
    _higher_hops: (0.4, 3.0),
    _faster_hops: (0.3, 2.4),
    _hops_to_beats: (0.5, 2.0),
    _rear_steeper: (0.3, 2.3),
    _rear_longer: (0.45, 1.9),
    _lift_longer: (0.4, 2.7),
    _lift_higher: (0.35, 2.1),
    _pounce_farther: (0.2, 2.7),
    _phased_dip: (0.3, 4.0),
    _phased_leap: (0.3, 4.0),
    _phased_paw: (0.3, 4.0),
    _jump_then_paw: (0.3, 4.0),
    _bow_then_jump: (0.2, 2.7),
    _two_jumps: (0.3, 3.5),
    _jump_then_trot: (0.2, 2.8),
    _lift_then_sway: (0.3, 4.0),
    _nearest_sway: (0.3, 4.0),
    _nearest_pair: (0.4, 4.0),
}
DYNAMIC = tuple(
    Family(name, write, *_BOUNDS[write], is_dynamic=True) for name, write in named(*_BOUNDS).items()
)
