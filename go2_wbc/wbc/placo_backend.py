"""The whole-body QP formulated a second time, by PlaCo's ``DynamicsSolver``: an oracle for ours.

PlaCo has its own Jacobians, drifts, CoM terms, torque expression, elimination of the equalities
and QP solver (EiQuadProg). From us it takes the state, the reference and the gains; the desired
accelerations are evaluated with PlaCo's kinematics and handed over as feed-forward, because its own
gains are not per axis. Where PlaCo's formulation differs from ours it is aligned:

- Rolling contacts. A PlaCo contact is a frame fixed to the foot. Ours lies r below the centre, so
  the frame is moved there each tick. Its material point has the centripetal acceleration
  w x (w x (-r n)), which a rolling contact must keep: it is the contact's feed-forward.
- Costs. ``torque_cost`` (1e-3 by default) is 0, and the regularisation of the QP is 1e-12.
- Force regularisation. PlaCo regularises around zero. Half of the weight stays there and half is
  added around 2 f0, since |f|^2 / 2 + |f - 2 f0|^2 / 2 = |f - f0|^2 + const. Along the ground
  f0 is 0, and the added half is what is missing of a foot's own weight.
- Normal force bounds, joint limits and the motors' line. PlaCo knows no bounds on a contact's
  normal force, and one torque limit for both directions: the motors' peak. Its joint limits are
  ours with dt = ``limit_horizon`` and safe acceleration = ``braking`` inside the limits, but
  outside them they ask for qdd <= -braking, and elsewhere for more than ``braking``, which can make
  the QP infeasible. These limits, of the torques where a fast joint has less than its peak, are
  therefore added as rows of ours to the QP that PlaCo has assembled, and the QP is solved again: a
  tick costs two solutions.

Without any stance foot the QP is a free fall and has a solution, as for the other back ends.
"""

from __future__ import annotations

import numpy as np
import placo

from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import JOINT_NAMES, LEGS, Leg
from go2_wbc.records import Array3, Array6, Array30
from go2_wbc.reference import LegTask, Reference, TrackedPoint
from go2_wbc.robot.inverse_kinematics import load_placo_robot
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation
from go2_wbc.robot.state import RobotState, Snapshot
from go2_wbc.wbc.config import Gains, WbcConfig
from go2_wbc.wbc.constraints import FrictionPyramid, JointLimits, TorqueLimits
from go2_wbc.wbc.problem import ACCELERATION, FORCES, SIZE, Bounds, Problem
from go2_wbc.wbc.tasks import (
    BodyOrientation,
    BodyPosition,
    ForceRegularisation,
    LegPosture,
    SwingFoot,
    Task,
)

REGULARISATION = 1e-12
"""Added by PlaCo to the diagonal of its Hessian; its default 1e-8 moves a force by 4 mN."""
SOLVER = "placo"
_BASE = "base"
_WORLD_ALIGNED = "local_world_aligned"


class PlacoBackend:
    """Solves the same QP through PlaCo; see the module's docstring for what is aligned how.

    One PlaCo solver is kept per contact mode (tasks of the legs and tracked point) seen so far.
    """

    def __init__(self, model: RobotModel, config: WbcConfig) -> None:
        """Load the robot into PlaCo, with the armature and foot radius of ``model``."""
        self._model = model
        self._config = config
        self._robot = load_placo_robot(model)
        self._modes: dict[tuple[tuple[LegTask, ...], TrackedPoint], _Mode] = {}

    def solve(self, problem: Problem) -> Array30:
        """The optimal decision z.

        Raises:
            QpInfeasible: with the residual table of the best point without limits.
        """
        reference = problem.reference
        key = (reference.legs, reference.body.point)
        if key not in self._modes:
            self._modes[key] = _Mode(self._robot, self._model, self._config, *key)
        mode = self._modes[key]
        mode.update(problem)
        try:
            return mode.solve(problem)
        except QpInfeasible as error:
            best = _without_limits(problem)
            raise QpInfeasible(SOLVER, error.status, problem.residuals(best)) from error


class _Mode:
    """PlaCo's dynamics solver with the tasks and contacts of one contact mode."""

    def __init__(
        self,
        robot: placo.RobotWrapper,
        model: RobotModel,
        config: WbcConfig,
        legs: tuple[LegTask, ...],
        point: TrackedPoint,
    ) -> None:
        self._robot, self._model, self._config = robot, model, config
        self._point = point
        self._stance = [leg for leg in LEGS if legs[leg] is LegTask.STANCE]
        columns = [FORCES.start + 3 * leg + axis for leg in self._stance for axis in range(3)]
        self._force_columns = columns
        self._solver = placo.DynamicsSolver(robot)
        self._solver.torque_cost = 0.0
        self._solver.problem.regularization = REGULARISATION
        self._solver.enable_torque_limits(True)
        for name, limit in zip(JOINT_NAMES, model.torque_limits, strict=True):
            self._solver.set_torque_limit(name, float(limit * config.torque_share))
        if point is TrackedPoint.COM:
            self._position = self._solver.add_com_task(np.zeros(3))
        else:
            self._position = self._solver.add_position_task(_BASE, np.zeros(3))
        self._orientation = self._solver.add_orientation_task(_BASE, np.eye(3))
        self._pressing: list[placo.Contact] = []
        self._contacts = {leg: self._add_contact(leg) for leg in self._stance}
        self._swing = {
            leg: self._solver.add_position_task(leg.foot, np.zeros(3))
            for leg in LEGS
            if legs[leg] is LegTask.SWING
        }
        self._posture = {
            leg: self._solver.add_joints_task() for leg in LEGS if legs[leg] is LegTask.JOINTS
        }
        self._soft: list[tuple[str, placo.Prioritized, type[Task]]] = [
            ("position", self._position, BodyPosition),
            ("orientation", self._orientation, BodyOrientation),
            *((f"{leg.name} swing", task, SwingFoot) for leg, task in self._swing.items()),
            *((f"{leg.name} posture", task, LegPosture) for leg, task in self._posture.items()),
        ]
        self._solver.set_kp(0.0)
        self._solver.set_kd(0.0)

    def _add_contact(self, leg: Leg) -> placo.DynamicsPositionTask:
        task = self._solver.add_position_task(f"{leg.name}_contact", np.zeros(3))
        task.configure(f"{leg.name} contact", "hard", 1.0)
        contact = self._solver.add_unilateral_point_contact(task)
        contact.weight_tangentials = 0.0
        self._pressing.append(contact)
        return task

    def update(self, problem: Problem) -> None:
        """Bring the robot to the measured state and set every desired acceleration."""
        state, reference = problem.snapshot.state, problem.reference
        for contact in self._pressing:
            contact.mu = problem.source(FrictionPyramid).friction_for(reference)
        self._robot.state.q = state.q
        self._robot.state.qd = state.v
        self._robot.update_kinematics()
        for leg in self._stance:
            self._place_contact(leg)
        self._robot.update_kinematics()
        self._update_body(state, reference)
        for name, task, kind in self._soft:
            task.configure(name, "soft", problem.source(kind).weight_at(reference))
        for leg in self._stance:
            self._update_contact(leg, state)
        for contact in self._pressing:
            weight = problem.source(ForceRegularisation).weight_at(reference)
            contact.weight_forces = weight / 2
        for leg, task in self._swing.items():
            p, v = self._robot.get_T_world_frame(leg.foot)[:3, 3], self._velocity(leg.foot, state)
            task.ddtarget_world = _acceleration(
                self._config.swing_foot,
                reference.a_world_feet[leg],
                reference.v_world_feet[leg] - v[:3],
                reference.p_world_feet[leg] - p,
            )
        for leg, task in self._posture.items():
            columns = leg.joints
            desired = _acceleration(
                self._config.leg_posture,
                reference.a_joints[columns],
                reference.v_joints[columns] - state.joint_velocities[columns],
                reference.q_joints[columns] - state.joint_positions[columns],
            )
            for name, acceleration in zip(JOINT_NAMES[columns], desired, strict=True):
                task.set_joint(name, 0.0, 0.0, float(acceleration))

    def _place_contact(self, leg: Leg) -> None:
        frames = self._robot.model.frames
        foot = frames[self._robot.model.getFrameId(leg.foot)].placement
        contact = frames[self._robot.model.getFrameId(f"{leg.name}_contact")]
        R_world_foot = self._robot.get_T_world_frame(leg.foot)[:3, :3]
        down = np.array([0.0, 0.0, -self._model.foot_radius])
        placement = foot.copy()
        placement.translation = foot.translation + foot.rotation @ R_world_foot.T @ down
        contact.placement = placement

    def _update_body(self, state: RobotState, reference: Reference) -> None:
        target, T_world_base = reference.body, self._robot.get_T_world_frame(_BASE)
        R, base_velocity = T_world_base[:3, :3], self._velocity(_BASE, state)
        if self._point is TrackedPoint.COM:
            p, v = self._robot.com_world(), self._robot.com_jacobian() @ state.v
        else:
            p, v = T_world_base[:3, 3], base_velocity[:3]
        self._position.ddtarget_world = _acceleration(
            self._config.body_position, target.a_world, target.v_world - v, target.p_world - p
        )
        self._orientation.domega_world = R @ _acceleration(
            self._config.body_orientation,
            R.T @ target.dw_world,
            R.T @ (target.w_world - base_velocity[3:]),
            log_rotation(R.T @ target.R_world_base),
        )

    def _update_contact(self, leg: Leg, state: RobotState) -> None:
        velocity = self._velocity(f"{leg.name}_contact", state)
        w = velocity[3:]
        down = np.array([0.0, 0.0, -self._model.foot_radius])
        centripetal = np.cross(w, np.cross(w, down))
        damping = self._config.stance_damping * velocity[:3]
        self._contacts[leg].ddtarget_world = centripetal - damping

    def _velocity(self, frame: str, state: RobotState) -> Array6:
        return self._robot.frame_jacobian(frame, _WORLD_ALIGNED) @ state.v

    def solve(self, problem: Problem) -> Array30:
        """z of PlaCo's QP with our rows added."""
        if not self._solver.solve(False).success:
            raise QpInfeasible(SOLVER, "tasks, friction and torque limits contradict each other")
        qp = self._solver.problem
        self._add_force_reference(problem)
        self._add_bounds(problem)
        try:
            qp.solve()
        except RuntimeError as error:
            raise QpInfeasible(SOLVER, str(error)) from error
        x = np.array(qp.x)
        if not np.isfinite(x).all():
            raise QpInfeasible(SOLVER, "the solution is not finite")
        z = np.zeros(SIZE)
        z[ACCELERATION] = x[:18]
        z[self._force_columns] = x[18:]
        return z

    def _add_force_reference(self, problem: Problem) -> None:
        if not self._stance:
            return
        task, reference = problem.source(ForceRegularisation), problem.reference
        A, b = task.rows(problem.snapshot, reference)
        ours = A[:, self._force_columns]  # diagonal
        rest = np.sqrt(np.maximum(2.0 * ours**2 - np.eye(len(b)), 0.0))
        around = placo.Expression()
        around.A = np.hstack([np.zeros((len(b), 18)), rest])
        around.b = -2 * b
        row = self._solver.problem.add_constraint(around == 0.0)
        row.configure("soft", task.weight_at(reference) / 2)

    def _add_bounds(self, problem: Problem) -> None:
        columns = [*range(18), *self._force_columns]
        snapshot, reference = problem.snapshot, problem.reference
        joints = (
            problem.source(JointLimits).bounds(snapshot, reference),
            _on_the_line(problem.source(TorqueLimits), snapshot, reference),
        )
        normals = np.eye(len(columns))[[20 + 3 * i for i in range(len(self._stance))]]
        C = np.concatenate([*(bound.C[:, columns] for bound in joints), normals])
        least, greatest = reference.normal_force_min, reference.normal_force_max
        lower = np.concatenate([*(bound.lower for bound in joints), least[self._stance]])
        upper = np.concatenate([*(bound.upper for bound in joints), greatest[self._stance]])
        has_lower, has_upper = np.isfinite(lower), np.isfinite(upper)
        excess = placo.Expression()
        excess.A = np.concatenate([C[has_upper], -C[has_lower]])
        excess.b = np.concatenate([-upper[has_upper], lower[has_lower]])
        self._solver.problem.add_constraint(excess <= 0.0)


def _on_the_line(limits: TorqueLimits, snapshot: Snapshot, reference: Reference) -> Bounds:
    """The torque limits that are tighter than the peak; infinite where PlaCo's own are enough."""
    C, lower, upper = limits.bounds(snapshot, reference)
    least, greatest = limits.motor.limits(snapshot.state.joint_velocities)
    lower = np.where(least > -limits.motor.peak, lower, -np.inf)
    return Bounds(C, lower, np.where(greatest < limits.motor.peak, upper, np.inf))


def _acceleration(gains: Gains, feed_forward: Array3, rate_error: Array3, error: Array3) -> Array3:
    return feed_forward + np.asarray(gains.kd) * rate_error + np.asarray(gains.kp) * error


def _without_limits(problem: Problem) -> Array30:
    root = np.sqrt(problem.weights)
    A = np.concatenate([problem.equalities.A, root[:, None] * problem.tasks.A])
    b = np.concatenate([problem.equalities.b, root * problem.tasks.b])
    return np.linalg.lstsq(A, b, rcond=None)[0]
