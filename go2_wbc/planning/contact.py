"""Which feet of a gait stand: those that shall, and those that have found a step before they do.

A foot that meets something above the ground, late in its swing, stands from then on. If it went on
towards its place it would push against the step. On ground as expected it stands when it is planned
to, so that a trot on the level is as exact as its clock.

A foot that is late stands too, from when it is planned to. Its leg carries its share of the force,
which puts it down within milliseconds. To let it swing down instead until it is met, at 0.4 to
1.5 m/s, made the trot fall in 4 of 6 runs over boxes of 12 cm and up stairs of 10 cm, which it
walked in 6 and 5 without (own simulation).

``kernels.contact`` is the compiled form; ``landing`` does the like for motions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import TIE, ContactPhase
from go2_wbc.legs import LEGS
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_positive, require_share


@dataclass(frozen=True, slots=True)
class ContactConfig:
    """When contacts count, from a search on this robot in simulation.

    Attributes:
        earliest: share of the swing from which on a contact may be a landing.
        step: height [m] above the ground from which on it is one.
    """

    earliest: float = 0.7
    step: float = 0.015

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        require_share(self, "earliest")
        require_positive(self, "step")


class FootContacts:
    """Follows the four feet.

    Attributes:
        stance: feet that stand.
    """

    def __init__(self, config: ContactConfig) -> None:
        """All feet stand."""
        self._config = config
        self.stance, self._is_early = np.ones(4, dtype=bool), np.zeros(4, dtype=bool)
        self._since = np.full(4, np.inf)

    def update(
        self, snapshot: Snapshot, phase: ContactPhase, above: Float[np.ndarray, "4"], dt: float
    ) -> None:
        """Bring the feet to this tick, ``dt`` seconds after the last.

        Args:
            snapshot: of this tick.
            phase: what is planned.
            above: height [m] of the feet above the ground as it is known.
            dt: [s].
        """
        config = self._config
        meets_step = snapshot.state.feet_in_contact & (above > config.step)
        is_late = phase.progress >= config.earliest - TIE
        for leg in LEGS:
            if phase.stance[leg]:
                self._is_early[leg] = False
                continue
            if not self._is_early[leg]:
                self._is_early[leg] = meets_step[leg] and is_late[leg]
                self._since[leg] = 0.0 if self._is_early[leg] else np.inf
        self.stance = phase.stance | self._is_early
        self._since = self._since + dt

    def load_share(self, phase: ContactPhase, ramp: float) -> Float[np.ndarray, "4"]:
        """As ``ContactPhase.load_share``, from when each foot came down."""
        begun = np.where(np.isfinite(self._since), self._since, phase.elapsed)
        nearest = np.where(phase.stance, np.minimum(begun, phase.remaining), begun)
        return np.where(self.stance, np.clip(nearest / max(ramp, TIE), 0.0, 1.0), 0.0)
