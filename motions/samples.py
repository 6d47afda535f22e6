"""What a plan asks for at many instants, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.reference import LegTask, MotionPlan, TrackedPoint


@dataclass(frozen=True, slots=True)
class PlanSamples:
    """The part of many references that says where the robot shall be.

    Attributes:
        times: (n,) [s].
        p_world: (n, 3) position [m] of the CoM, or of the base.
        is_com: (n,) of which.
        R_world_base: (n, 3, 3) attitude of the trunk.
        q_joints: (n, 12) joint angles [rad] of legs that follow their joints.
        stance: (n, 4) feet that stand.
        raised: (n, 4) legs that follow their joints.
        p_feet: (n, 4, 3) where the other feet are [m].
        normal_force_max: (n, 4) greatest normal force [N] of each foot.
    """

    times: Float[np.ndarray, " n"]
    p_world: Float[np.ndarray, "n 3"]
    is_com: Bool[np.ndarray, " n"]
    R_world_base: Float[np.ndarray, "n 3 3"]
    q_joints: Float[np.ndarray, "n 12"]
    stance: Bool[np.ndarray, "n 4"]
    raised: Bool[np.ndarray, "n 4"]
    p_feet: Float[np.ndarray, "n 4 3"]
    normal_force_max: Float[np.ndarray, "n 4"]

    @staticmethod
    def one_by_one(
        plan: MotionPlan, times: Float[np.ndarray, " n"], p_feet: Float[np.ndarray, "*n 4 3"]
    ) -> PlanSamples:
        """The samples of any plan, by its ``at``; its feet stand at ``p_feet``."""
        references = [plan.at(float(t)) for t in times]
        swings = np.array([[t is LegTask.SWING for t in one.legs] for one in references])
        swung = np.array([one.p_world_feet for one in references])
        return PlanSamples(
            times=times,
            p_world=np.array([one.body.p_world for one in references]),
            is_com=np.array([one.body.point is TrackedPoint.COM for one in references]),
            R_world_base=np.array([one.body.R_world_base for one in references]),
            q_joints=np.array([one.q_joints for one in references]),
            stance=np.array([one.stance for one in references]),
            p_feet=np.where(swings[:, :, None], swung, p_feet),
            raised=np.array([[t is LegTask.JOINTS for t in one.legs] for one in references]),
            normal_force_max=np.array([one.normal_force_max for one in references]),
        )
