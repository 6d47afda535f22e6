"""Motions of the trunk over feet that stay: moods, gestures and figures."""

import math
from typing import Annotated

from go2_wbc.motion_plan import Posture
from motions import Choice, Range, Timeline, deg, motion

Side = Annotated[str, Choice("left", "right")]


@motion
def nod(times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Nod: yes, yes, yes."""
    line = Timeline()
    for _ in range(times):
        line = line.body(pitch=deg(12.0), over=0.4).body(pitch=deg(-4.0), over=0.4)
    return line.home(over=0.4)


@motion
def shake_head(times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Shake the head: no, no, no."""
    line = Timeline()
    for _ in range(times):
        line = line.body(yaw=deg(10.0), over=0.5).body(yaw=deg(-10.0), over=0.5)
    return line.home(over=0.4)


@motion
def tilt_head(times: Annotated[int, Range(1, 4)] = 1) -> Timeline:
    """Tilt the head: what did you say? To one side, to the other, and up at you."""
    line = Timeline()
    for _ in range(times):
        for side in (1.0, -1.0):
            line = line.body(roll=deg(12.0) * side, pitch=deg(-6.0), over=0.5).hold(0.7)
    return line.body(roll=0.0, pitch=deg(-10.0), over=0.6).hold(0.5).home(over=0.7)


@motion
def look_around() -> Timeline:
    """Look around: up to the left, up to the right, and down at what lies there."""
    return (
        Timeline()
        .body(yaw=deg(17.0), pitch=deg(-12.0), over=0.9)
        .hold(0.5)
        .body(yaw=deg(-17.0), over=1.3)
        .hold(0.5)
        .body(yaw=0.0, pitch=deg(16.0), z=-0.03, over=0.9)
        .hold(0.6)
        .home(over=0.8)
    )


@motion
def bow(angle: Annotated[float, Range(0.1, 0.45, "rad")] = deg(20.0)) -> Timeline:
    """Bow: dip the chest over the front feet, stay a moment, come up again."""
    return Timeline().body(pitch=angle, z=-0.05, over=0.9).hold(0.6).home(over=0.9)


@motion
def breathe(breaths: Annotated[int, Range(1, 10)] = 3) -> Timeline:
    """Breathe: calm, in and out."""
    line = Timeline()
    for _ in range(breaths):
        line = line.body(z=0.015, over=1.1).body(z=-0.015, over=1.3)
    return line.home(over=0.8)


@motion
def content(times: Annotated[int, Range(1, 6)] = 2) -> Timeline:
    """Content: look up, sway from side to side with small bounces, and sigh."""
    line = Timeline().body(pitch=deg(-9.0), z=0.01, over=0.7)
    for _ in range(times):
        for side in (1.0, -1.0):
            line = line.body(roll=side * deg(6.0), y=side * 0.015, over=0.55)
            line = line.body(z=-0.01, over=0.3).body(z=0.012, over=0.3)
    line = line.body(roll=0.0, y=0.0, pitch=deg(-12.0), z=0.015, over=0.7).hold(0.3)
    return line.body(pitch=deg(4.0), z=-0.03, over=1.0).hold(0.2).home(over=0.8)


@motion
def push_ups(
    times: Annotated[int, Range(1, 10)] = 4, depth: Annotated[float, Range(0.04, 0.14, "m")] = 0.12
) -> Timeline:
    """Push-ups: down and up, as often as you dare."""
    line = Timeline().body(pitch=deg(-4.0), over=0.5)
    for _ in range(times):
        line = line.body(z=-depth, over=0.5).body(z=0.0, over=0.45)
    return line.home(over=0.5)


@motion
def sit_pretty(side: Side = "right") -> Timeline:
    """Sit pretty: sit down like a dog, tilt the head to one side and the other, stand up again."""
    line = (
        Timeline()
        .posture(Posture.SIT, over=1.8)
        .hold(0.4)
        .body(roll=deg(6.0), over=0.9)
        .hold(0.6)
        .body(roll=deg(-6.0), pitch=deg(-4.0), over=1.2)
        .hold(0.6)
        .home(over=0.9)
        .posture(Posture.STAND, over=1.6)
    )
    return line if side == "right" else line.mirror()


@motion
def sleepy() -> Timeline:
    """Sleepy: the head sinks, catches itself, sinks again; then wide awake."""
    line = Timeline()
    for pitch, z in ((12.0, -0.05), (15.0, -0.08)):
        drowsy = {"pitch": deg(0.3 * pitch), "z": 0.3 * z}  # hardly at first, then faster
        asleep = {"pitch": deg(pitch), "z": z}
        line = line.body_path([drowsy, asleep], over=2.6, times=[1.7, 2.6])
        line = line.hold(0.4).body(pitch=deg(1.0), z=-0.01, over=0.6)
    return line.body(pitch=deg(-10.0), z=0.01, over=0.6).hold(0.5).home(over=0.6)


@motion
def sneeze(times: Annotated[int, Range(1, 4)] = 2) -> Timeline:
    """Sneeze: the head goes back, and back, and down at once; then a shake."""
    line = Timeline()
    for _ in range(times):
        line = (
            line.body(pitch=deg(-7.0), over=0.5)
            .body(pitch=deg(-11.0), z=0.01, over=0.4)
            .body(pitch=deg(9.0), z=-0.04, over=0.35)
            .body(pitch=0.0, z=0.0, over=0.5)
        )
    for roll in (6.0, -6.0, 4.0):
        line = line.body(roll=deg(roll), over=0.3)
    return line.home(over=0.5)


@motion
def sniff(times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Sniff: nose to the ground, along a trail from side to side, and up again."""
    line = Timeline().body(pitch=deg(15.0), z=-0.06, x=0.02, over=0.9)
    for _ in range(times):
        for yaw in (9.0, -9.0):
            line = line.body(yaw=deg(yaw), over=0.5).also().body(pitch=deg(17.0), over=0.25)
            line = line.at(line.end - 0.25).body(pitch=deg(14.0), over=0.25)
    return line.body(yaw=0.0, pitch=deg(-8.0), z=0.0, over=0.8).hold(0.4).home(over=0.7)


@motion
def stretch() -> Timeline:
    """Stretch like after a nap: chest down and forward legs long, then the other way round."""
    return (
        Timeline()
        .body(pitch=deg(20.0), x=-0.04, z=-0.05, over=1.7)
        .hold(0.7)
        .body(pitch=deg(-14.0), x=0.05, z=0.0, over=1.7)
        .hold(0.5)
        .home(over=1.0)
    )


@motion
def figure_eight(
    width: Annotated[float, Range(0.02, 0.05, "m")] = 0.04, rounds: Annotated[int, Range(1, 4)] = 2
) -> Timeline:
    """Figure of eight: the trunk draws a lying eight over feet that stay."""
    points = [
        {"y": width * math.sin(a), "x": width / 2 * math.sin(2 * a), "roll": deg(-6) * math.sin(a)}
        for a in _angles(16, rounds)
    ]
    return Timeline().body(z=-0.03, over=0.6).body_path(points, over=3.2 * rounds).home(over=0.7)


@motion
def nose_circle(
    radius: Annotated[float, Range(0.05, 0.25, "rad")] = 0.18,
    rounds: Annotated[int, Range(1, 4)] = 2,
) -> Timeline:
    """Nose circle: the nose draws a ring in the air."""
    angles = _angles(12, rounds)
    points = [{"yaw": radius * math.sin(a), "pitch": -radius * math.cos(a)} for a in angles]
    line = Timeline().body(pitch=-radius, over=0.7)
    return line.body_path(points, over=2.0 * rounds).home(over=0.7)


def _angles(points: int, rounds: int) -> list[float]:
    """Of the points [rad] of a figure that a curve passes, round after round."""
    return [2.0 * math.pi * k / points for k in range(1, points * rounds + 1)]


POINTS = 24  #: Points of the heart that the nose passes
WIDTH, HEIGHT = deg(7.0), deg(9.0)
"""Half of the heart's width in yaw and of its height in pitch [rad]."""


@motion
def heart(times: Annotated[int, Range(1, 4)] = 2) -> Timeline:
    """Heart: the nose draws a heart in the air, then a paw is raised to the chest."""
    yaw, pitch = _place(0)
    line = Timeline().body(yaw=yaw, pitch=pitch, over=0.8)
    for _ in range(times):
        points = [_place(number) for number in range(1, POINTS + 1)]
        line = line.body_path([{"yaw": yaw, "pitch": pitch} for yaw, pitch in points], over=3.6)
    line = line.home(over=0.8).foot("FR", x=0.04, y=0.06, z=0.12, over=0.8).hold(0.6)
    return line.home(over=0.9)


def _place(number: int) -> tuple[float, float]:
    """Yaw and pitch [rad] on a heart that begins at the dip between its two bows."""
    t = 2.0 * math.pi * number / POINTS
    aside = math.sin(t) ** 3
    up = (13.0 * math.cos(t) - 5.0 * math.cos(2 * t) - 2.0 * math.cos(3 * t) - math.cos(4 * t)) / 15
    return -WIDTH * aside, -HEIGHT * up
