"""Swing foot curves: from lift-off over an apex to a touchdown that may still move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Ease
from go2_wbc.validation import require_not_negative, require_positive


@dataclass(frozen=True, slots=True)
class SwingConfig:
    """Shape of a swing.

    Attributes:
        apex: height [m] of the foot above the higher of lift-off and touchdown.
        touchdown_depth: distance [m] below the ground at which touchdown is aimed, so that the
            foot arrives with certainty.
    """

    apex: float = 0.06
    touchdown_depth: float = 0.008

    def __post_init__(self) -> None:
        """Raise ConfigError for a length that is out of range."""
        require_positive(self, "apex")
        require_not_negative(self, "touchdown_depth")


def swing_foot(
    start: Float[np.ndarray, "3"],
    goal: Float[np.ndarray, "3"],
    progress: float,
    duration: float,
    config: SwingConfig,
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Position, velocity, acceleration of the foot centre in the world.

    Horizontally a cubic (it follows late changes of the goal better than minimum jerk), vertically
    two cubics that meet at the apex.

    Args:
        start: where the foot left the ground [m].
        goal: where it shall touch down [m]; may change from call to call.
        progress: share of the swing that has passed, 0 to 1.
        duration: of the whole swing [s].
        config: apex and touchdown depth.
    """
    p, v, a = np.empty(3), np.empty(3), np.empty(3)
    s, ds, dds = Ease.CUBIC.progress(progress)
    delta = goal[:2] - start[:2]
    p[:2] = start[:2] + s * delta
    v[:2] = ds / duration * delta
    a[:2] = dds / duration**2 * delta
    apex = max(start[2], goal[2]) + config.apex
    low, high = (start[2], apex) if progress < 0.5 else (apex, goal[2] - config.touchdown_depth)
    half = 2.0 * progress if progress < 0.5 else 2.0 * progress - 1.0
    s, ds, dds = Ease.CUBIC.progress(half)
    p[2] = low + s * (high - low)
    v[2] = ds * (high - low) * 2.0 / duration
    a[2] = dds * (high - low) * 4.0 / duration**2
    return p, v, a
