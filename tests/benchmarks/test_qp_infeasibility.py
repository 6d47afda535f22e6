"""The benchmark of answers counts what it names, and nothing is counted twice."""

from collections.abc import Iterator

import numpy as np
import pytest

from benchmarks.qp_infeasibility import calf_distance, watch
from benchmarks.study import TrialResult
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.errors import QpInfeasible
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.controller import WholeBodyController
from tests.go2_wbc.plant.helpers import empty_recording


def measured(robot: TrialRobot, course: Iterator[float]) -> dict[str, float]:
    found = TrialResult()
    with robot:
        watch(robot, course, found)
    return found.values


def test_a_quiet_trot_counts_nothing() -> None:
    robot = TrialRobot(Trial(1))
    values = measured(robot, iter([0.3]))
    assert set(values) == {"failures", "damped", "grave", "relaxed", "unreported", "falls"}
    assert not any(values.values())


def test_a_robot_that_is_damped_while_upright_is_counted_as_that(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def course() -> Iterator[float]:
        yield 0.1
        monkeypatch.setattr(WholeBodyController, "solve", refuse)
        yield 1.0

    values = measured(TrialRobot(Trial(1)), course())
    assert values["failures"] == 10.0
    assert values["damped"] == 1.0
    assert values["unreported"] == 0.0


def refuse(*_: object, **__: object) -> None:
    raise QpInfeasible("none", "a test")


def test_a_fall_is_counted_as_one_that_was_reported() -> None:
    robot = TrialRobot(Trial(1))

    def course() -> Iterator[float]:
        yield 0.1
        robot.push(np.array([0.0, 600.0, 0.0]), 0.1)
        yield 3.0

    values = measured(robot, course())
    assert values["falls"] == 1.0
    assert values["damped"] == values["unreported"] == 0.0


def test_the_distance_of_a_calf_is_that_of_the_nearest_one_from_its_nearest_stop() -> None:
    model, recorded = RobotModel(), empty_recording(2, np.zeros((2, 4, 3)))
    recorded.q[:, 7:] = (model.q_lower + model.q_upper) / 2
    recorded.q[0, 7 + 5] = model.q_upper[5] - 0.02
    recorded.q[1, 7 + 11] = model.q_lower[11] + 0.01
    recorded.q[:, 7 + 3] = model.q_upper[3]  # a hip, not a calf
    np.testing.assert_allclose(calf_distance(recorded), [0.02, 0.01])
