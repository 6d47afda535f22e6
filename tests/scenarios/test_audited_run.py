"""Every whole-body solution of a run obeys the equation of motion, and the back ends agree.

Evaluated by Pinocchio's recursive Newton-Euler algorithm, not with the mass matrix and bias that
the QP was made from.
"""

from contextlib import closing

import numpy as np
import pytest
from jaxtyping import Float

from controller.assembly import build_pilot
from controller.pilot import Pilot
from controller.sweeps.trials import Trial
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from motions import compile_timeline, load_motion

ORACLE_PERIOD = 10  #: Ticks between those that the other back ends solve as well
PLACO = "placo"  # It has a robot of its own, which carries nothing
BACKENDS = ("condensed", "full", PLACO)
MOTION, TORQUE = 1e-8, 1e-5  #: Largest errors [N, N m] of the equation, and between back ends [N m]


class AuditedController(WholeBodyController):
    """Checks every solution, and solves some ticks with the other back ends as well."""

    def __init__(self, model: RobotModel, backend: str) -> None:
        super().__init__(model, backend)
        self._others = [WholeBodyController(model, name) for name in BACKENDS if name != backend]
        self.ticks = self.compared = 0

    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        solution = super().solve(snapshot, reference, relax=relax)
        assert motion_error(self.model, snapshot, solution) <= MOTION
        for other in [] if self.ticks % ORACLE_PERIOD else self._others:
            if PLACO in (other.backend_name, solution.backend) and snapshot.payload.any():
                continue
            theirs = other.solve(snapshot, reference)
            assert motion_error(self.model, snapshot, theirs) <= MOTION
            assert np.abs(solution.tau - theirs.tau).max() <= TORQUE
            self.compared += 1
        self.ticks += 1
        return solution


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
    pilot.play(plan)
    pilot.sit()


@pytest.mark.slow
@pytest.mark.parametrize("driver", ["condensed", PLACO])
def test_every_solution_of_a_run_obeys_the_equation_of_motion_and_back_ends_agree(
    driver: str,
) -> None:
    """Stand up, trot with a push, give a high five, sit."""
    with closing(Trial(0).plant()) as plant, closing(build_pilot(plant, Config())) as robot:
        loop = robot.runner.loop
        loop.wbc = audited = AuditedController(loop.model, driver)
        _exercise(robot, plant)
        assert loop.telemetry.qp_failures == 0
    assert audited.ticks > 5000
    assert audited.compared > 300
