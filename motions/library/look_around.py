"""Look around."""

from motions import Timeline, deg, motion


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
