"""Friction of the ground, from feet that slide.

A foot that carries load and slides has less friction than it was counted on. While one does, the
estimate falls towards the least, and otherwise it recovers, slowly:

    mu' = (mu_least - mu) / T   while a foot slides,    mu' = r   else,    mu <= mu_most

A foot slides if its contact point has been faster than a speed for some time. Just after touchdown
it may: there the foot still comes to rest.

``kernels.slip`` is the compiled form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from go2_wbc.errors import ConfigError
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_not_negative, require_positive


@dataclass(frozen=True, slots=True)
class SlipConfig:
    """Numbers of the estimate, from a search on this robot in simulation.

    Attributes:
        speed: of the contact point, along the ground [m/s], above which a foot slides.
        patience: time [s] for which it must.
        mask: time [s] after touchdown in which it may. At 3 m/s feet that hold slide longer.
        steepness: greatest ratio of its vertical speed to that: a foot that comes off the edge of a
            step says nothing of the friction.
        time_constant: of the fall [s].
        recovery: rate [1/s] of the rise.
        least, most: bounds of the estimate; it begins at the latter.
    """

    speed: float = 0.1
    patience: float = 0.004
    mask: float = 0.02
    steepness: float = 0.35
    time_constant: float = 0.03
    recovery: float = 0.1
    least: float = 0.12
    most: float = 0.6

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        require_positive(self, "speed", "steepness", "time_constant", "least", "most")
        require_not_negative(self, "patience", "mask", "recovery")
        if self.least > self.most:
            raise ConfigError(
                f"SlipConfig.least must be at most .most, got {self.least} and {self.most}"
            )


class SlipObserver:
    """Watches the feet.

    Attributes:
        friction: the estimate.
    """

    def __init__(self, config: SlipConfig) -> None:
        """Nothing has slid yet."""
        self._config = config
        self.friction = config.most
        self._loaded, self._sliding = np.zeros(4), np.zeros(4)

    def update(self, snapshot: Snapshot, stance: Bool[np.ndarray, "4"], dt: float) -> None:
        """Look at the feet that shall stand, ``dt`` seconds after the last look."""
        config = self._config
        speed = np.linalg.norm(snapshot.v_world_contacts[:, :2], axis=1)
        stands = stance & snapshot.state.feet_in_contact
        self._loaded = np.where(stands, self._loaded + dt, 0.0)
        slope = np.abs(snapshot.v_world_contacts[:, 2]) <= config.steepness * speed
        slides = (self._loaded > config.mask) & (speed > config.speed) & slope
        self._sliding = np.where(slides, self._sliding + dt, 0.0)
        if (self._sliding > config.patience).any():
            share = min(dt / config.time_constant, 1.0)
            self.friction += (config.least - self.friction) * share
        else:
            self.friction = min(self.friction + config.recovery * dt, config.most)
