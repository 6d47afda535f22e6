"""Bow and turn."""

from motions import Timeline, deg, motion
from motions.library.bow import bow


@motion
def bow_and_turn() -> Timeline:
    """Bow and turn: a bow to the front, about turn, and a bow to those behind."""
    return bow().then(Timeline().turn(deg(180.0), gait="trot"), bow())
