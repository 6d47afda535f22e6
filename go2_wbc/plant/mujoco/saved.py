"""What decides how a simulated robot goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from go2_wbc.plant.mujoco.pushes import Push
from go2_wbc.plant.sensors import ImuSample
from go2_wbc.robot.state import RobotState


@dataclass(frozen=True, slots=True)
class SavedPhysics:
    """Everything that decides how a ``MujocoPlant`` goes on; see ``MujocoPlant.save``."""

    integration: Float[np.ndarray, " n"]
    ticks: int
    pushes: tuple[Push, ...]
    waiting: tuple[Float[np.ndarray, "5 12"], ...]
    tau: Float[np.ndarray, "12"]
    forces: Float[np.ndarray, "6"]
    noise_state: Mapping[str, Any]
    state: RobotState | None
    imu: ImuSample | None
    senses: Mapping[str, Any] | None
