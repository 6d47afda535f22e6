"""Families in which four feet stand: trunk tracks alone and together, tempo, paths, postures."""

from benchmarks.validation_set.drawing import (
    BODY_SIZES,
    CHANNELS,
    Draw,
    Family,
    Write,
    moved,
    named,
    to_and_fro,
)
from go2_wbc.motion_plan import Posture
from motions import Timeline, deg

EASES = ("cubic", "in", "out", "linear")


def _there_and_back(
    draw: Draw, s: float, channel: str, sign: float = 0.0, scale: float = 1.0
) -> Timeline:
    """There, a while, and back; a ``sign`` of 0 is drawn."""
    sign = sign or draw.sign()
    size, over = sign * draw.between(0.8, 1.2) * BODY_SIZES[channel], draw.between(0.7, 1.4)
    line = moved(Timeline(), {channel: scale * s * size}, over)
    return line.hold(draw.between(0.1, 0.6)).home(over=over)


def _low_bow(draw: Draw, s: float) -> Timeline:
    pitch, z, over = draw.between(15.0, 30.0), draw.between(0.06, 0.10), draw.between(0.8, 1.4)
    line = Timeline().body(pitch=deg(s * pitch), z=-s * z, over=over)
    return line.hold(draw.between(0.2, 0.8)).home(over=over)


def _twists(draw: Draw, s: float) -> Timeline:
    yaw, over = draw.either(0.2, 0.35), draw.between(0.35, 0.8)
    return to_and_fro(Timeline(), "yaw", s * yaw, over, draw.count(1, 3)).home(over=over)


def _two_tracks(draw: Draw, s: float) -> Timeline:
    first, second = draw.some(CHANNELS, 2)
    one, two = draw.either(0.5, 1.0), draw.either(0.5, 1.0)
    over, later = draw.between(0.6, 1.2), draw.between(0.4, 1.0)
    line = moved(Timeline(), {first: s * one * BODY_SIZES[first]}, over).also()
    line = moved(line, {second: s * two * BODY_SIZES[second]}, later)
    return line.hold(0.2).home(over=over)


def _three_tracks(draw: Draw, s: float) -> Timeline:
    line, over = Timeline(), draw.between(0.7, 1.3)
    for _ in range(draw.count(1, 2)):
        values = {c: s * draw.either(0.3, 0.8) * BODY_SIZES[c] for c in draw.some(CHANNELS, 3)}
        line = moved(line, values, over)
    return line.home(over=over)


def _tempo(draw: Draw, s: float, channel: str, wide: float = 1.0) -> Timeline:
    """To and fro; the amplitude is the tempo."""
    size, over = wide * draw.between(0.3, 0.6) * BODY_SIZES[channel], draw.between(0.25, 0.35) / s
    return to_and_fro(Timeline(), channel, size, over, draw.count(2, 4)).home(over=0.5)


def _sway_to_beats(draw: Draw, s: float) -> Timeline:
    channel, tempo = draw.one_of(CHANNELS), draw.between(90.0, 140.0)
    size, line = s * draw.between(0.4, 0.8) * BODY_SIZES[channel], Timeline().bpm(tempo)
    return to_and_fro(line, channel, size, 1, draw.count(2, 4)).home(over=1)


def _circle(draw: Draw, s: float) -> Timeline:
    turns, over = draw.count(1, 3), draw.between(0.9, 1.6)
    once = _round("x", s * draw.between(0.02, 0.05), "y", s * draw.either(0.02, 0.05))
    points = [*(turns * once), {"x": 0.0, "y": 0.0}]
    return Timeline().body_path(points, over=turns * over).home(over=0.6)


def _round(first: str, one: float, second: str, two: float) -> list[dict[str, float]]:
    ends = ((one, 0.0), (0.0, two), (-one, 0.0), (0.0, -two))
    return [{first: one, second: two} for one, two in ends]


def _nose_path(draw: Draw, s: float) -> Timeline:
    pitch, yaw, over = s * draw.between(0.2, 0.3), s * draw.either(0.2, 0.3), draw.between(1.0, 2.0)
    points = [*_round("pitch", pitch, "yaw", yaw), {"pitch": 0.0, "yaw": 0.0}]
    return Timeline().body_path(points, over=over).home(over=0.5)


def _gaze(draw: Draw, s: float) -> Timeline:
    line, over = Timeline(), draw.between(0.5, 1.0)
    for _ in range(draw.count(1, 3)):
        y, z = s * draw.either(0.2, 0.6), 0.3 + s * draw.either(0.1, 0.3)
        line = line.look_at(1.2, y, z, over=over)
    return line.home(over=over)


def _jolts(draw: Draw, s: float) -> Timeline:
    channel, ease = draw.one_of(CHANNELS), draw.one_of(EASES)
    size, over = draw.either(0.4, 0.8) * BODY_SIZES[channel], draw.between(0.5, 0.9)
    line = moved(Timeline(), {channel: s * size}, over, ease)
    return line.hold(0.3).home(over=0.8)


def _jump_cut(draw: Draw, s: float) -> Timeline:
    channel = draw.one_of(CHANNELS)
    size = s * draw.either(0.1, 0.2) * BODY_SIZES[channel]
    line = moved(Timeline(), {channel: size}, 0.3, "hold")
    return line.hold(0.4).home(over=0.8)


def _sit_and_rise(draw: Draw, s: float) -> Timeline:
    over = draw.between(0.8, 1.2) / s
    line = Timeline().posture("sit", over=over).hold(draw.between(0.2, 0.6))
    return line.posture("stand", over=over)


def _nod_sitting(draw: Draw, s: float) -> Timeline:
    channel = draw.one_of(("pitch", "yaw", "roll", "x"))
    size, over = s * draw.either(0.4, 0.8) * BODY_SIZES[channel], draw.between(0.5, 0.9)
    line = to_and_fro(Timeline(entry=Posture.SIT, exit=Posture.SIT), channel, size, over)
    return line.home(over=over)


def _sits_and_sways(draw: Draw, s: float) -> Timeline:
    size, over = s * draw.between(0.04, 0.08), draw.between(0.5, 0.9)
    line = Timeline().posture("sit", over=1.5).body(y=size, over=over).body(y=-size, over=over)
    return line.home(over=0.5).posture("stand", over=1.5)


def _late_entry(draw: Draw, s: float) -> Timeline:
    z, y, over = draw.between(0.02, 0.06), draw.either(0.01, 0.05), draw.between(0.6, 1.0)
    return Timeline().body(z=-s * z, y=s * y, over=1.0).hold(0.5).home(over=over)


def _lopsided_end(draw: Draw, s: float) -> Timeline:
    size, over = draw.either(0.02, 0.05), draw.between(0.6, 1.2)
    return Timeline().body(z=-0.03, over=0.6).body(y=s * size, z=0.0, over=over)


def _random_trunk(draw: Draw, s: float) -> Timeline:
    line = Timeline()
    for _ in range(draw.count(3, 5)):
        chosen = draw.some(CHANNELS, draw.count(1, 3))
        values = {c: s * draw.either(0.2, 0.8) * BODY_SIZES[c] for c in chosen}
        line = moved(line, values, draw.between(0.4, 1.2)).hold(draw.between(0.0, 0.3))
    return line.home(over=0.9)


def _to_and_fro_mirrored(draw: Draw, s: float) -> Timeline:
    part = _there_and_back(draw, 0.8 * s, draw.one_of(("y", "roll", "yaw")))
    return part.then(part.mirror()).repeat(draw.count(1, 2))


_WIDE: dict[str, Write] = {
    "crouch": lambda draw, s: _there_and_back(draw, s, "z", -1.0),
    "rise": lambda draw, s: _there_and_back(draw, s, "z", 1.0, scale=0.6),
    "lean_along": lambda draw, s: _there_and_back(draw, s, "x"),
    "lean_aside": lambda draw, s: _there_and_back(draw, s, "y"),
    "roll_and_back": lambda draw, s: _there_and_back(draw, s, "roll"),
    "nose_down": lambda draw, s: _there_and_back(draw, s, "pitch", 1.0),
    "nose_up": lambda draw, s: _there_and_back(draw, s, "pitch", -1.0),
    **named(
        *(_low_bow, _twists, _two_tracks, _three_tracks, _sway_to_beats, _circle, _nose_path),
        *(_gaze, _jolts, _jump_cut, _sit_and_rise, _nod_sitting, _sits_and_sways, _lopsided_end),
        *(_random_trunk, _to_and_fro_mirrored),
    ),
    "backwards": lambda draw, s: _random_trunk(draw, 0.8 * s).reverse(),
}
_FAST: dict[str, Write] = {
    "fast_sway": lambda draw, s: _tempo(draw, s, draw.one_of(("x", "y"))),
    "fast_bounce": lambda draw, s: _tempo(draw, s, "z"),
    "fast_nod": lambda draw, s: _tempo(draw, s, "pitch"),
    "fast_twist": lambda draw, s: _tempo(draw, s, "yaw"),
    "fast_rock": lambda draw, s: _tempo(draw, s, "roll", 2.0),
    "random_trunk_faster": lambda draw, s: _random_trunk(draw, 0.6).scale_time(1.0 / s),
}
TRUNK = (
    *(Family(name, write, high=2.5) for name, write in _WIDE.items()),
    *(Family(name, write, 0.25, 4.0) for name, write in _FAST.items()),
    Family("late_entry", _late_entry, late=1.0),
)
