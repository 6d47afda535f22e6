"""Safety: says whether the measured state still allows the controller to go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from go2_wbc.robot.state import RobotState
from go2_wbc.validation import require_positive


@dataclass(frozen=True, slots=True)
class SafetyConfig:
    """When to give up and go limp.

    Attributes:
        tilt_limit: tilt [rad] of the trunk beyond which a balancing robot counts as fallen.
        height_limit: height [m] of the base over the centre of the lowest foot below which a
            balancing robot counts as collapsed; on its belly it is 0.063.
        stale_limit: time [s] without news from the plant after which it counts as silent.
        qp_patience: QP failures in a row after which the robot is damped for good.
    """

    tilt_limit: float = 1.05
    height_limit: float = 0.075
    stale_limit: float = 0.03
    qp_patience: int = 10

    def __post_init__(self) -> None:
        """Raise ConfigError for a limit that is not positive."""
        require_positive(self, "tilt_limit", "height_limit", "stale_limit", "qp_patience")


def fall_reason(
    state: RobotState, lowest_foot: float, config: SafetyConfig, *, may_lie: bool = False
) -> str | None:
    """Why the state counts as a fall, or None.

    Args:
        state: measured.
        lowest_foot: height [m] of the lowest foot in the world.
        config: limits.
        may_lie: whether the belly may be on the ground.
    """
    if not (np.isfinite(state.q).all() and np.isfinite(state.v).all()):
        return f"state is not finite at t={state.time:.2f} s"
    roll, pitch, _ = (round(angle) for angle in np.degrees(state.rpy).tolist())
    if state.tilt > config.tilt_limit:
        return f"fell at t={state.time:.2f} s: roll {roll} deg, pitch {pitch} deg"
    height = float(state.q[2]) - lowest_foot
    if height < config.height_limit and not may_lie:
        return f"fell at t={state.time:.2f} s: base {100 * height:.0f} cm above the feet"
    return None
