"""Sleepy."""

from __future__ import annotations

from motions.authoring import motion
from motions.timeline import Timeline, deg


def drowsily(s: float) -> float:
    """Hardly at first, then faster and faster, and soft at the end."""
    return s**4 * (15.0 - 24.0 * s + 10.0 * s * s)


@motion
def sleepy() -> Timeline:
    """Sleepy: the head sinks, catches itself, sinks again; then wide awake."""
    return (
        Timeline()
        .body(pitch=deg(12.0), z=-0.05, over=2.5, ease=drowsily)
        .body(pitch=deg(2.0), z=-0.02, over=0.5)
        .body(pitch=deg(15.0), z=-0.08, over=2.5, ease=drowsily)
        .hold(0.8)
        .body(pitch=deg(-10.0), z=0.01, over=0.6)
        .hold(0.5)
        .home(over=0.6)
    )
