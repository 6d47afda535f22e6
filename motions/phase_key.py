"""Keys of dynamic blocks: phases for the planner, which take the whole robot."""

from __future__ import annotations

from dataclasses import dataclass, replace

from motions.dynamics.phases import Phase
from motions.keys import Key


@dataclass(frozen=True, slots=True)
class PhaseKey(Key):
    """The whole robot goes through phases, from standing at home to standing at home.

    Attributes:
        phases: one after the other; together they last from ``start`` to ``end``.
        is_open: whether ``Timeline.phase`` may still add one.
    """

    phases: tuple[Phase, ...]
    is_open: bool

    @property
    def track(self) -> str:
        """The whole robot."""
        return "the whole robot"

    @property
    def mirrored(self) -> PhaseKey:
        """Left and right exchanged."""
        return replace(self, phases=tuple(map(_mirrored, self.phases)))


def _mirrored(phase: Phase) -> Phase:
    body = phase.body
    if body is not None:
        x, y, z, roll, pitch, yaw = body
        body = (x, -y, z, -roll, pitch, -yaw)
    feet = {leg.mirror: (x, -y, z) for leg, (x, y, z) in phase.feet.items()}
    stance = frozenset(leg.mirror for leg in phase.stance)
    return replace(phase, stance=stance, body=body, feet=feet)
