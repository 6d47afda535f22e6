"""Tasks of a user's own, beside the built-in ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import Task
from tests.engine_helpers import ST, SW, holding_reference, standing_q, state_of


@dataclass(frozen=True, slots=True)
class HipAcceleration(Task):
    """Ask the first hip for an acceleration, more strongly than any other task."""

    wanted: float
    weight: float = 1e4
    name: str = "hip"
    unit: str = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        return Rows(np.eye(1, SIZE, 6), np.array([self.wanted]))


@pytest.mark.parametrize("backend", ["condensed", "full"])
def test_a_task_of_ones_own_is_followed_and_audited(backend: str) -> None:
    model = RobotModel()
    snapshot = model.snapshot(state_of(standing_q()))
    reference = holding_reference(snapshot, (SW, ST, ST, ST))
    for wanted in (-20.0, 20.0):
        wbc = WholeBodyController(model, backend, extra_tasks=[HipAcceleration(wanted)])
        solution = wbc.solve(snapshot, reference)
        assert solution.qdd[6] == pytest.approx(wanted, abs=0.01)
        assert any(row.name == "hip" and row.norm < 0.01 for row in solution.residuals)


def test_placo_refuses_tasks_that_it_could_not_follow() -> None:
    with pytest.raises(ConfigError, match="takes no extra"):
        WholeBodyController(RobotModel(), "placo", extra_tasks=[HipAcceleration(0.0)])
