"""The model and the equations: MuJoCo against Pinocchio, and every whole-body solution audited."""

from __future__ import annotations

from contextlib import closing

import numpy as np
from jaxtyping import Float

from benchmarks.agreement import model_agreement
from benchmarks.study import Measurement, Metric, Study
from controller.assembly import build_pilot
from controller.pilot import Pilot
from controller.procedures import Aborted
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.config import Config
from go2_wbc.legs import Leg
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.solution import WbcSolution
from motions import compile_timeline, load_motion
from motions.library.high_five import HEIGHT

STATES = 200
"""Random states of a trial on which the two models are compared."""
AGREEMENT_LIMIT = 1e-12
MOTION_LIMIT = 1e-8
"""N and N m; the robot weighs 158 N."""
TORQUE_LIMIT = 1e-5
"""N m"""
ORACLE_PERIOD = 10
"""Ticks between those that the other back ends solve as well."""
PLACO = "placo"
"""It has a robot of its own, which carries nothing."""
DRIVERS = ("condensed", PLACO)
"""Back ends that drive a whole run each, every solution audited."""
BACKENDS = ("condensed", "full", PLACO)
"""Back ends that are compared with the driving one."""

_SOLUTION_ITEM = "whole-body solutions"

AGREEMENT_METRICS = tuple(
    Metric(f"model.{name}", "Pinocchio against MuJoCo, relative", quantity, "", AGREEMENT_LIMIT)
    for name, quantity in (
        ("mass", "mass"),
        ("com", "centre of mass"),
        ("composite_inertia", "inertia"),
        ("mass_matrix", "mass matrix"),
        ("inverse_dynamics", "inverse dynamics"),
        ("forward_dynamics", "forward dynamics"),
    )
)
SOLUTION_METRICS = (
    *(
        Metric(f"wbc.motion_{name}", _SOLUTION_ITEM, f"motion, {name}", "SI", MOTION_LIMIT)
        for name in BACKENDS
    ),
    Metric("wbc.torque", _SOLUTION_ITEM, "torque between back ends", "N m", TORQUE_LIMIT),
    Metric("wbc.failures", _SOLUTION_ITEM, "QP failures", "", 0.0),
)


def measure_agreement(trial: Trial) -> Measurement:
    """Largest relative error of each quantity over ``STATES`` random states."""
    errors = model_agreement(STATES, trial.seed)
    return Measurement({f"model.{name}": error for name, error in errors.items()})


class AuditedController(WholeBodyController):
    """Checks every solution, and solves some ticks with the other back ends as well."""

    def __init__(self, model: RobotModel, backend: str, worst: dict[str, float]) -> None:
        """Solve with ``backend``; keep what is larger than in ``worst`` there."""
        super().__init__(model, backend)
        others = [name for name in BACKENDS if name != backend]
        self._others = {name: WholeBodyController(model, name) for name in others}
        self._ticks = 0
        self._worst = worst

    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        """Solve one tick and audit the solution."""
        solution = super().solve(snapshot, reference, relax=relax)
        self._audit(snapshot, solution)
        if self._ticks % ORACLE_PERIOD == 0:
            for name, controller in self._others.items():
                if PLACO in (name, solution.backend) and snapshot.payload.any():
                    continue
                other = controller.solve(snapshot, reference)
                self._audit(snapshot, other)
                self._note("wbc.torque", float(np.abs(solution.tau - other.tau).max()))
        self._ticks += 1
        return solution

    def _audit(self, snapshot: Snapshot, solution: WbcSolution) -> None:
        self._note(f"wbc.motion_{solution.backend}", motion_error(self.model, snapshot, solution))

    def _note(self, metric: str, value: float) -> None:
        self._worst[metric] = max(value, self._worst.get(metric, 0.0))


def motion_error(model: RobotModel, snapshot: Snapshot, solution: WbcSolution) -> float:
    """Largest entry [N, N m] of M qdd + h - S' tau - J' f, by recursive Newton-Euler.

    A payload that the snapshot carries is a point mass of the base.
    """
    generalised: Float[np.ndarray, "18"] = np.concatenate([np.zeros(6), solution.tau])
    for J, force in zip(snapshot.J_contacts, solution.forces, strict=True):
        generalised += J.T @ force
    state = snapshot.state
    needed = model.inverse_dynamics(state.q, state.v, solution.qdd)
    if snapshot.payload.any() and solution.backend != PLACO:
        needed[:6] += payload_wrench(model, snapshot, solution.qdd)
    return float(np.abs(needed - generalised).max())


def payload_wrench(
    model: RobotModel, snapshot: Snapshot, qdd: Float[np.ndarray, "18"]
) -> Float[np.ndarray, "6"]:
    """Force and moment [N, N m], base frame, that a snapshot's payload takes: m (a_p + g), p x.

    The CoM is ``com_shift`` = m / (M + m) (p - c) from that of the robot alone, c.
    """
    (m, _), state = snapshot.payload, snapshot.state
    R = snapshot.R_world_base
    p_world = snapshot.p_world_com + snapshot.com_shift * model.mass / m
    p, v, w = R.T @ (p_world - state.q[:3]), state.v[:3], state.v[3:6]
    a = qdd[:3] + np.cross(w, v) + np.cross(qdd[3:6], p) + np.cross(w, np.cross(w, p))
    force = m * (a + R.T @ np.array([0.0, 0.0, model.gravity]))
    return np.concatenate([force, np.cross(p, force)])


def measure_solutions(trial: Trial) -> Measurement:
    """Stand up, trot with a push, give a high five, sit; once with each of ``DRIVERS``.

    - motion: |M qdd + h - S' tau - sum J_i' f_i|, largest entry, of every solution that drives the
      robot, and of every tenth for the back ends that do not. Evaluated by Pinocchio's recursive
      Newton-Euler algorithm, not with the mass matrix and bias that the QP was made from;
    - torque between back ends: largest difference of any joint's torque for the same snapshot and
      reference, on every tenth tick.
    """
    worst = {"wbc.failures": 0.0}
    for driver in DRIVERS:
        with closing(trial.plant()) as plant, closing(build_pilot(plant, Config())) as robot:
            loop = robot.runner.loop
            loop.wbc = AuditedController(loop.model, driver, worst)
            try:
                _exercise(robot.pilot, plant)
            except Aborted as aborted:
                raise TrialFailed(f"driven by {driver}: {aborted}") from aborted
            worst["wbc.failures"] += loop.telemetry.qp_failures
    return Measurement(worst)


def _exercise(pilot: Pilot, plant: MujocoPlant) -> None:
    pilot.stand()
    pilot.walk("trot")
    pilot.set_command(VelocityCommand(0.6, 0.2, 0.5))
    pilot.wait(2.0)
    plant.push(np.array([0.0, 120.0, 0.0]), 0.1)
    pilot.wait(2.0)
    pilot.rest()
    pilot.stand()
    plan = compile_timeline(load_motion("high_five", hold=1.0), RobotModel())
    pilot.high_five(plan, Leg.FR, HEIGHT)
    pilot.sit()


AGREEMENT = Study("model", AGREEMENT_METRICS, measure_agreement, has_sensors=False)
SOLUTIONS = Study("solutions", SOLUTION_METRICS, measure_solutions, has_sensors=False)
