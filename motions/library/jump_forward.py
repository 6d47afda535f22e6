"""Jump forward."""

from motions import Timeline, motion


@motion
def jump_forward() -> Timeline:
    """Jump forward: half a metre with all four feet."""
    return Timeline().jump(x=0.5, height=0.1).hold(0.3)
