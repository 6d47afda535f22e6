"""Standing at rest, on feet wherever they are: where dynamic motions start and end."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import RobotState
from motions.dynamics.phases import FullState
from motions.placement import Wanted, configurations, place
from motions.postures import STAND_POSE

SETTLING_STEPS = 10
"""Steps that put the CoM in its place, as those of the authored motions' standing pose."""


def standing_feet(model: RobotModel) -> Float[np.ndarray, "4 3"]:
    """Where the feet's centres stand [m]: below the hips, a foot's radius above the ground."""
    p_feet = model.p_base_feet_nominal.copy()
    p_feet[:, 2] = model.foot_radius
    return p_feet


def standing(model: RobotModel, p_feet: Float[np.ndarray, "4 3"]) -> FullState:
    """Standing at rest on feet at ``p_feet`` [m]: CoM above their middle, trunk along them."""
    anchor = Anchor.of_feet(p_feet, model.foot_radius)
    wanted = Wanted(
        p=(anchor.p_world + STAND_POSE[:3])[None],
        is_com=np.ones(1, dtype=bool),
        R=yaw_rotation(anchor.yaw)[None],
        q_joints=np.zeros((1, 12)),
        raised=np.zeros((1, 4), dtype=bool),
        p_feet=p_feet[None],
    )
    placed = place(wanted, SETTLING_STEPS, model)
    pose = np.concatenate([placed.p_base[0], [0.0, 0.0, anchor.yaw]])
    return FullState(configurations(pose[None], placed.q_joints)[0], np.zeros(18))


def standing_torques(
    model: RobotModel, state: FullState, stance: Bool[np.ndarray, "4"]
) -> Float[np.ndarray, "12"]:
    """Joint torques [N m] that hold the robot on ``stance`` feet, with the least foot forces."""
    zeros = np.zeros(4)
    measured = RobotState(0.0, state.q, state.v, np.zeros(12), zeros, zeros.astype(bool))
    snapshot = model.pinocchio_snapshot(measured)
    J = snapshot.J_feet[stance].reshape(-1, 18)
    forces = np.linalg.lstsq(J[:, :6].T, snapshot.bias[:6], rcond=None)[0]
    return snapshot.bias[6:] - J[:, 6:].T @ forces
