"""Slow integral action on the body's position reference.

A proportional law sags under an unknown payload and stands off by joint friction. The correction
adds the integral of the error to the reference, bounded, so that the measured body settles where it
was asked to be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, slots=True)
class CorrectionConfig:
    """Numbers of the correction.

    Attributes:
        rate: share of the remaining error that is added per second [1/s].
        limit: greatest correction [m] per axis.
        window: errors [m] beyond this are no steady-state errors and do not count.
    """

    rate: float = 2.0
    limit: float = 0.06
    window: float = 0.04


class SteadyStateCorrection:
    """Integrates the body's position error."""

    def __init__(self, config: CorrectionConfig | None = None) -> None:
        """Start without correction."""
        self._config = config or CorrectionConfig()
        self._offset = np.zeros(3)

    def update(self, error: Float[np.ndarray, "3"], dt: float) -> Float[np.ndarray, "3"]:
        """The offset [m] to add to the reference, after ``dt`` seconds of ``error`` [m]."""
        config = self._config
        counted = np.where(np.abs(error) < config.window, error, 0.0)
        self._offset = np.clip(
            self._offset + config.rate * dt * counted, -config.limit, config.limit
        )
        return self._offset
