"""Motions of one paw: greetings, signs and games, on the other three feet."""

from typing import Annotated

from go2_wbc.robot.description import find_profile
from motions import Choice, Range, Timeline, deg, motion

Side = Annotated[str, Choice("left", "right")]


THIGH, CALF = -1.05, -1.15  #: Angles [rad] of the leg that waves


@motion
def wave(side: Side = "right", times: Annotated[int, Range(1, 8)] = 3) -> Timeline:
    """Wave hello: raise a paw and swing it from side to side."""
    line = (
        Timeline()
        .leg("FR", hip=-0.1, thigh=-0.3, calf=-2.0, over=0.6)
        .also()
        .body(pitch=deg(-8.0), z=0.01, over=0.6)
        .leg("FR", hip=-0.1, thigh=THIGH, calf=CALF, over=0.6)
        .also()
        .body(pitch=deg(-13.0), z=0.02, over=0.6)
    )
    for _ in range(times):
        for hip in (-0.38, 0.12):
            line = line.leg("FR", hip=hip, thigh=THIGH, calf=CALF, over=0.35)
    line = line.leg("FR", hip=-0.1, thigh=-0.3, calf=-2.0, over=0.6).home(over=0.8)
    return line if side == "right" else line.mirror()


HEIGHT = 0.64  #: Height [m] above the ground at which the paw's centre is held by default
REACH, TAP = 0.177, 0.034
"""Distance [m] of the paw ahead of where it stood, and how much farther it taps."""
FOLDED = (-0.10, -0.30, -2.0)
"""Hip, thigh and calf angle [rad] of a raised right leg on its way up: the knee goes first."""


@motion
def high_five(
    side: Side = "right",
    height: Annotated[float, Range(0.25, 0.66, "m")] = HEIGHT,
    hold: Annotated[float, Range(0.5, 30.0, "s")] = 2.0,
    reach: Annotated[float, Range(0.1, 0.4, "m")] = REACH,
) -> Timeline:
    """High five: three feet on the ground, a paw up, two taps, and back.

    The numbers come from a search over trunk attitude, height and paw position for large margins at
    once: CoM to the edges of the support triangle, load of the lightest foot, torque, and distance
    of every joint to its limits.
    """
    up = height - find_profile().foot_radius
    hip, thigh, calf = FOLDED
    right = (
        Timeline()
        .unweight("FR", over=1.2)
        .also()
        .body(roll=deg(-1.2), pitch=deg(-4.0), yaw=deg(-0.9), z=0.006, over=1.2)
        .hold(0.4)
        .leg("FR", hip=hip, thigh=thigh, calf=calf, over=0.6)
        .also()
        .body(roll=deg(-2.3), pitch=deg(-9.2), yaw=deg(-1.7), z=0.016, over=0.6)
        .foot("FR", x=reach, y=0.082, z=up, over=0.6)
        .also()
        .body(roll=deg(-4.0), pitch=deg(-17.2), yaw=deg(-2.9), z=0.026, over=0.6)
        .hold(hold, name="held", foot="FR")
    )
    for _ in range(2):
        right = right.foot("FR", x=reach + TAP, y=0.082, z=up - 0.026, over=0.35)
        right = right.foot("FR", x=reach, y=0.082, z=up, over=0.35)
    right = (
        right.leg("FR", hip=hip, thigh=thigh, calf=calf, over=0.6)
        .also()
        .body(roll=deg(-2.3), pitch=deg(-9.2), yaw=deg(-1.7), z=0.016, over=0.6)
        .down("FR", over=0.6)
        .also()
        .body(roll=deg(-1.2), pitch=deg(-4.0), yaw=deg(-0.9), z=0.006, over=0.6)
        .hold(0.4)
        .home(over=1.2)
    )
    return right if side == "right" else right.mirror()


@motion
def shake_paw(side: Side = "right", times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Shake a paw: offer it, let it be shaken, take it back."""
    line = (
        Timeline()
        .foot("FR", x=0.13, y=0.04, z=0.16, over=0.9)
        .also()
        .body(pitch=deg(-6.0), over=0.9)
        .hold(0.4)
    )
    for _ in range(times):
        line = line.foot("FR", x=0.13, y=0.04, z=0.20, over=0.22)
        line = line.foot("FR", x=0.13, y=0.04, z=0.14, over=0.22)
    line = line.hold(0.3).home(over=0.9)
    return line if side == "right" else line.mirror()


@motion
def salute(side: Side = "right", hold: Annotated[float, Range(0.3, 5.0, "s")] = 1.0) -> Timeline:
    """Salute: a paw to the brow, chest out, hold, and down smartly."""
    line = (
        Timeline()
        .leg("FR", hip=-0.05, thigh=-0.3, calf=-2.0, over=0.6)
        .also()
        .body(pitch=deg(-8.0), over=0.6)
        .leg("FR", hip=0.15, thigh=-1.1, calf=-1.7, over=0.5)
        .also()
        .body(pitch=deg(-12.0), z=0.01, over=0.5)
        .hold(hold, name="salute")
        .leg("FR", hip=-0.05, thigh=-0.3, calf=-2.0, over=0.5)
        .home(over=0.7)
    )
    return line if side == "right" else line.mirror()


@motion
def beckon(side: Side = "right", times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Beckon: come here! A paw stretched out curls in, again and again."""
    line = Timeline().leg("FR", hip=-0.05, thigh=-0.4, calf=-1.9, over=0.7)
    line = line.also().body(pitch=deg(-6.0), over=0.7)
    for _ in range(times):
        line = line.leg("FR", hip=-0.05, thigh=-0.9, calf=-1.2, over=0.45)
        line = line.leg("FR", hip=-0.05, thigh=-0.5, calf=-2.1, over=0.45)
    line = line.home(over=0.9)
    return line if side == "right" else line.mirror()


@motion
def knock(side: Side = "right", times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Knock: a raised paw beats three times from the knee, and waits for an answer."""
    line = Timeline().leg("FR", hip=0.0, thigh=-0.5, calf=-1.9, over=0.8)
    for _ in range(times):
        line = line.joint("FR", "calf", -1.55, over=0.25).joint("FR", "calf", -1.9, over=0.25)
    line = line.hold(0.4).home(over=0.8)
    return line if side == "right" else line.mirror()


@motion
def point(
    x: Annotated[float, Range(0.8, 5.0, "m")] = 1.0,
    y: Annotated[float, Range(-0.4, 0.0, "m")] = -0.15,
    hold: Annotated[float, Range(0.3, 5.0, "s")] = 1.0,
) -> Timeline:
    """Point: look at a place on the ground ahead, and raise a paw towards it."""
    return (
        Timeline()
        .look_at(x, y, 0.2, over=0.9)
        .leg("FR", hip=-0.05, thigh=-0.2, calf=-1.9, over=0.7)
        .leg("FR", hip=-0.05, thigh=-0.75, calf=-1.2, over=0.6)
        .hold(hold, name="point")
        .leg("FR", hip=-0.05, thigh=-0.2, calf=-1.9, over=0.6)
        .home(over=1.1)
    )


@motion
def stamp(side: Side = "right", times: Annotated[int, Range(1, 8)] = 3) -> Timeline:
    """Stamp: impatient, with a front foot, again and again."""
    line = Timeline().body(pitch=deg(3.0), over=0.4)
    for _ in range(times):
        line = line.foot("FR", x=0.01, z=0.06, over=0.3).down("FR", over=0.3).hold(0.3)
    line = line.home(over=0.8)
    return line if side == "right" else line.mirror()


@motion
def curtsy() -> Timeline:
    """Curtsy: one paw back, knees bent, head down, thank you."""
    return (
        Timeline()
        .foot("FR", x=-0.05, z=0.06, over=0.7)
        .body(pitch=deg(10.0), roll=deg(-4.0), z=-0.05, over=0.8)
        .hold(0.7)
        .body(pitch=0.0, roll=0.0, z=0.0, over=0.8)
        .home(over=0.7)
    )


@motion
def lift_leg(side: Side = "right") -> Timeline:
    """Lift a hind leg to the side, as dogs do, look innocent, put it down."""
    line = (
        Timeline()
        .foot("RR", x=-0.02, y=-0.07, z=0.13, over=0.9)
        .hold(1.2, name="lifted")
        .down("RR", over=0.8)
        .home(over=0.8)
    )
    return line if side == "right" else line.mirror()
