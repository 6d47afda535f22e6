"""Whatever the middleware does, the robot stands or lies, and somebody says why.

The scenarios are those of ``go2-wbc bench bridges ros2-faults``.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from controller.bench.bridges.ros2_faults import FAMILY, SCENARIOS, TILT_BAR, Scenario
from controller.bench.bridges.ros2_stage import Stage
from controller.bench.trials import Failed
from tests.controller.bridges.ros2_graph import needs_ros2


@pytest.fixture(scope="module")
def stage(graph: None) -> Iterator[Stage]:
    stage = Stage("faults")
    yield stage
    stage.close()


@needs_ros2
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.act.__name__)
def test_no_fault_makes_a_robot_fall_and_somebody_is_told(stage: Stage, scenario: Scenario) -> None:
    assert stage.play(scenario.act) <= TILT_BAR


@needs_ros2
def test_a_scenario_in_which_the_robot_was_not_seen_is_no_success(graph: None) -> None:
    with pytest.raises(Failed, match="no odometry"):
        Stage("nowhere").play(lambda _stage: None)


def test_every_scenario_has_a_row_with_the_bar() -> None:
    assert [row.bar for row in FAMILY.rows] == [TILT_BAR] * len(SCENARIOS)
