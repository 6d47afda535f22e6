"""What a plan asks for at many instants, placed in the world: to compare it with a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.records import layout_of
from go2_wbc.reference import Anchor, LegTask, Target
from go2_wbc.robot.rotations import yaw_rotation
from motions.batch_kinematics import attitudes


@dataclass(frozen=True, slots=True)
class PlacedPlan:
    """A plan's references at ``m`` instants, as ``plan.at(t).placed(anchor)`` gives each of them.

    Attributes:
        is_com: whether the trunk's position means the CoM.
        p_world_body: position of the tracked point [m].
        R_world_base: orientation of the trunk.
        tasks: what the legs do, values of ``LegTask``.
        p_world_feet: places of the feet [m].
        q_joints: joint angles [rad].
    """

    is_com: Bool[np.ndarray, " m"]
    p_world_body: Float[np.ndarray, "m 3"]
    R_world_base: Float[np.ndarray, "m 3 3"]
    tasks: Float[np.ndarray, "m 4"]
    p_world_feet: Float[np.ndarray, "m 4 3"]
    q_joints: Float[np.ndarray, "m 12"]

    @staticmethod
    def of(plan: MotionPlan, times: Float[np.ndarray, " m"], anchor: Anchor) -> PlacedPlan:
        """The references ``times`` [s] after the start of a motion that began at ``anchor``."""
        R, layout = yaw_rotation(anchor.yaw), layout_of(Target)
        rows = np.empty((len(times), layout.size))
        for k, t in enumerate(times.tolist()):
            rows[k] = plan.row_at(t)
        targets = rows.view(layout.dtype)[:, 0]
        return PlacedPlan(
            is_com=targets["is_com"] != 0.0,
            p_world_body=anchor.p_world + targets["p_world"] @ R.T,
            R_world_base=R @ targets["R_world_base"],
            tasks=targets["legs"].copy(),
            p_world_feet=anchor.p_world + targets["p_world_feet"] @ R.T,
            q_joints=targets["q_joints"].copy(),
        )

    def does(self, task: LegTask) -> Bool[np.ndarray, "m 4"]:
        """Which legs do ``task``."""
        return self.tasks == task

    def trunk_off(self, truth: TruthRecording) -> Float[np.ndarray, " m"]:
        """Distances [m] of the tracked point from its place, in as many instants of a recording."""
        point = np.where(self.is_com[:, None], truth.p_world_com, truth.q[:, :3])
        return np.linalg.norm(point - self.p_world_body, axis=1)

    def turned_off(self, truth: TruthRecording) -> Float[np.ndarray, " m"]:
        """Angles [rad] between the trunk's orientation and the planned one, 0 to pi."""
        turn = self.R_world_base @ attitudes(truth.rpy).transpose(0, 2, 1)
        twice_sine = np.linalg.norm([turn[:, i, j] - turn[:, j, i] for i, j in _PAIRS], axis=0)
        return np.arctan2(twice_sine, turn.trace(axis1=1, axis2=2) - 1.0)


_PAIRS = ((2, 1), (0, 2), (1, 0))
