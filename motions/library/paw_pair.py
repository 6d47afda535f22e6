"""Paw pair."""

from motions import Timeline, motion


@motion
def paw_pair() -> Timeline:
    """Paw pair: lift a front paw and the hind paw across, then the other two."""
    pair = Timeline().lift(("FL", "RR"), hold=0.35).hold(0.3)
    return pair.then(pair.mirror())
