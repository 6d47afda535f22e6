"""Motions that walk."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion
from motions.library.trunk import bow, look_around

Side = Annotated[str, Choice("left", "right")]


@motion
def bow_and_turn() -> Timeline:
    """Bow and turn: a bow to the front, about turn, and a bow to those behind."""
    return bow().then(Timeline().turn(deg(180.0), gait="trot"), bow())


@motion
def cross_step() -> Timeline:
    """Cross step: one front foot before the other and back, first the left, then the right."""
    line = Timeline()
    for foot, across in (("FL", -0.16), ("FR", 0.16)):
        line = line.step(foot, x=0.10, y=across, over=0.6).hold(0.3)
        line = line.step(foot, x=-0.10, y=-across, over=0.6).hold(0.3)
    return line.home(over=1.4)


@motion
def march(
    tempo: Annotated[float, Range(90.0, 140.0, "bpm")] = 110.0,
    length: Annotated[float, Range(0.1, 1.0, "m")] = 0.4,
) -> Timeline:
    """March: ahead on the beat with the head up, about turn, back, about turn."""
    up = Timeline().bpm(tempo).body(pitch=deg(-6.0), over=2)
    out = up.walk(x=length, gait="trot").turn(deg(180), gait="trot")
    back = out.walk(x=length, gait="trot").turn(deg(180), gait="trot")
    return back.home(over=2)


@motion
def moonwalk(length: Annotated[float, Range(0.2, 1.5, "m")] = 0.6) -> Timeline:
    """Moonwalk: leaning ahead as if to go on, and gliding backwards."""
    lean = Timeline().body(pitch=deg(7.0), x=0.015, z=-0.02, over=0.7)
    glide = Timeline().walk(x=-length, gait="trot")
    up = lean.together(glide).body(pitch=deg(-8.0), x=0.0, z=0.0, over=0.6)
    return up.hold(0.4).home(over=0.7)


@motion
def patrol(length: Annotated[float, Range(0.3, 2.0, "m")] = 0.8) -> Timeline:
    """Patrol: ahead, a look around, about turn, and back to where it was."""
    way = Timeline().walk(x=length, gait="trot")
    about = Timeline().turn(deg(180.0), gait="trot")
    return way.then(look_around(), about, way, about)


@motion
def pirouette(side: Side = "left", turns: Annotated[int, Range(1, 3)] = 1) -> Timeline:
    """Pirouette: head up, and once round on the spot."""
    line = Timeline().body(pitch=deg(-7.0), z=0.01, over=0.6)
    for _ in range(2 * turns):
        line = line.turn(deg(180.0), gait="trot")
    line = line.home(over=0.7)
    return line if side == "left" else line.mirror()


@motion
def side_shuffle(
    width: Annotated[float, Range(0.08, 0.4, "m")] = 0.2, times: Annotated[int, Range(1, 4)] = 2
) -> Timeline:
    """Side shuffle: quick steps to the left, quick steps to the right."""
    line = Timeline()
    for _ in range(times):
        for side in (1.0, -1.0):
            line = line.side_step(side * width, gait="trot").hold(0.2)
    return line


@motion
def square(edge: Annotated[float, Range(0.2, 1.0, "m")] = 0.4, side: Side = "left") -> Timeline:
    """Square: four edges, four corners, and back at the start."""
    line = Timeline()
    for _ in range(4):
        line = line.walk(x=edge, gait="trot").turn(deg(90.0), gait="trot")
    return line if side == "left" else line.mirror()


@motion
def zigzag(
    length: Annotated[float, Range(0.6, 2.0, "m")] = 1.2,
    width: Annotated[float, Range(0.05, 0.2, "m")] = 0.12,
) -> Timeline:
    """Zigzag: ahead in curves, left and right, heading where it goes."""
    quarter = length / 4.0
    points = [(quarter, width), (2 * quarter, 0.0), (3 * quarter, -width), (length, 0.0)]
    return Timeline().path(points, gait="trot")
