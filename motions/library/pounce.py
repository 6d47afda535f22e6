"""Pounce."""

from motions import Timeline, deg, motion


@motion
def pounce() -> Timeline:
    """Pounce: crouch, wiggle, and leap at the prey."""
    low = Timeline().body(z=-0.06, pitch=deg(8), over=0.7)
    for side in (0.025, -0.025, 0.025, 0.0):
        low = low.body(y=side, over=0.4)
    return low.home(over=0.5).pounce(0.3).hold(0.3)
