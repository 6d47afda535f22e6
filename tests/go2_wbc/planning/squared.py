"""Snapshots of a robot that stands squarely, for the tests of the planner."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from go2_wbc.planning.locomotion import LocomotionConfig
from go2_wbc.robot.rotations import rotation_from_rpy, yaw_rotation
from go2_wbc.robot.state import Snapshot
from tests import engine_helpers as helpers

MODEL = helpers.symmetric_model()
CONFIG = LocomotionConfig()


def resting(time: float = 0.0, yaw: float = 0.0) -> Snapshot:
    """Standing squarely at rest: every foot below its hip, the CoM amid them at its height."""
    q = helpers.standing_q()
    q[3:7] = pin.Quaternion(rotation_from_rpy(0.0, 0.0, yaw)).coeffs()
    snapshot = MODEL.snapshot(helpers.state_of(q, time=time))
    feet = MODEL.p_base_feet_nominal @ yaw_rotation(yaw).T
    feet[:, 2] = MODEL.foot_radius
    com = np.array([*feet[:, :2].mean(axis=0), CONFIG.height_on_feet])
    return snapshot.replaced(p_world_feet=feet, p_world_com=com)


def at(snapshot: Snapshot, time: float) -> Snapshot:
    return snapshot.replaced(state=replace(snapshot.state, time=time))


def moving(snapshot: Snapshot, v_world: np.ndarray) -> Snapshot:
    return snapshot.replaced(v_world_com=v_world)
