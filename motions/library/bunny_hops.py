"""Bunny hops."""

from motions import Timeline, motion


@motion
def bunny_hops() -> Timeline:
    """Bunny hops: three little jumps ahead, one after the other."""
    hop = Timeline().jump(x=0.15, height=0.04)
    return hop.repeat(3).hold(0.3)
