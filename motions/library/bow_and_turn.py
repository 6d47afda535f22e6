"""Bow and turn."""

from __future__ import annotations

from motions.authoring import motion
from motions.library.bow import bow
from motions.timeline import Timeline, deg


@motion
def bow_and_turn() -> Timeline:
    """Bow and turn: a bow to the front, about turn, and a bow to those behind."""
    return bow().then(Timeline().turn(deg(180.0), gait="trot"), bow())
