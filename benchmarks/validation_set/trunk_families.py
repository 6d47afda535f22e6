"""Families in which four feet stand: trunk tracks alone and together, tempo, paths, postures."""

from __future__ import annotations

from benchmarks.validation_set.drawing import (
    BODY_SIZES,
    CHANNELS,
    Draw,
    Family,
    moved,
    to_and_fro,
    writer_name,
)
from go2_wbc.reference import Posture
from motions import Timeline, deg

EASES = ("cubic", "in", "out", "linear")


def _one(channel: str, sign: float, draw: Draw, s: float) -> Timeline:
    """There, a while, and back."""
    size, over = sign * draw.between(0.8, 1.2) * BODY_SIZES[channel], draw.between(0.7, 1.4)
    line = moved(Timeline(), {channel: s * size}, over)
    return line.hold(draw.between(0.1, 0.6)).home(over=over)


def _crouch(draw: Draw, s: float) -> Timeline:
    return _one("z", -1.0, draw, s)


def _rise(draw: Draw, s: float) -> Timeline:
    return _one("z", 1.0, draw, 0.6 * s)


def _lean_along(draw: Draw, s: float) -> Timeline:
    return _one("x", draw.sign(), draw, s)


def _lean_aside(draw: Draw, s: float) -> Timeline:
    return _one("y", draw.sign(), draw, s)


def _roll_and_back(draw: Draw, s: float) -> Timeline:
    return _one("roll", draw.sign(), draw, s)


def _nose_down(draw: Draw, s: float) -> Timeline:
    return _one("pitch", 1.0, draw, s)


def _nose_up(draw: Draw, s: float) -> Timeline:
    return _one("pitch", -1.0, draw, s)


def _low_bow(draw: Draw, s: float) -> Timeline:
    pitch, z, over = draw.between(15.0, 30.0), draw.between(0.06, 0.10), draw.between(0.8, 1.4)
    line = Timeline().body(pitch=deg(s * pitch), z=-s * z, over=over)
    return line.hold(draw.between(0.2, 0.8)).home(over=over)


def _twists(draw: Draw, s: float) -> Timeline:
    line, yaw, over = Timeline(), draw.either(0.2, 0.35), draw.between(0.35, 0.8)
    for _ in range(draw.count(1, 3)):
        line = line.body(yaw=s * yaw, over=over).body(yaw=-s * yaw, over=over)
    return line.home(over=over)


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


def _tempo(channel: str, draw: Draw, s: float, wide: float = 1.0) -> Timeline:
    """To and fro; the amplitude is the tempo."""
    size, over = wide * draw.between(0.3, 0.6) * BODY_SIZES[channel], draw.between(0.25, 0.35) / s
    line = Timeline()
    for _ in range(draw.count(2, 4)):
        line = to_and_fro(line, channel, size, over)
    return line.home(over=0.5)


def _fast_sway(draw: Draw, s: float) -> Timeline:
    return _tempo(draw.one_of(("x", "y")), draw, s)


def _fast_bounce(draw: Draw, s: float) -> Timeline:
    return _tempo("z", draw, s)


def _fast_nod(draw: Draw, s: float) -> Timeline:
    return _tempo("pitch", draw, s)


def _fast_twist(draw: Draw, s: float) -> Timeline:
    return _tempo("yaw", draw, s)


def _fast_rock(draw: Draw, s: float) -> Timeline:
    return _tempo("roll", draw, s, 2.0)


def _sway_to_beats(draw: Draw, s: float) -> Timeline:
    channel, tempo = draw.one_of(CHANNELS), draw.between(90.0, 140.0)
    size, line = s * draw.between(0.4, 0.8) * BODY_SIZES[channel], Timeline().bpm(tempo)
    for _ in range(draw.count(2, 4)):
        line = to_and_fro(line, channel, size, 1)
    return line.home(over=1)


def _circle(draw: Draw, s: float) -> Timeline:
    turns, over = draw.count(1, 3), draw.between(0.9, 1.6)
    x, y = s * draw.between(0.02, 0.05), s * draw.either(0.02, 0.05)
    once = [{"x": x, "y": 0.0}, {"x": 0.0, "y": y}, {"x": -x, "y": 0.0}, {"x": 0.0, "y": -y}]
    points = [*(turns * once), {"x": 0.0, "y": 0.0}]
    return Timeline().body_path(points, over=turns * over).home(over=0.6)


def _nose_path(draw: Draw, s: float) -> Timeline:
    pitch, yaw, over = s * draw.between(0.2, 0.3), s * draw.either(0.2, 0.3), draw.between(1.0, 2.0)
    points = [
        {"pitch": pitch, "yaw": 0.0},
        {"pitch": 0.0, "yaw": yaw},
        {"pitch": -pitch, "yaw": 0.0},
        {"pitch": 0.0, "yaw": -yaw},
        {"pitch": 0.0, "yaw": 0.0},
    ]
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


def _random_trunk_faster(draw: Draw, s: float) -> Timeline:
    return _random_trunk(draw, 0.6).scale_time(1.0 / s)


def _to_and_fro_mirrored(draw: Draw, s: float) -> Timeline:
    part = _one(draw.one_of(("y", "roll", "yaw")), draw.sign(), draw, 0.8 * s)
    return part.then(part.mirror()).repeat(draw.count(1, 2))


def _backwards(draw: Draw, s: float) -> Timeline:
    return _random_trunk(draw, 0.8 * s).reverse()


_FAST = (_fast_sway, _fast_bounce, _fast_nod, _fast_twist, _fast_rock, _random_trunk_faster)
_WIDE = (
    _crouch, _rise, _lean_along, _lean_aside, _roll_and_back, _nose_down, _nose_up, _low_bow,
    _twists, _two_tracks, _three_tracks, _sway_to_beats, _circle, _nose_path, _gaze, _jolts,
    _jump_cut, _sit_and_rise, _nod_sitting, _sits_and_sways, _lopsided_end, _random_trunk,
    _to_and_fro_mirrored, _backwards,
)  # fmt: skip
TRUNK = (
    *(Family(writer_name(write), write, high=2.5) for write in _WIDE),
    *(Family(writer_name(write), write, 0.25, 4.0) for write in _FAST),
    Family("late_entry", _late_entry, late=1.0),
)
