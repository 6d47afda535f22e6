"""A control tick as a user of PlaCo writes it: what ours is measured against.

Not our back end (``go2_wbc.wbc.placo_backend``), which aligns PlaCo with our formulation and solves
twice. Here are the same tasks, gains, weights, friction and torque limits in PlaCo's own words, and
nothing that PlaCo does not need: the tasks and contacts of a contact mode are made once and kept,
and a tick sets the state and the targets, and solves. PlaCo's own regularisation stays as it is.
A gain is one number for a task; where ours are three it gets their mean, which costs the same.
"""

from dataclasses import dataclass
from statistics import fmean

import numpy as np
import placo
from jaxtyping import Float

from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import JOINT_NAMES, LEGS, Leg
from go2_wbc.reference import LegTask, Reference, TrackedPoint
from go2_wbc.robot.inverse_kinematics import load_placo_robot
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.config import Gains, WbcConfig

BASE = "base"
Mode = tuple[tuple[LegTask, ...], TrackedPoint]
PositionTask = placo.DynamicsCoMTask | placo.DynamicsPositionTask
BodyTask = PositionTask | placo.DynamicsOrientationTask


@dataclass(frozen=True, slots=True)
class _Solver:
    qp: placo.DynamicsSolver
    position: PositionTask
    orientation: placo.DynamicsOrientationTask
    swings: dict[Leg, placo.DynamicsPositionTask]
    postures: dict[Leg, placo.DynamicsJointsTask]


class BarePlaco:
    """PlaCo's ``DynamicsSolver`` on the Go2."""

    def __init__(self, model: RobotModel, config: WbcConfig) -> None:
        self._model, self._config = model, config
        self._robot = load_placo_robot(model)
        self._solvers: dict[Mode, _Solver] = {}

    def tick(self, state: RobotState, reference: Reference) -> Float[np.ndarray, "12"]:
        """Torques [N m] for this state and reference.

        Raises:
            QpInfeasible: if PlaCo finds none.
        """
        self._robot.state.q, self._robot.state.qd = state.q, state.v
        self._robot.update_kinematics()
        mode = reference.legs, reference.body.point
        solver = self._solvers.get(mode)
        if solver is None:
            solver = self._solvers[mode] = self._make(*mode)
        _set_targets(solver, reference)
        result = solver.qp.solve(False)
        if not result.success:
            raise QpInfeasible("placo", "no solution")
        return result.tau[6:]

    def _make(self, legs: tuple[LegTask, ...], point: TrackedPoint) -> _Solver:
        config, qp = self._config, placo.DynamicsSolver(self._robot)
        qp.enable_torque_limits(True)
        for name, limit in zip(JOINT_NAMES, self._model.torque_limits, strict=True):
            qp.set_torque_limit(name, float(limit * config.torque_share))
        is_com = point is TrackedPoint.COM
        position = (
            qp.add_com_task(np.zeros(3)) if is_com else qp.add_position_task(BASE, np.zeros(3))
        )
        position.configure("position", "soft", config.position_weight)
        orientation = qp.add_orientation_task(BASE, np.eye(3))
        orientation.configure("orientation", "soft", config.orientation_weight)
        solver = _Solver(qp, position, orientation, {}, {})
        for leg in LEGS:
            self._add_leg(solver, leg, legs[leg])
        _set_gains(position, config.body_position)
        _set_gains(orientation, config.body_orientation)
        return solver

    def _add_leg(self, solver: _Solver, leg: Leg, kind: LegTask) -> None:
        config, qp = self._config, solver.qp
        if kind is LegTask.JOINTS:
            posture = solver.postures[leg] = qp.add_joints_task()
            posture.configure(f"{leg.name} posture", "soft", config.posture_weight)
            _set_gains(posture, config.leg_posture)
            return
        foot = qp.add_position_task(leg.foot, np.zeros(3))
        if kind is LegTask.SWING:
            foot.configure(f"{leg.name} swing", "soft", config.swing_weight)
            _set_gains(foot, config.swing_foot)
            solver.swings[leg] = foot
            return
        foot.configure(f"{leg.name} stance", "hard", 1.0)
        foot.kp, foot.kd = 0.0, config.stance_damping
        contact = qp.add_unilateral_point_contact(foot)
        contact.mu, contact.weight_forces = config.friction, config.force_weight


def _set_gains(task: BodyTask | placo.DynamicsJointsTask, gains: Gains) -> None:
    task.kp, task.kd = fmean(gains.kp), fmean(gains.kd)


def _set_targets(solver: _Solver, reference: Reference) -> None:
    body, position, orientation = reference.body, solver.position, solver.orientation
    position.target_world = body.p_world
    position.dtarget_world = body.v_world
    position.ddtarget_world = body.a_world
    orientation.R_world_frame = body.R_world_base
    orientation.omega_world = body.w_world
    orientation.domega_world = body.dw_world
    for leg, foot in solver.swings.items():
        foot.target_world = reference.p_world_feet[leg]
        foot.dtarget_world = reference.v_world_feet[leg]
        foot.ddtarget_world = reference.a_world_feet[leg]
    for leg, posture in solver.postures.items():
        part = leg.joints
        q, v, a = (
            values[part].tolist()
            for values in (reference.q_joints, reference.v_joints, reference.a_joints)
        )
        for name, *target in zip(JOINT_NAMES[part], q, v, a, strict=True):
            posture.set_joint(name, *target)
