"""Tasks: what the QP should achieve as well as it can.

A task is an immutable description. ``rows(snapshot, reference)`` is a pure function that gives
A z = b, where b is the desired acceleration by the usual law
a_des + kd (v_des - v) + kp (p_des - p) (Del Prete et al. 2015, eq. 5) less the velocity-dependent
drift.

The rows of a built-in task are filled by one compiled function, which ``rows`` calls and the
compiled solve (``condensed``) as well. They are rows of the accelerations of the base, a_b, and of
three unknowns u of each leg: see ``TaskRows``. The joints of a standing leg are in none of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.vectors import rotation_vector
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.records import V3, Array3, Array18, Record, packed
from go2_wbc.reference import JOINTS, STANCE, SWING, Reference, Target
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_between
from go2_wbc.wbc.loads import plan_loads
from go2_wbc.wbc.problem import SIZE, Rows

GREATEST_GAIN = 1e6
"""(2 / dt)^2 [1/s^2] at 500 ticks a second: a loop with more than that swings itself up."""
LARGEST_ERROR = 3.0
"""Orientation error [rad] beyond which its sine says little about it."""
NO_ROTATION = 0.01
"""How far sine^2 + cosine^2 of a matrix's angle may be from 1, which they are for a rotation."""
UNKNOWNS = 12
"""Three for each leg: the force of a foot that stands, else the accelerations of its joints."""
TASK_ROWS = 18
"""Of all built-in tasks: three each for the trunk's place, its attitude, and for every leg."""
LEG_ROWS = 6
"""The first row of the first leg."""


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
    def arrays(self) -> tuple[Array3, Array3]:
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


class TaskRows(Record):
    """Rows A (a_b, u) = b of the built-in tasks, every one in its place.

    The first three are of the trunk's place, then three of its attitude, then three of each leg,
    by what the leg does. Those of a leg have 0 in the columns of the others.

    Attributes:
        A: columns: the base's acceleration (6), and three unknowns of each leg (12).
        b: right sides.
        weight: of each row.
    """

    A: Float[np.ndarray, "18 18"]
    b: Array18
    weight: Array18

    def of_decision(self, which: list[int], reference: Reference) -> Rows:
        """Some of the rows, as rows of the decision z."""
        A = np.zeros((len(which), SIZE))
        A[:, :6] = self.A[which, :6]
        columns = np.arange(6, 18) + UNKNOWNS * np.repeat(reference.stance, 3)
        A[:, columns] = self.A[which, 6:]
        return Rows(A, self.b[which])


def rows_of_legs(reference: Reference, kind: int) -> list[int]:
    """The places of the rows of all legs that do this."""
    legs = [leg for leg in range(4) if reference.legs[leg] == kind]
    return [LEG_ROWS + 3 * leg + i for leg in legs for i in range(3)]


@dataclass(frozen=True, slots=True)
class BodyPosition(Task):
    """Move the CoM or the base along the reference, in the world frame.

    Attributes:
        kp, kd: gains per axis of the world.
        weight_of_robot: [N] without what it carries.
        weight: of the task.
    """

    kp: Array3
    kd: Array3
    weight_of_robot: float
    weight: float = 1.0
    name = "body position"
    unit = "m/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows: the linear acceleration of the tracked point in the world."""
        rows = TaskRows()
        fill_body_position(snapshot, Target.of(reference.row), packed(self), rows)
        return rows.of_decision([0, 1, 2], reference)


@kernel
def fill_body_position(now: Snapshot, target: Target, task: BodyPosition, rows: TaskRows) -> None:
    """The acceleration of the CoM, or of the base.

    That of the CoM needs no Jacobian: it is the sum of the contact forces, by the mass, and
    gravity, which is what the base's first rows of M a + h = J'f say.
    """
    R, v = now.R_world_base, now.v
    x = v[4] * v[2] - v[5] * v[1]
    y = v[5] * v[0] - v[3] * v[2]
    z = v[3] * v[1] - v[4] * v[0]
    mass = now.mass_matrix[0, 0]
    for i in range(3):
        rows.A[i, :] = 0.0
        if target.is_com:
            position, velocity, rest = now.p_world_com[i], now.v_world_com[i], 0.0
            if i == 2:
                rest = -(task.weight_of_robot + now.payload[1]) / mass
            for leg in range(4):
                if target.legs[leg] == STANCE:
                    rows.A[i, 6 + 3 * leg + i] = 1.0 / mass
        else:
            position = now.q[i]
            velocity = R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2]
            rest = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z
            for n in range(3):
                rows.A[i, n] = R[i, n]
        desired = target.a_world[i] + task.kd[i] * (target.v_world[i] - velocity)
        desired += task.kp[i] * (target.p_world[i] - position)
        rows.b[i], rows.weight[i] = desired - rest, task.weight


@dataclass(frozen=True, slots=True)
class BodyOrientation(Task):
    """Turn the base along the reference; the error is log(R^T R_des) in the base frame.

    While no foot stands, only the legs turn the base, by swinging the other way: ``flight_weight``
    is the most that it weighs then. The reference may divide the weight.
    """

    kp: Array3
    kd: Array3
    weight: float = 10.0
    flight_weight: float = 0.05
    name = "body orientation"
    unit = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows: the angular acceleration in the base frame."""
        rows = TaskRows()
        fill_body_orientation(snapshot, Target.of(reference.row), packed(self), rows)
        return rows.of_decision([3, 4, 5], reference)

    def weight_at(self, reference: Reference) -> float:
        """``weight`` less the reference's discount, and in flight at most ``flight_weight``."""
        return float(orientation_weight(Target.of(reference.row), self))


@subroutine
def orientation_weight(target: Target, task: BodyOrientation) -> float:
    """See ``BodyOrientation``."""
    weight = task.weight / (1.0 + target.orientation_discount)
    for leg in range(4):
        if target.legs[leg] == STANCE:
            return weight
    return min(weight, task.flight_weight)


@subroutine
def orientation_error(now: Snapshot, target: Target) -> V3:
    """log(R' R_des); not a number where that is no rotation by about pi but none at all."""
    R, R_des, E = now.R_world_base, target.R_world_base, np.empty((3, 3))
    for i in range(3):
        for k in range(3):
            E[i, k] = R[0, i] * R_des[0, k] + R[1, i] * R_des[1, k] + R[2, i] * R_des[2, k]
    x, y, z = (E[2, 1] - E[1, 2]) / 2, (E[0, 2] - E[2, 0]) / 2, (E[1, 0] - E[0, 1]) / 2
    sine, cosine = np.sqrt(x**2 + y**2 + z**2), (E[0, 0] + E[1, 1] + E[2, 2] - 1) / 2
    angle = np.arctan2(sine, cosine)
    if not angle < LARGEST_ERROR:
        if not abs(sine**2 + cosine**2 - 1.0) < NO_ROTATION:
            return np.nan, np.nan, np.nan
        return rotation_vector(E)
    # x / sin x = 1 + x^2 / 6 + ...
    factor = angle / sine if sine > 1e-6 else 1.0 + angle * angle / 6
    return x * factor, y * factor, z * factor


@kernel
def fill_body_orientation(
    now: Snapshot, target: Target, task: BodyOrientation, rows: TaskRows
) -> None:
    """The angular acceleration of the base."""
    R, v, error = now.R_world_base, now.v, orientation_error(now, target)
    weight = orientation_weight(target, task)
    for i in range(3):
        rate, desired = -v[3 + i], 0.0
        for n in range(3):
            rate += R[n, i] * target.w_world[n]
            desired += R[n, i] * target.dw_world[n]
        desired += task.kd[i] * rate + task.kp[i] * error[i]
        rows.A[3 + i, :] = 0.0
        rows.A[3 + i, 3 + i] = 1.0
        rows.b[3 + i], rows.weight[3 + i] = desired, weight


@dataclass(frozen=True, slots=True)
class SwingFoot(Task):
    """Move the foot centres of the swing legs along the reference, in the world frame."""

    kp: Array3
    kd: Array3
    weight: float = 1.0
    name = "swing feet"
    unit = "m/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per swing leg: the linear acceleration of the foot centre."""
        rows = TaskRows()
        fill_swing_feet(snapshot, Target.of(reference.row), packed(self), rows)
        return rows.of_decision(rows_of_legs(reference, SWING), reference)


@kernel
def fill_swing_feet(now: Snapshot, target: Target, task: SwingFoot, rows: TaskRows) -> None:
    """The accelerations of the feet of all swing legs."""
    for leg in range(4):
        if target.legs[leg] != SWING:
            continue
        p, v = now.p_world_feet[leg], now.v_world_feet[leg]
        for i in range(3):
            n = LEG_ROWS + 3 * leg + i
            J = now.J_feet[leg, i]
            for k in range(6):
                rows.A[n, k] = J[k]
            for k in range(6 + 3 * leg, 9 + 3 * leg):
                rows.A[n, k] = J[k]
            desired = target.a_world_feet[leg, i] - now.drift_feet[leg, i]
            desired += task.kd[i] * (target.v_world_feet[leg, i] - v[i])
            desired += task.kp[i] * (target.p_world_feet[leg, i] - p[i])
            rows.b[n], rows.weight[n] = desired, task.weight


@dataclass(frozen=True, slots=True)
class LegPosture(Task):
    """Move the joints of raised legs along the reference; free of leg singularities."""

    kp: Array3
    kd: Array3
    weight: float = 1.0
    name = "leg posture"
    unit = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per joint-space leg: its joint accelerations."""
        rows = TaskRows()
        fill_leg_posture(snapshot, Target.of(reference.row), packed(self), rows)
        return rows.of_decision(rows_of_legs(reference, JOINTS), reference)


@kernel
def fill_leg_posture(now: Snapshot, target: Target, task: LegPosture, rows: TaskRows) -> None:
    """The accelerations of the joints of all legs that follow joint angles."""
    for leg in range(4):
        if target.legs[leg] != JOINTS:
            continue
        for i in range(3):
            n = 3 * leg + i
            desired = target.a_joints[n]
            desired += task.kd[i] * (target.v_joints[n] - now.v[6 + n])
            desired += task.kp[i] * (target.q_joints[n] - now.q[7 + n])
            ask_unknown(rows, n, desired, task.weight)


@dataclass(frozen=True, slots=True)
class ForceRegularisation(Task):
    """Keep the contact forces near those of the reference, so that the optimum is unique.

    A reference without forces means an even share of the weight: around zero, a weight of 1e-3
    already sags the body. Along the ground none is wanted of a foot, the less the less it bears:
    with weights in inverse proportion to the loads (``loads``), feet that push the trunk aside do
    so in proportion to them, and all use the same part of their friction.
    """

    weight_of_robot: float
    weight: float = 1e-4
    name = "force regularisation"
    unit = "N"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per stance foot: its force, against weight / number of stance feet.

        Rows along the ground come times the root of the mean load over that of their foot.
        """
        rows = TaskRows()
        fill_forces(snapshot, Target.of(reference.row), packed(self), rows)
        which = rows_of_legs(reference, STANCE)
        A, b = rows.of_decision(which, reference)
        scale = np.sqrt(rows.weight[which] / self.weight_at(reference))
        return Rows(scale[:, None] * A, scale * b)

    def weight_at(self, reference: Reference) -> float:
        """The reference's own weight, if it has one."""
        return reference.force_weight or self.weight


@kernel
def fill_forces(now: Snapshot, target: Target, task: ForceRegularisation, rows: TaskRows) -> None:
    """The forces of all feet that stand."""
    loads = np.ones(4)
    if not target.force_weight > 0.0:
        plan_loads(now, target, task.weight_of_robot, loads)
    feet, weight = 0, task.weight_of_robot + now.payload[1]
    for leg in range(4):
        feet += int(target.legs[leg] == STANCE)
    for leg in range(4):
        if target.legs[leg] != STANCE:
            continue
        for i in range(3):
            n = 3 * leg + i
            if target.force_weight > 0.0:
                ask_unknown(rows, n, target.f_world_feet[leg, i], target.force_weight)
            elif i == 2:
                ask_unknown(rows, n, weight / feet, task.weight)
            else:
                ask_unknown(rows, n, 0.0, task.weight / loads[leg])


@subroutine
def ask_unknown(rows: TaskRows, n: int, b: float, weight: float) -> None:
    """The row of an unknown that is wanted itself."""
    row, leg = LEG_ROWS + n, n // 3
    for k in range(6):
        rows.A[row, k] = 0.0
    for i in range(3):
        rows.A[row, 6 + 3 * leg + i] = 0.0
    rows.A[row, 6 + n] = 1.0
    rows.b[row], rows.weight[row] = b, weight
