"""Jump up."""

from motions import Timeline, motion


@motion
def jump_up() -> Timeline:
    """Jump up: crouch, and jump so that the feet are 0.15 m over the ground."""
    return Timeline().jump(height=0.15).hold(0.3)
