"""Plants: what a robot or simulator must do, and MuJoCo doing it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from go2_wbc.plant.base import Plant
from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.plant.terrain import Terrain
from go2_wbc.world import World

__all__ = ["MujocoPlant", "Plant", "plant_in_world"]


def plant_in_world(
    world: World,
    *,
    seed: int = 0,
    initial_yaw: float = 0.0,
    initial_joint_noise: float = 0.0,
    terrain: Terrain | None = None,
    mjcf: Path | None = None,
    keyframe: str | None = None,
    visuals: bool = False,
) -> MujocoPlant:
    """A simulated robot in ``world``.

    Args:
        world: what is uncertain in it is drawn.
        seed: of that, and of every other random number of the plant.
        initial_yaw, initial_joint_noise: heading and spread of the joints at the start [rad].
        terrain, mjcf, keyframe, visuals: as of ``MujocoPlant``; a file's joints are as it says.
    """
    own = world.sample(np.random.default_rng(seed))
    return MujocoPlant(
        friction=own.friction,
        payload=own.payload,
        payload_place=own.payload_place,
        mass_scale=own.mass_scale,
        joint_dynamics=None if mjcf else JointDynamics().scaled(own.joint_friction),
        sensors=own.sensors,
        delay=own.delay,
        seed=seed,
        initial_yaw=initial_yaw,
        initial_joint_noise=initial_joint_noise,
        terrain=terrain,
        mjcf=mjcf,
        keyframe=keyframe,
        visuals=visuals,
    )
