"""A task of your own in the whole-body QP, and a control loop of your own around it.

A task gives rows A z = b, z = (18 accelerations, 4 x 3 foot forces). This one loads one diagonal
of feet more than the other: the one way to shift load that leaves the trunk where it is.
"""

from dataclasses import dataclass

import numpy as np

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import Anchor, Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.problem import FORCES, SIZE, Rows
from go2_wbc.wbc.tasks import Task
from motions import Timeline, compile_timeline


@dataclass(frozen=True, slots=True)
class LoadDiagonal(Task):
    """Carry ``difference`` [N] more on FL and RR than on FR and RL."""

    difference: float
    weight: float = 1e-2
    name: str = "load of the diagonal"
    unit: str = "N"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """One row: signed sum of the vertical forces."""
        A = np.zeros((1, SIZE))
        A[0, FORCES][2::3] = (1.0, -1.0, -1.0, 1.0)  # FL FR RL RR
        return Rows(A, np.array([self.difference]))


model, plant, shifts = RobotModel(), MujocoPlant(), []
with GO2Controller(plant=plant) as go2:
    go2.stand()
    feet = model.snapshot(plant.read()).p_world_feet
    standing = compile_timeline(Timeline().body(z=0.0, over=1.0), model).at(0.0)
    reference = standing.placed(Anchor.of_feet(feet, model.foot_radius))
    for wanted in (0.0, 40.0):
        wbc = WholeBodyController(model, extra_tasks=[LoadDiagonal(wanted)])
        for _ in range(500):  # one second: read, solve, write
            solution = wbc.solve(model.snapshot(plant.read()), reference)
            plant.write(solution.command)
        forces = plant.read().foot_forces
        shifts.append(forces @ (1.0, -1.0, -1.0, 1.0))
        print(f"asked {wanted:.0f} N: measured {shifts[-1]:.1f} N, feet {forces.round(1)} N")

if not (abs(shifts[0]) < 8.0 and abs(shifts[1] - 40.0) < 8.0):
    raise SystemExit("the load did not shift as asked")
