"""Tasks: what the QP should achieve as well as it can.

A task is an immutable description. ``rows(snapshot, reference)`` is a pure function that gives
A z = b, where b is the desired acceleration by the usual law
a_des + kd (v_des - v) + kp (p_des - p) (Del Prete et al. 2015, eq. 5) less the velocity-dependent
drift.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.legs import LEGS
from go2_wbc.reference import LegTask, Reference, TrackedPoint
from go2_wbc.robot.rotations import cross, log_rotation
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_between
from go2_wbc.wbc.loads import planned_loads
from go2_wbc.wbc.problem import FORCES, SIZE, Rows

GREATEST_GAIN = 1e6
"""(2 / dt)^2 [1/s^2] at 500 ticks a second: a loop with more than that swings itself up."""
_EYE = np.eye(3)


@dataclass(frozen=True, slots=True)
class Gains:
    """Proportional [1/s^2] and derivative [1/s] gain of a task, per axis."""

    kp: tuple[float, float, float]
    kd: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Raise ConfigError for a gain that is negative or above ``GREATEST_GAIN``."""
        require_between(self, 0.0, GREATEST_GAIN, "kp", "kd")

    @staticmethod
    def uniform(kp: float, kd: float) -> Gains:
        """The same gain on three axes."""
        return Gains((kp, kp, kp), (kd, kd, kd))

    @property
    def arrays(self) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """kp and kd as arrays."""
        return np.array(self.kp), np.array(self.kd)


class Task(ABC):
    """One soft goal with a weight."""

    name: str
    unit: str
    weight: float

    @abstractmethod
    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Rows A z = b of this task now; may be empty."""

    def weight_at(self, reference: Reference) -> float:
        """The weight of these rows; ``weight``, but for a reference that says otherwise."""
        return self.weight


@dataclass(frozen=True, slots=True)
class BodyPosition(Task):
    """Move the CoM or the base along the reference, in the world frame."""

    kp: Float[np.ndarray, "3"]
    kd: Float[np.ndarray, "3"]
    weight: float = 1.0
    name: str = "body position"
    unit: str = "m/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows: the linear acceleration of the tracked point in the world."""
        target = reference.body
        A = np.zeros((3, SIZE))
        if target.point is TrackedPoint.COM:
            p, v, drift = snapshot.p_world_com, snapshot.v_world_com, snapshot.drift_com
            A[:, :18] = snapshot.J_com
        else:
            R, velocity = snapshot.R_world_base, snapshot.state.v
            p, v = snapshot.state.p_world_base, R @ velocity[:3]
            drift = R @ cross(velocity[3:6], velocity[:3])
            A[:, :3] = R
        desired = target.a_world + self.kd * (target.v_world - v) + self.kp * (target.p_world - p)
        return Rows(A, desired - drift)


@dataclass(frozen=True, slots=True)
class BodyOrientation(Task):
    """Turn the base along the reference; the error is log(R^T R_des) in the base frame.

    While no foot stands, only the legs turn the base, by swinging the other way: ``flight_weight``
    is the most that it weighs then. The reference may divide the weight.
    """

    kp: Float[np.ndarray, "3"]
    kd: Float[np.ndarray, "3"]
    weight: float = 10.0
    flight_weight: float = 0.05
    name: str = "body orientation"
    unit: str = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows: the angular acceleration in the base frame."""
        target = reference.body
        R = snapshot.R_world_base
        A = np.zeros((3, SIZE))
        A[0, 3] = A[1, 4] = A[2, 5] = 1.0
        error = log_rotation(R.T @ target.R_world_base)
        rate_error = R.T @ target.w_world - snapshot.state.v[3:6]
        return Rows(A, R.T @ target.dw_world + self.kd * rate_error + self.kp * error)

    def weight_at(self, reference: Reference) -> float:
        """``weight`` less the reference's discount, and in flight at most ``flight_weight``."""
        weight = self.weight / (1.0 + reference.orientation_discount)
        return weight if reference.stance.any() else min(weight, self.flight_weight)


@dataclass(frozen=True, slots=True)
class SwingFoot(Task):
    """Move the foot centres of the swing legs along the reference, in the world frame."""

    kp: Float[np.ndarray, "3"]
    kd: Float[np.ndarray, "3"]
    weight: float = 1.0
    name: str = "swing feet"
    unit: str = "m/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per swing leg: the linear acceleration of the foot centre."""
        swing = [leg for leg in LEGS if reference.legs[leg] is LegTask.SWING]
        A = np.zeros((3 * len(swing), SIZE))
        A[:, :18] = snapshot.J_feet[swing].reshape(-1, 18)
        desired = (
            reference.a_world_feet[swing]
            + self.kd * (reference.v_world_feet[swing] - snapshot.v_world_feet[swing])
            + self.kp * (reference.p_world_feet[swing] - snapshot.p_world_feet[swing])
        )
        return Rows(A, (desired - snapshot.drift_feet[swing]).ravel())


@dataclass(frozen=True, slots=True)
class LegPosture(Task):
    """Move the joints of raised legs along the reference; free of leg singularities."""

    kp: Float[np.ndarray, "3"]
    kd: Float[np.ndarray, "3"]
    weight: float = 1.0
    name: str = "leg posture"
    unit: str = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per joint-space leg: its joint accelerations."""
        legs = [leg for leg in LEGS if reference.legs[leg] is LegTask.JOINTS]
        A = np.zeros((3 * len(legs), SIZE))
        b = np.empty(3 * len(legs))
        for i, leg in enumerate(legs):
            columns, rows = leg.joints, slice(3 * i, 3 * i + 3)
            A[rows, leg.velocities] = _EYE
            position_error = reference.q_joints[columns] - snapshot.state.q[7:][columns]
            velocity_error = reference.v_joints[columns] - snapshot.state.v[6:][columns]
            b[rows] = (
                reference.a_joints[columns] + self.kd * velocity_error + self.kp * position_error
            )
        return Rows(A, b)


@dataclass(frozen=True, slots=True)
class ForceRegularisation(Task):
    """Keep the contact forces near those of the reference, so that the optimum is unique.

    A reference without forces means an even share of the weight: around zero, a weight of 1e-3
    already sags the body. Along the ground none is wanted of a foot, the less the less it bears:
    with weights in inverse proportion to the loads (``loads.planned_loads``), feet that push the
    trunk aside do so in proportion to them, and all use the same part of their friction.
    """

    weight_of_robot: float
    weight: float = 1e-4
    name: str = "force regularisation"
    unit: str = "N"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per stance foot: its force, against weight / number of stance feet.

        Rows along the ground come times the root of the mean load over that of their foot.
        """
        stance = np.flatnonzero(reference.stance)
        A, scale = np.zeros((3 * len(stance), SIZE)), np.ones((len(stance), 3))
        if len(stance) and not reference.force_weight:
            loads = planned_loads(snapshot, reference, self.weight_of_robot)
            scale[:, :2] = 1.0 / np.sqrt(loads)[:, None]
        for i, leg in enumerate(stance):
            start = FORCES.start + 3 * leg
            A[3 * i : 3 * i + 3, start : start + 3] = np.diag(scale[i])
        weight = self.weight_of_robot + float(snapshot.payload[1])
        b = forces_near(reference, weight)[stance].ravel()
        return Rows(A, b)

    def weight_at(self, reference: Reference) -> float:
        """The reference's own weight, if it has one."""
        return reference.force_weight or self.weight


def forces_near(reference: Reference, weight_of_robot: float) -> Float[np.ndarray, "4 3"]:
    """Forces [N] near which those of the stance feet are kept."""
    if reference.force_weight:
        return reference.f_world_feet
    forces = np.zeros((4, 3))
    forces[:, 2] = weight_of_robot / max(int(reference.stance.sum()), 1)
    return forces
