"""Dances: to a tempo, or put together from other motions."""

import math
from typing import Annotated

from motions import Range, Timeline, deg, motion
from motions.library.paws import curtsy, lift_leg, salute, shake_paw, wave
from motions.library.trunk import bow, content, push_ups
from motions.library.walks import moonwalk, pirouette

RADIUS = 0.035  #: Radius [m] of the circle
LEAN = deg(5.0)  #: Angle [rad] by which the trunk leans inwards


@motion
def hula(rounds: Annotated[int, Range(1, 6)] = 2) -> Timeline:
    """Hula: the trunk goes round in circles, leaning inwards."""
    line = _lean(Timeline(), 0, over=0.6)
    for corner in range(1, 4 * rounds + 1):
        line = _lean(line, corner, over=0.45)
    return line.home(over=0.6)


def _lean(line: Timeline, corner: int, *, over: float) -> Timeline:
    """Move to one of the four corners of the circle: ahead, left, back, right."""
    ahead, left = ((1, 0), (0, 1), (-1, 0), (0, -1))[corner % 4]
    return line.body(
        x=RADIUS * ahead, y=RADIUS * left, pitch=-LEAN * ahead, roll=-LEAN * left, over=over
    )


@motion
def sway(
    tempo: Annotated[float, Range(40.0, 90.0, "bpm")] = 60.0, bars: Annotated[int, Range(1, 8)] = 2
) -> Timeline:
    """Sway: from side to side in time, leaning into each step of the song."""
    line = Timeline().bpm(tempo)
    for _ in range(bars):
        for side in (1.0, -1.0):
            line = line.body(y=0.03 * side, roll=deg(-6.0) * side, z=-0.02, over=1.0)
            line = line.body(y=0.0, roll=0.0, z=0.0, over=1.0)
    return line.home(over=1.0)


@motion
def tap_dance(
    tempo: Annotated[float, Range(40.0, 100.0, "beats/min")] = 80.0,
    bars: Annotated[int, Range(1, 4)] = 2,
) -> Timeline:
    """Tap dance: two taps right, two taps left, to the beat."""
    line = Timeline().bpm(tempo)
    for _ in range(bars):
        for foot in ("FR", "FL"):
            line = line.unweight(foot, over=1.0)
            for _ in range(2):
                line = line.foot(foot, z=0.05, over=0.5).down(foot, over=0.5)
    return line.home(over=1.0)


@motion
def twist(tempo: Annotated[float, Range(40.0, 120.0, "beats/min")] = 75.0) -> Timeline:
    """Twist: turn against the feet to the beat, going down and coming up again."""
    line, swing = Timeline().bpm(tempo), deg(11.0)
    for height in (-0.03, -0.07, -0.10, -0.07, -0.03, 0.0):
        line = line.body(yaw=swing, z=height, over=1.0)
        swing = -swing
    return line.home(over=1.0)


@motion
def wiggle(times: Annotated[int, Range(1, 10)] = 4) -> Timeline:
    """Wiggle the hips: happy to see you."""
    line = Timeline().body(pitch=deg(8.0), z=-0.02, over=0.5)
    for _ in range(times):
        line = line.body(yaw=deg(4.5), roll=deg(5.0), y=0.01, over=0.4)
        line = line.body(yaw=deg(-4.5), roll=deg(-5.0), y=-0.01, over=0.4)
    return line.home(over=0.6)


HEAD = 0.25  #: Distance [m] from the middle of the trunk to the point ahead that stays where it is
SWING = deg(6.0)  #: Angle [rad] by which the rump goes to either side


@motion
def wiggle_hips(
    times: Annotated[int, Range(1, 8)] = 4,
    tempo: Annotated[float, Range(60.0, 120.0, "beats/min")] = 100.0,
) -> Timeline:
    """Wiggle the hips: head low and still, the rump from side to side, on the beat."""
    line = Timeline().body(pitch=deg(9.0), z=-0.02, over=0.6).bpm(tempo)
    for _ in range(times):
        for swing in (SWING, -SWING):
            line = line.body(yaw=swing, y=-HEAD * math.sin(swing), roll=swing / 2, over=1.0)
    return line.home(over=2.0)


@motion
def step_dance(
    tempo: Annotated[float, Range(90.0, 140.0, "bpm")] = 120.0,
    bars: Annotated[int, Range(1, 8)] = 2,
) -> Timeline:
    """Step dance: two steps aside and back on the beat, rolling into them, a turn and a paw."""
    line = Timeline().bpm(tempo)
    for _ in range(bars):
        for side in (1.0, -1.0):
            aside = Timeline().bpm(tempo).side_step(0.08 * side, gait="trot")
            beats = aside.end * tempo / 60.0
            lean = Timeline().bpm(tempo).body(roll=deg(-5.0 * side), over=beats / 2.0)
            line = line.together(aside, lean.body(roll=0.0, over=beats / 2.0))
    line = line.turn(deg(45), gait="trot").turn(deg(-45), gait="trot")
    return line.foot("FR", x=0.06, z=0.12, over=2).down("FR", over=2).home(over=2)


@motion
def dance() -> Timeline:
    """Dance for half a minute: wiggle, twist, tap, hula, wave, and bow to the audience."""
    return wiggle().then(
        twist(tempo=60.0),
        tap_dance(tempo=80.0, bars=1),
        hula(rounds=1),
        push_ups(times=2),
        wave(times=2),
        bow(),
    )


@motion
def dance2() -> Timeline:
    """Dance for most of a minute: hips, taps, hula, every leg once in the air, and a curtsy."""
    return wiggle_hips(times=2, tempo=80.0).then(
        tap_dance(bars=1),
        hula(rounds=1),
        shake_paw(side="left"),
        content(times=1),
        lift_leg(),
        lift_leg().mirror(),
        wave(side="left", times=2),
        push_ups(times=2),
        curtsy(),
    )


@motion
def show() -> Timeline:
    """Show: a minute on stage: enter, greet, dance, moonwalk, pirouette, and bow to everybody."""
    enter = Timeline().walk(x=0.5, gait="trot")
    about = Timeline().turn(deg(180.0), gait="trot")
    acts = (wave(), step_dance(), hula(), moonwalk())
    finale = (pirouette(), salute(), bow(), about, bow())
    return enter.then(*acts, *finale)
