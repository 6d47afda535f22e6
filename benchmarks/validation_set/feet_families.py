"""Families in which feet leave the ground: paws, taps, lifts in turn; and that go somewhere."""

from benchmarks.validation_set.drawing import (
    BODY_SIZES,
    Draw,
    Family,
    Write,
    moved,
    named,
    tapped,
    to_and_fro,
)
from go2_wbc.legs import LEGS
from motions import Timeline, deg, load_motion

LIBRARY = (
    "bow", "curtsy", "dance", "figure_eight", "hula", "knock", "look_around", "nod", "nose_circle",
    "push_ups", "shake_head", "shake_paw", "sneeze", "sniff", "stamp", "stretch", "sway",
    "tap_dance", "tilt_head", "twist", "wave", "wiggle", "wiggle_hips", "lift_leg", "salute",
)  # fmt: skip


def _paw_up(draw: Draw, s: float) -> Timeline:
    line = Timeline().foot(draw.leg(), z=0.15 * s, over=draw.between(0.6, 1.2))
    return line.hold(draw.between(0.2, 0.6)).home(over=0.9)


def _reach_ahead(draw: Draw, s: float) -> Timeline:
    leg, z = draw.front(), draw.between(0.05, 0.15)
    line = Timeline().foot(leg, z=z, over=0.7)
    return line.foot(leg, x=0.15 * s, z=z, over=draw.between(0.7, 1.1)).hold(0.3).home(over=0.9)


def _reach_aside(draw: Draw, s: float) -> Timeline:
    leg, z, y = draw.leg(), draw.between(0.05, 0.12), draw.sign() * 0.12
    line = Timeline().foot(leg, z=z, over=0.7)
    return line.foot(leg, y=s * y, z=z, over=draw.between(0.7, 1.1)).hold(0.3).home(over=0.9)


def _taps(draw: Draw, s: float) -> Timeline:
    leg, z = draw.leg(), draw.between(0.03, 0.07)
    up, down = draw.between(0.16, 0.24) / s, draw.between(0.12, 0.2) / s
    return tapped(Timeline(), leg, z, up, down, draw.count(1, 4)).home(over=0.8)


def _stamps(draw: Draw, s: float) -> Timeline:
    leg, z = draw.leg(), draw.between(0.05, 0.09)
    up, down = draw.between(0.3, 0.5), draw.between(0.12, 0.25) / s
    return tapped(Timeline(), leg, z, up, down, draw.count(1, 3)).home(over=0.8)


def _high_stamps(draw: Draw, s: float) -> Timeline:
    leg, over = draw.leg(), draw.between(0.25, 0.4)
    return tapped(Timeline(), leg, 0.1 * s, over, over, draw.count(1, 3)).home(over=0.8)


def _lifts_in_turn(draw: Draw, s: float) -> Timeline:
    line, z = Timeline(shift_time=draw.between(0.6, 0.9) / s), draw.between(0.04, 0.10)
    over = draw.between(0.4, 0.6) / s
    for leg in draw.some(LEGS, draw.count(2, 4)):
        line = line.foot(leg, z=z, over=over).down(leg, over=over)
    return line.home(over=0.8)


def _higher_lifts_in_turn(draw: Draw, s: float) -> Timeline:
    line, over = Timeline(), draw.between(0.4, 0.8)
    for leg in draw.some(LEGS, draw.count(2, 3)):
        line = line.foot(leg, z=0.15 * s, over=over).hold(0.1).down(leg, over=over)
    return line.home(over=0.8)


def _nod_on_three(draw: Draw, s: float) -> Timeline:
    leg, channel = draw.leg(), draw.one_of(("pitch", "roll", "yaw", "z"))
    size, over = s * draw.either(0.3, 0.6) * BODY_SIZES[channel], draw.between(0.5, 0.9)
    line = Timeline().foot(leg, z=draw.between(0.04, 0.10), over=0.7)
    line = to_and_fro(line, channel, size, over)
    return line.home(over=0.9)


def _shift_on_three(draw: Draw, s: float) -> Timeline:
    leg, channel = draw.leg(), draw.one_of(("x", "y"))
    size, over = s * draw.either(0.03, 0.06), draw.between(0.5, 0.9)
    line = Timeline().foot(leg, z=draw.between(0.04, 0.10), over=0.7)
    return moved(line, {channel: size}, over).hold(0.3).home(over=0.9)


def _wave_a_leg(draw: Draw, s: float) -> Timeline:
    leg, thigh, calf = draw.front(), draw.between(-0.8, 0.2), draw.between(-1.8, -1.2)
    line = Timeline().leg(leg, hip=0.0, thigh=thigh, calf=calf, over=1.1)
    hip, over = draw.between(0.3, 0.5), draw.between(0.3, 0.5)
    for _ in range(draw.count(1, 3)):
        for angle in (leg.side * s * hip, 0.0):
            line = line.leg(leg, hip=angle, thigh=thigh, calf=calf, over=over)
    return line.home(over=1.1)


def _faster_wave(draw: Draw, s: float) -> Timeline:
    leg, thigh, line = draw.front(), draw.between(-0.7, 0.0), Timeline()
    line = line.leg(leg, hip=0.0, thigh=thigh, calf=-1.4, over=1.1)
    over = draw.between(0.2, 0.3) / s
    for _ in range(draw.count(2, 4)):
        line = line.joint(leg, "calf", -2.0, over=over).joint(leg, "calf", -1.2, over=over)
    return line.home(over=1.1)


def _one_joint(draw: Draw, s: float) -> Timeline:
    leg, which = draw.front(), draw.one_of(("hip", "thigh", "calf"))
    rest = {"hip": 0.0, "thigh": 0.3, "calf": -1.7}
    size = {"hip": leg.side * 0.6, "thigh": -1.0, "calf": 0.6}[which]
    line = Timeline().leg(leg, hip=0.0, thigh=0.3, calf=-1.7, over=0.8)
    line = line.joint(leg, which, rest[which] + s * size, over=draw.between(0.6, 1.0))
    return line.hold(0.2).home(over=1.0)


def _high_five(draw: Draw, s: float) -> Timeline:
    leg, pitch = draw.front(), draw.between(0.1, 0.35)
    x, z = draw.between(0.10, 0.25), draw.between(0.3, 0.5)
    line = Timeline().foot(leg, z=0.08, over=0.8).body(pitch=-s * pitch, over=0.9).also()
    line = line.foot(leg, x=s * x, z=s * z, over=1.2).hold(draw.between(0.2, 0.8))
    return line.home(over=1.4)


def _slide(draw: Draw, s: float) -> Timeline:
    leg, axis = draw.leg(), draw.one_of(("x", "y"))
    size, z = s * draw.either(0.02, 0.05), draw.between(0.004, 0.012)
    x, y = (size, 0.0) if axis == "x" else (0.0, size)
    line = Timeline().foot(leg, x=x, y=y, z=z, over=draw.between(0.4, 0.8))
    return line.down(leg, over=0.5).home(over=0.8)


def _low_pass(draw: Draw, s: float) -> Timeline:
    leg, axis, z = draw.leg(), draw.one_of(("x", "y")), draw.between(0.02, 0.04)
    size, over = s * draw.either(0.04, 0.08), draw.between(0.4, 0.8)
    x, y = (size, 0.0) if axis == "x" else (0.0, size)
    line = Timeline().foot(leg, z=z, over=0.4).foot(leg, x=x, y=y, z=z, over=over)
    line = line.foot(leg, x=-x, y=-y, z=z, over=over)
    return line.down(leg, over=0.5).home(over=0.8)


def _kick_back(draw: Draw, s: float) -> Timeline:
    leg = draw.one_of(LEGS[2:])
    x, z, over = draw.between(0.15, 0.25), draw.between(0.08, 0.12), draw.between(0.4, 0.7)
    line = Timeline().foot(leg, z=z, over=0.6).foot(leg, x=-s * x, z=(0.5 + 0.5 * s) * z, over=over)
    return line.hold(0.2).home(over=0.9)


def _paw_with_trunk(draw: Draw, s: float) -> Timeline:
    leg, channel = draw.front(), draw.one_of(("pitch", "yaw", "roll"))
    line = Timeline().foot(leg, x=0.03, z=draw.between(0.08, 0.14), over=0.8, frame="body")
    size, over = s * draw.either(0.3, 0.6) * BODY_SIZES[channel], draw.between(0.6, 1.0)
    return moved(line, {channel: size}, over).hold(0.2).home(over=1.0)


def _lean_and_lift(draw: Draw, s: float) -> Timeline:
    leg, y = draw.leg(), draw.between(0.02, 0.05)
    line = Timeline(balance=False).body(y=-leg.side * (0.08 - s * y), over=0.8)
    return line.foot(leg, z=draw.between(0.04, 0.08), over=0.5).hold(0.5).home(over=0.8)


def _unweight_sooner(draw: Draw, s: float) -> Timeline:
    leg, z, over = draw.leg(), draw.between(0.04, 0.10), draw.between(0.4, 0.6)
    line = Timeline().unweight(leg, over=draw.between(0.4, 0.6) / s)
    return line.foot(leg, z=z, over=over).hold(0.2).down(leg, over=over).home(over=0.8)


def _paw_circle(draw: Draw, s: float) -> Timeline:
    leg, size, over = draw.front(), draw.between(0.05, 0.08), draw.between(0.12, 0.2) / s
    line = Timeline().foot(leg, z=0.12, over=0.8)
    corners = ((size, 0.12), (size, 0.12 + size), (0.0, 0.12 + size), (0.0, 0.12))
    for _ in range(draw.count(1, 3)):
        for x, z in corners:
            line = line.foot(leg, x=x, z=z, over=over)
    return line.home(over=0.9)


def _two_feet_at_once(draw: Draw, s: float) -> Timeline:
    first, second = draw.one_of((("FL", "RR"), ("FR", "RL"), ("FL", "RL"), ("FR", "RR")))
    z, over = 0.03, 0.12 * s
    line = Timeline(balance=False).foot(first, z=z, over=over).also().foot(second, z=z, over=over)
    return line.down(first, over=over).also().down(second, over=over).home(over=0.8)


def _paws_to_beats(draw: Draw, s: float) -> Timeline:
    tempo, z = draw.between(70.0, 110.0), draw.between(0.04, 0.08)
    line = Timeline().bpm(s * tempo, shift_time=1)
    for leg in draw.some(LEGS[:2], 2):
        line = line.foot(leg, z=z, over=1).down(leg, over=1)
    return line.home(over=2)


def _bow_sway_paw(draw: Draw, s: float) -> Timeline:
    bow = Timeline().body(pitch=0.25, z=-0.05, over=0.8).home(over=0.8)
    sway = Timeline().body(y=0.05, over=0.6).body(y=-0.05, over=0.6).home(over=0.6)
    paw = Timeline().foot(draw.leg(), z=0.10, over=0.7).home(over=0.7)
    first, *others = draw.some((bow, sway, paw), 3)
    return first.then(*others).scale(s)


def _random_paws(draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for _ in range(draw.count(1, 3)):
        leg, size = draw.leg(), s * draw.between(0.05, 0.10)
        line = line.body(z=-s * draw.between(0.0, 0.04), over=0.5)
        line = line.foot(leg, x=s * draw.either(0.0, 0.05), z=size, over=draw.between(0.5, 0.9))
        line = line.hold(draw.between(0.0, 0.3)).home(over=draw.between(0.5, 0.9))
    return line


_WRITERS = (
    _paw_up, _reach_ahead, _reach_aside, _taps, _stamps, _high_stamps, _lifts_in_turn,
    _higher_lifts_in_turn, _nod_on_three, _shift_on_three, _wave_a_leg, _faster_wave, _one_joint,
    _high_five, _slide, _low_pass, _kick_back, _paw_with_trunk, _lean_and_lift, _unweight_sooner,
    _paw_circle, _two_feet_at_once,  _paws_to_beats, _bow_sway_paw, _random_paws,
)  # fmt: skip
_FASTER: dict[str, Write] = {
    "random_paws_faster": lambda draw, s: _random_paws(draw, 0.8).scale_time(1.0 / s),
    "library_faster": lambda draw, s: load_motion(draw.one_of(LIBRARY)).scale_time(1.0 / s),
    "library_larger": lambda draw, s: load_motion(draw.one_of(LIBRARY)).scale(s),
}
_TURNING = {"wave_a_leg": 2.5, "one_joint": 2.0, "high_five": 2.5}
"""Amplitudes beyond which an angle or a height would be taken for a mistake in units."""
FEET = tuple(
    Family(name, write, high=_TURNING.get(name, 4.0))
    for name, write in {**named(*_WRITERS), **_FASTER}.items()
)


def _long_step(draw: Draw, s: float) -> Timeline:
    axis, size = draw.one_of((("x", 0.12), ("y", 0.08)))
    leg, way = draw.leg(), {axis: s * draw.sign() * size}
    return Timeline().step(leg, **way, over=draw.between(0.4, 0.8)).home(over=0.8)


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


def _leaning_walk(
    draw: Draw, s: float, far: float = 0.3, turn: float = 20.0, gait: str = "walk"
) -> Timeline:
    walk = Timeline().walk(draw.either(0.1, far), turn=deg(draw.either(0.0, turn)), gait=gait)
    return _leaning(walk, draw, s)


def _leaning_trot(draw: Draw, s: float) -> Timeline:
    return _leaning_walk(draw, s, 0.4, 30.0, "trot")


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


_GOING = (
    _long_step, _hasty_step, _four_steps, _high_steps, _step_round, _leaning_walk, _leaning_trot,
    _nodding_side_step, _low_path, _high_walk, _walk_then_paw, _trot_then_bow, _paw_then_walk,
)  # fmt: skip
GOING = tuple(Family(name, write) for name, write in named(*_GOING).items())
