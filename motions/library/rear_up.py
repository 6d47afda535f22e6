"""Rear up."""

from motions import Timeline, deg, motion


@motion
def rear_up() -> Timeline:
    """Rear up: balance on the hind feet for a moment, the front feet in the air."""
    return Timeline().rear(deg(-25)).hold(0.3)
