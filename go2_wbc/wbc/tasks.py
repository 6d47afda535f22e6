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
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.linear import cross, rotation_vector, triple, turned, turned_back
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.records import V3, Array18, Record, packed
from go2_wbc.reference import JOINTS, STANCE, SWING, Reference, Target
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import Gains, WbcConfig
from go2_wbc.wbc.problem import SIZE, Rows, Source
from go2_wbc.wbc.trajectory_loads import plan_loads

LARGEST_ERROR = 3.0  #: Orientation error [rad] beyond which its sine says little about it
NO_ROTATION = 0.01
"""How far sine^2 + cosine^2 of a matrix's angle may be from 1, which they are for a rotation."""
UNKNOWNS = 12
"""Three for each leg: the force of a foot that stands, else the accelerations of its joints."""
TASK_ROWS = 18
"""Of all built-in tasks: three each for the trunk's place, its attitude, and for every leg."""
LEG_ROWS = 6  #: The first row of the first leg


class Task(Source, ABC):
    """One soft goal with a weight."""

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
    """

    A: Float[np.ndarray, "18 18"]
    """Columns: the base's acceleration (6), and three unknowns of each leg (12)."""
    b: Array18  #: right side of each row
    weight: Array18  #: of each row

    def of_decision(self, which: list[int], reference: Reference) -> Rows:
        """Some of the rows, as rows of the decision z."""
        A = np.zeros((len(which), SIZE))
        A[:, :6] = self.A[which, :6]
        columns = np.arange(6, 18) + UNKNOWNS * np.repeat(reference.stance, 3)
        A[:, columns] = self.A[which, 6:]
        return Rows(A, self.b[which])


class BuiltIn(Task):
    """A task of ours, whose rows one compiled function fills."""

    fill: Callable[..., None]  #: that function, of snapshot, target, task and rows
    part: range | int  #: which rows it fills, or those of the legs that do this

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Rows A z = b of this task now; ``fill`` says which."""
        return self._filled(snapshot, reference).of_decision(self._places(reference), reference)

    def _filled(self, snapshot: Snapshot, reference: Reference) -> TaskRows:
        rows = TaskRows()
        self.fill(snapshot, Target.of(reference.row), packed(self), rows)
        return rows

    def _places(self, reference: Reference) -> list[int]:
        if isinstance(self.part, range):
            return list(self.part)
        legs = [leg for leg in range(4) if reference.legs[leg] == self.part]
        return [LEG_ROWS + 3 * leg + i for leg in legs for i in range(3)]


@subroutine
def desired(g: Gains, i: int, feed_forward: float, rate_error: float, error: float) -> float:
    """The desired acceleration, by the law that the module gives."""
    return feed_forward + g.kd[i] * rate_error + g.kp[i] * error


@kernel
def fill_body_position(now: Snapshot, target: Target, task: BodyPosition, rows: TaskRows) -> None:
    """The acceleration of the CoM, or of the base.

    That of the CoM needs no Jacobian: it is the sum of the contact forces, by the mass, and
    gravity, which is what the base's first rows of M a + h = J'f say.
    """
    R, v, mass = now.R_world_base, triple(now.v[:3]), now.mass_matrix[0, 0]
    moving, turning = turned(R, v), turned(R, cross(triple(now.v[3:6]), v))
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
            position, velocity, rest = now.q[i], moving[i], turning[i]
            for n in range(3):
                rows.A[i, n] = R[i, n]
        off, late = target.p_world[i] - position, target.v_world[i] - velocity
        rows.b[i] = desired(task.gains, i, target.a_world[i], late, off) - rest
        rows.weight[i] = task.weight


@dataclass(frozen=True, slots=True)
class BodyPosition(BuiltIn):
    """Move the CoM or the base along the reference, in the world frame."""

    gains: Gains  #: per axis of the world
    weight_of_robot: float  #: [N] without what it carries
    weight: float = 1.0  #: of the task
    name, unit = "body position", "m/s^2"
    fill, part = staticmethod(fill_body_position), range(3)


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
    R, g, error = now.R_world_base, task.gains, orientation_error(now, target)
    weight = orientation_weight(target, task)
    wanted = turned_back(R, triple(target.dw_world))
    for i in range(3):
        rate = -now.v[3 + i]
        for n in range(3):
            rate += R[n, i] * target.w_world[n]
        rows.A[3 + i, :] = 0.0
        rows.A[3 + i, 3 + i] = 1.0
        rows.b[3 + i] = wanted[i] + (g.kd[i] * rate + g.kp[i] * error[i])
        rows.weight[3 + i] = weight


@dataclass(frozen=True, slots=True)
class BodyOrientation(BuiltIn):
    """Turn the base along the reference; the error is log(R^T R_des) in the base frame.

    While no foot stands, only the legs turn the base, by swinging the other way: ``flight_weight``
    is the most that it weighs then. The reference may divide the weight.
    """

    gains: Gains
    weight: float = 10.0
    flight_weight: float = 0.05
    name, unit = "body orientation", "rad/s^2"
    fill, part = staticmethod(fill_body_orientation), range(3, 6)

    def weight_at(self, reference: Reference) -> float:
        """``weight`` less the reference's discount, and in flight at most ``flight_weight``."""
        return float(orientation_weight(Target.of(reference.row), self))


@kernel
def fill_swing_feet(now: Snapshot, target: Target, task: SwingFoot, rows: TaskRows) -> None:
    """The accelerations of the feet of all swing legs."""
    for leg in range(4):
        if target.legs[leg] != SWING:
            continue
        for i in range(3):
            n = LEG_ROWS + 3 * leg + i
            for k in range(18):
                rows.A[n, k] = now.J_feet[leg, i, k]
            a = target.a_world_feet[leg, i] - now.drift_feet[leg, i]
            late = target.v_world_feet[leg, i] - now.v_world_feet[leg, i]
            off = target.p_world_feet[leg, i] - now.p_world_feet[leg, i]
            rows.b[n], rows.weight[n] = desired(task.gains, i, a, late, off), task.weight


@dataclass(frozen=True, slots=True)
class SwingFoot(BuiltIn):
    """Move the foot centres of the swing legs along the reference, in the world frame."""

    gains: Gains
    weight: float = 1.0
    name, unit = "swing feet", "m/s^2"
    fill, part = staticmethod(fill_swing_feet), SWING


@kernel
def fill_leg_posture(now: Snapshot, target: Target, task: LegPosture, rows: TaskRows) -> None:
    """The accelerations of the joints of all legs that follow joint angles."""
    for n in range(12):
        if target.legs[n // 3] == JOINTS:
            late, off = target.v_joints[n] - now.v[6 + n], target.q_joints[n] - now.q[7 + n]
            wanted = desired(task.gains, n % 3, target.a_joints[n], late, off)
            ask_unknown(rows, n, wanted, task.weight)


@dataclass(frozen=True, slots=True)
class LegPosture(BuiltIn):
    """Move the joints of raised legs along the reference; free of leg singularities."""

    gains: Gains
    weight: float = 1.0
    name, unit = "leg posture", "rad/s^2"
    fill, part = staticmethod(fill_leg_posture), JOINTS


@kernel
def fill_forces(now: Snapshot, target: Target, task: ForceRegularisation, rows: TaskRows) -> None:
    """The forces of all feet that stand."""
    loads, is_planned = np.ones(4), target.force_weight > 0.0
    if not is_planned:
        plan_loads(now, target, task.weight_of_robot, loads)
    feet, weight = 0, task.weight_of_robot + now.payload[1]
    for leg in range(4):
        feet += int(target.legs[leg] == STANCE)
    for n in range(12):
        leg, i = n // 3, n % 3
        if target.legs[leg] != STANCE:
            continue
        if is_planned:
            ask_unknown(rows, n, target.f_world_feet[leg, i], target.force_weight)
        elif i == 2:
            ask_unknown(rows, n, weight / feet, task.weight)
        else:
            ask_unknown(rows, n, 0.0, task.weight / loads[leg])


@dataclass(frozen=True, slots=True)
class ForceRegularisation(BuiltIn):
    """Keep the contact forces near those of the reference, so that the optimum is unique.

    A reference without forces means an even share of the weight: around zero, a weight of 1e-3
    already sags the body. Along the ground none is wanted of a foot, the less the less it bears:
    with weights in inverse proportion to the loads (``loads``), feet that push the trunk aside do
    so in proportion to them, and all use the same part of their friction.
    """

    weight_of_robot: float
    weight: float = 1e-4
    name, unit = "force regularisation", "N"
    fill, part = staticmethod(fill_forces), STANCE

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per stance foot: its force, against weight / number of stance feet.

        Rows along the ground come times the root of the mean load over that of their foot.
        """
        rows, which = self._filled(snapshot, reference), self._places(reference)
        A, b = rows.of_decision(which, reference)
        scale = np.sqrt(rows.weight[which] / self.weight_at(reference))
        return Rows(scale[:, None] * A, scale * b)

    def weight_at(self, reference: Reference) -> float:
        """The reference's own weight, if it has one."""
        return reference.force_weight or self.weight


@subroutine
def ask_unknown(rows: TaskRows, n: int, b: float, weight: float) -> None:
    """The row of an unknown that is wanted itself."""
    row = LEG_ROWS + n
    for k in range(18):
        rows.A[row, k] = 0.0
    rows.A[row, 6 + n] = 1.0
    rows.b[row], rows.weight[row] = b, weight


@dataclass(frozen=True, slots=True)
class BuiltInTasks:
    """All of them."""

    position: BodyPosition
    orientation: BodyOrientation
    swing: SwingFoot
    posture: LegPosture
    force: ForceRegularisation

    @staticmethod
    def of(c: WbcConfig, weight: float) -> BuiltInTasks:
        """With the gains and weights of a configuration, for a robot of this weight [N]."""
        return BuiltInTasks(
            BodyPosition(c.body_position, weight, c.position_weight),
            BodyOrientation(c.body_orientation, c.orientation_weight, c.flight_weight),
            SwingFoot(c.swing_foot, c.swing_weight),
            LegPosture(c.leg_posture, c.posture_weight),
            ForceRegularisation(weight, c.force_weight),
        )


@subroutine
def fill_tasks(now: Snapshot, target: Target, c: BuiltInTasks, rows: TaskRows) -> None:
    """Fill the rows of all built-in tasks."""
    fill_body_position(now, target, c.position, rows)
    fill_body_orientation(now, target, c.orientation, rows)
    fill_swing_feet(now, target, c.swing, rows)
    fill_leg_posture(now, target, c.posture, rows)
    fill_forces(now, target, c.force, rows)
