"""Keys of dynamic blocks: phases for the planner, which take the whole robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import TimelineError
from motions.dynamics.phases import Phase, PhaseProblem
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
    def shift(self) -> Float[np.ndarray, "4 3"]:
        """Where each foot comes to stand [m], in the frame of the feet at the start."""
        return PhaseProblem(self.phases).shift

    def slower(self, factor: float) -> PhaseKey:
        """Gravity does not wait."""
        raise TimelineError(
            f"scale_time({factor:g}) does not work with a dynamic block, whose pace gravity sets; "
            "give its calls other numbers"
        )

    def retimed(self, when: Callable[[float], float]) -> PhaseKey:
        """The same block, started when ``when`` says; it lasts what it lasts."""
        return self.later(when(self.start) - self.start)

    def scaled(self, amplitude: float) -> PhaseKey:
        """Nor do heights scale without times."""
        raise TimelineError(
            f"scale({amplitude:g}) does not work with a dynamic block, whose heights and times go "
            "together; give its calls other numbers"
        )

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
