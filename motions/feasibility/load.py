"""The robot with its load: heavier than the one that motions are compiled for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions.placement import centres_of_mass
from motions.trajectory import Trajectory


def loaded(model: RobotModel, world: World) -> RobotModel:
    """``model`` with the masses of ``world``; the same one if there is nothing to change."""
    if world.payload == 0.0 and world.mass_scale == 1.0:
        return model
    heavy = RobotModel(
        model.description,
        armature=np.array(model.pin_model.armature[6:]),
        foot_radius=model.foot_radius,
        world=world,
    )
    heavy.motor, heavy.torque_limits = model.motor, model.torque_limits
    return heavy


def with_load(motion: Trajectory, heavy: RobotModel) -> Trajectory:
    """The same movement with the CoM that the load gives it."""
    poses = np.hstack([motion.q[:, :3], motion.rpy])
    return replace(motion, p_com=centres_of_mass(poses, motion.q[:, 7:], heavy))
