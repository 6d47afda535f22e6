"""Curtsy."""

from motions import Timeline, deg, motion


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
