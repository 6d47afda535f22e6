"""Files as people write them: each with one motion named ``shown``.

The last seven are by a hand that had not seen the studio: each of them found something.
"""

from collections.abc import Mapping
from types import MappingProxyType

HEAD = "from motions import Timeline, deg, motion\n\n\n"


def _file(body: str, head: str = HEAD) -> bytes:
    return (head + body).encode()


PLAIN = '''@motion
def shown() -> Timeline:
    """One call a line."""
    line = Timeline()
    line = line.body(pitch=deg(8.0), over=0.6)
    line = line.foot("FR", z=0.06, over=0.5)
    line = line.hold(0.4)
    line = line.down("FR", over=0.5)
    return line.home(over=0.6)
'''

FILES: Mapping[str, bytes] = MappingProxyType(
    {
        "one call a line": _file(PLAIN),
        "one chain": _file('''@motion
def shown() -> Timeline:
    return (
        Timeline()
        .body(z=-0.03, over=0.5)  # down
        .hold(0.3)

        .body(z=0.0, over=0.5)
        .home(over=0.5)
    )
'''),
        "chain in one line": _file('''@motion
def shown() -> Timeline:
    return Timeline().body(yaw=deg(5), over=.5).hold(.2).home(over=.5)
'''),
        "carriage returns": _file(PLAIN).replace(b"\n", b"\r\n"),
        "tabs": _file(PLAIN).replace(b"    ", b"\t"),
        "byte order mark": b"\xef\xbb\xbf" + _file(PLAIN),
        "constants": _file('''DEEP, SLOW = -0.04, 0.9
ANGLE = deg(6.0)
LEGS = ["FL", "FR"]


@motion
def shown() -> Timeline:
    line = Timeline().body(z=DEEP, pitch=ANGLE, over=SLOW)
    for leg in LEGS:
        line = line.home(over=SLOW / 2).foot(leg, z=0.05, over=0.5).down(leg, over=0.5)
    return line.home(over=SLOW)
'''),
        "nested loops": _file('''@motion
def shown() -> Timeline:
    line = Timeline()
    for leg in ("FL", "FR"):
        for height in (0.04, 0.06):
            line = line.foot(leg, z=height, over=0.4).down(leg, over=0.4)
        line = line.home(over=0.4)
    return line
'''),
        "tuples in a loop": _file('''@motion
def shown() -> Timeline:
    line = Timeline()
    for pitch, z in ((5.0, -0.02), (-4.0, -0.01)):
        line = line.body(pitch=deg(pitch), z=z, over=0.5)
    return line.home(over=0.5)
'''),
        "helper": _file('''def nod(line: Timeline, angle: float, *, over: float = 0.5) -> Timeline:
    return line.body(pitch=deg(angle), over=over).body(pitch=0.0, over=over)


@motion
def shown() -> Timeline:
    line = nod(Timeline(), 5.0)
    for angle in (4.0, 3.0):
        line = nod(line, angle, over=0.4)
    return line.home(over=0.5)
'''),
        "walrus": _file('''@motion
def shown() -> Timeline:
    line = Timeline().body(z=(low := -0.03), over=(t := 0.5)).body(z=low / 2, over=t)
    return line.home(over=t)
'''),
        "decorated": _file('''import functools


def twice(make):
    @functools.wraps(make)
    def doubled():
        return make().then(make())

    return doubled


@motion
@twice
def shown() -> Timeline:
    return Timeline().body(roll=deg(4.0), over=0.5).home(over=0.5)
'''),
        "parameters": _file('''@motion
def shown(
    depth: Annotated[float, Range(0.01, 0.05, "m")] = 0.03,
    times: Annotated[int, Range(1, 4)] = 2,
) -> Timeline:
    line = Timeline()
    for _ in range(times):
        line = line.body(z=-depth, over=0.4).body(z=0.0, over=0.4)
    return line.home(over=0.4)
''', "from typing import Annotated\n\nfrom motions import Range, Timeline, motion\n\n\n"),
        "dictionaries": _file('''BOW = {"pitch": deg(7.0), "z": -0.02}


@motion
def shown() -> Timeline:
    return Timeline().body(**BOW, over=0.6).body(**{"pitch": 0.0}, over=0.5).home(over=0.5)
'''),
        "members and functions": _file('''import math


@motion
def shown() -> Timeline:
    line = Timeline().posture(Posture.SIT, over=1.8).hold(0.3).home(over=0.6)
    line = line.posture(Posture.STAND, over=1.6).body(yaw=math.radians(5), over=0.5)
    return line.body(x=abs(-0.02), over=0.5, ease=Ease.CUBIC).home(over=0.5)
''', "from go2_wbc.curves import Ease\nfrom motions import Posture, Timeline, motion\n\n\n"),
        "points": _file('''@motion
def shown() -> Timeline:
    line = Timeline().body_path(
        [{"z": -0.02, "pitch": deg(3.0)}, {"z": 0.0, "pitch": 0.0}], over=1.2, times=[0.5, 1.2]
    )
    return line.home(over=0.5)
'''),
        "music": _file('''@motion
def shown() -> Timeline:
    line = Timeline().bpm(100.0)
    for swing in (deg(5), -deg(5)):
        line = line.body(yaw=swing, roll=swing / 2, over=1.0)
    return line.home(over=2.0)
'''),
        "semicolons": _file('''@motion
def shown() -> Timeline:
    line = Timeline(); line = line.body(z=-0.02, over=0.5); line = line.hold(0.2)
    for z in (-0.01, 0.0): line = line.body(z=z, over=0.4)
    return line.home(over=0.5)
'''),
        "umlauts and backslashes": _file('''# Größe: 3 cm, naïve
TIEFE = -0.03  # Höhe des Rumpfs


@motion
def shown() -> Timeline:
    return Timeline().hold(0.2, name="grüßt")\\
        .body(z=TIEFE, over=0.5)\\
        .home(over=0.5)
'''),
        "computed": _file('''import math


def points(n: int) -> list[float]:
    return [0.02 * math.sin(k) for k in range(n)]


@motion
def shown() -> Timeline:
    line = Timeline().body(z=-0.02, over=0.5)
    for z in points(3):
        line = line.body(z=z, over=0.4)
    return line.body(pitch=deg(4.0), over=0.5).hold(0.3).home(over=0.5)
'''),
        "objects": _file('''from dataclasses import dataclass, field, replace
from enum import Enum


@dataclass(frozen=True)
class Style:
    depth: float = 0.04
    tilt: float = 8.0
    beat: float = 0.5
    legs: tuple[str, ...] = field(default=("FR", "FL"))


class Pace(Enum):
    SLOW = 0.9


CALM = Style()
WILD = replace(CALM, tilt=11.0, beat=0.4)


class Dancer:
    def __init__(self, style: Style) -> None:
        self.style = style
        self.line = Timeline()

    def dip(self, times: float) -> "Dancer":
        s = self.style
        self.line = self.line.body(z=-s.depth * times, over=s.beat).body(z=0.0, over=s.beat)
        return self

    def tilt(self) -> "Dancer":
        self.line = self.line.body(roll=deg(self.style.tilt), over=self.style.beat)
        return self

    def paws(self) -> "Dancer":
        for leg in self.style.legs:
            self.line = self.line.foot(leg, z=0.06, over=self.style.beat).down(leg, over=0.5)
        return self


@motion
def shown() -> Timeline:
    wild = Dancer(WILD).tilt().line.home(over=Style(0.03, beat=0.6).beat)
    calm = Dancer(style=CALM).dip(0.5).tilt().paws().line.home(over=Pace.SLOW.value)
    return wild.then(calm)
'''),
        "arrays": _file('''import numpy as np

T = np.array([0.5, 0.6, 0.7])
YAWS = np.deg2rad([8, -8, 0])
POSES = {"low": -0.03, "high": 0.01}
KNOTS = [dict(x=0.02, y=0.0), dict(x=0.0, y=0.0)]


@motion
def shown() -> Timeline:
    line = Timeline()
    for z, t in zip((-0.02, -0.03, -0.04), T):
        line = line.body(z=z, over=t)
    for yaw in reversed(YAWS):
        line = line.body(yaw=yaw, over=0.5)
    line = line.body(yaw=YAWS[1], pitch=np.deg2rad(5), over=T[-1]).body(z=POSES["low"], over=0.5)
    for k, (name, z) in enumerate(POSES.items()):
        line = line.hold(0.1 * (k + 1), name=name).body(z=z, over=((0.7),)[0])
    return line.home(over=T[0]).body_path(KNOTS, over=2.4).hold(**dict(seconds=0.2))
'''),
        "choices": _file('''@motion
def shown() -> Timeline:
    """Choices, and comments in odd places."""
    side = "left" if FAST else "right"
    leg: str = "FR" if side == "right" else "FL"
    line = (
        Timeline()  # start
        .body(  # first
            z = -0.04,  # down
            # between
            over = 1.0 / SPEED,  # time
        )
        .body(z=0.0, over=0.6)
    )  # end
    for k in range(2):
        line = line.foot(leg, z=0.08 if k % 2 == 0 else HIGH, over=(0.5)).down(leg, over=(t := 0.5))
    return line.hold(t / 2).home(over=0.6 if FAST else 0.8)
''', HEAD + "FAST, SPEED, HIGH = False, 1.5, 0.06\n\n\n"),
        "lambdas": _file('''from functools import reduce

MOVES = [dict(yaw=deg(a), over=0.5 + 0.02 * abs(a)) for a in (6, -6, 0)]


@motion
def shown() -> Timeline:
    line = reduce(lambda line, words: line.body(**words), MOVES, Timeline().hold(0.2))
    return line.body(z=-0.02, over=0.5).home(over=0.5)
'''),
        "matches": _file('''def told(line: Timeline, words: list[str]) -> Timeline:
    match words:
        case ["wait", seconds]:
            return line.hold(float(seconds))
        case ["left" | "right" as way]:
            return line.body(yaw=deg(8 if way == "left" else -8), over=0.6)
    return line.body(z=-0.02, over=0.5)


@motion
def shown() -> Timeline:
    line = Timeline()
    for row in ("wait 0.3", "left", "right", "low"):
        line = told(line, row.split())
    return line.body(yaw=0.0, over=0.5).home(over=0.5)
'''),
        "layers": _file('''from contextlib import nullcontext


@motion
def shown() -> Timeline:
    line = Timeline()
    with nullcontext(deg(6)) as tilt:
        line = line.body(z=-0.04, over=1.0).also().body(roll=tilt, over=0.8)
        line = line.also().body(x=0.02, over=1.0)
    line = line.at(1.5).body(roll=0.0, x=0.0, over=1.2)
    try:
        line = line.at(3.2).body(z=0.0, over=0.8)
    finally:
        line = line.hold(0.2)
    return line.foot("FR", z=0.09, over=0.6).also().body(pitch=deg(-4), over=0.6).home(over=0.8)
'''),
        "other names": b'''from motions import (
    Timeline as TL,  # shorter
    deg as d,
    motion,
)


@motion
def shown() -> TL:
    line = TL(
        name="odd",  # a name
    )
    line = line.body(pitch=d(4), over=0.5)
    move = line.body; line = move(yaw=0.1, over=6e-1)
    return line.home(over=0_1.0)
''',
    }
)  # fmt: skip
