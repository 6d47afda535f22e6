"""The simulated robot in a ``World``."""

from __future__ import annotations

from dataclasses import replace

from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.world import World


def plant_in(
    world: World,
    *,
    seed: int = 0,
    initial_yaw: float = 0.0,
    initial_joint_noise: float = 0.0,
    visuals: bool = False,
) -> MujocoPlant:
    """The plant that simulates the middle of what ``world`` states; see ``World.sample``.

    Args:
        world: friction, load, joints, delay, sensors.
        seed, initial_yaw, initial_joint_noise, visuals: as for ``MujocoPlant``.

    Raises:
        ConfigError: for a delay that is no multiple of the control period, 2 ms.
    """
    usual, factor = JointDynamics(), world.joint_friction
    hip, thigh, calf = usual.damping
    dry_hip, dry_thigh, dry_calf = usual.friction_loss
    joints = replace(
        usual,
        damping=(factor * hip, factor * thigh, factor * calf),
        friction_loss=(factor * dry_hip, factor * dry_thigh, factor * dry_calf),
    )
    return MujocoPlant(
        friction=world.friction,
        payload=world.payload,
        payload_place=world.payload_place,
        mass_scale=world.mass_scale,
        joint_dynamics=joints,
        delay=world.delay,
        sensors=world.sensors,
        seed=seed,
        initial_yaw=initial_yaw,
        initial_joint_noise=initial_joint_noise,
        visuals=visuals,
    )
