"""Tasks of a user's own, beside the built-in ones."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from jaxtyping import Float

from go2_wbc.compilation import kernel
from go2_wbc.errors import ConfigError
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import Task
from tests.engine_helpers import ST, SW, cases, standing

MODEL = RobotModel()


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
    snapshot, reference = standing(MODEL, (SW, ST, ST, ST))
    for wanted in (-20.0, 20.0):
        wbc = WholeBodyController(MODEL, backend, extra_tasks=[HipAcceleration(wanted)])
        solution = wbc.solve(snapshot, reference)
        assert solution.qdd[6] == pytest.approx(wanted, abs=0.01)
        assert any(row.name == "hip" and row.norm < 0.01 for row in solution.residuals)


@kernel
def hip_rows(wanted: float, A: Float[np.ndarray, "1 30"], b: Float[np.ndarray, "1"]) -> None:
    A[0, 6], b[0] = 1.0, wanted


@dataclass(frozen=True, slots=True)
class CompiledHipAcceleration(HipAcceleration):
    """The same, compiled."""

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        rows = Rows(np.zeros((1, SIZE)), np.empty(1))
        hip_rows(self.wanted, *rows)
        return rows


@dataclass(frozen=True, slots=True)
class ForSlippery(HipAcceleration):
    """The same, for a reference that counts on little friction only."""

    def weight_at(self, reference: Reference) -> float:
        return self.weight if 0.0 < reference.friction < 0.4 else 0.0


def test_a_compiled_task_is_followed_like_one_in_numpy() -> None:
    for snapshot, reference in cases(MODEL, 26, seed=41):
        plain, compiled = (
            WholeBodyController(MODEL, extra_tasks=[kind(3.0, weight=1.0)])
            for kind in (HipAcceleration, CompiledHipAcceleration)
        )
        expected = plain.solve(snapshot, reference, relax=True)
        found = compiled.solve(snapshot, reference, relax=True)
        np.testing.assert_array_equal(found.tau, expected.tau)


@pytest.mark.parametrize("backend", ["condensed", "full"])
def test_a_weight_that_the_reference_decides_is_asked_by_every_back_end(backend: str) -> None:
    snapshot, reference = standing(MODEL, (SW, ST, ST, ST))
    wbc = WholeBodyController(MODEL, backend, extra_tasks=[ForSlippery(20.0)])
    assert abs(wbc.solve(snapshot, reference).qdd[6]) < 1.0
    slippery = replace(reference, friction=0.3)
    assert wbc.solve(snapshot, slippery).qdd[6] == pytest.approx(20.0, abs=0.01)


def test_placo_refuses_tasks_that_it_could_not_follow() -> None:
    with pytest.raises(ConfigError, match="takes no extra"):
        WholeBodyController(MODEL, "placo", extra_tasks=[HipAcceleration(0.0)])
