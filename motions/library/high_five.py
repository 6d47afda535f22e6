"""High five."""

from typing import Annotated

from go2_wbc.robot.model import FOOT_RADIUS
from motions import Choice, Range, Timeline, deg, motion

HEIGHT = 0.64
"""Height [m] above the ground at which the paw's centre is held by default."""
FOLDED = (-0.10, -0.30, -2.0)
"""Hip, thigh and calf angle [rad] of a raised right leg on its way up: the knee goes first."""


@motion
def high_five(
    side: Annotated[str, Choice("left", "right")] = "right",
    height: Annotated[float, Range(0.45, 0.66, "m")] = HEIGHT,
    hold: Annotated[float, Range(0.5, 30.0, "s")] = 2.0,
) -> Timeline:
    """High five: three feet on the ground, a paw up, two taps, and back.

    The numbers come from a search over trunk attitude, height and paw position for large margins at
    once: CoM to the edges of the support triangle, load of the lightest foot, torque, and distance
    of every joint to its limits.
    """
    up = height - FOOT_RADIUS
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
        .foot("FR", x=0.177, y=0.082, z=up, over=0.6)
        .also()
        .body(roll=deg(-4.0), pitch=deg(-17.2), yaw=deg(-2.9), z=0.026, over=0.6)
        .hold(hold, name="held", foot="FR")
    )
    for _ in range(2):
        right = right.foot("FR", x=0.211, y=0.082, z=up - 0.026, over=0.35)
        right = right.foot("FR", x=0.177, y=0.082, z=up, over=0.35)
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
