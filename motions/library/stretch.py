"""Stretch."""

from motions import Timeline, deg, motion


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
