"""Whatever the middleware does, the robot stands or lies, and somebody says why.

The scenarios are those of ``go2-wbc bench bridges ros2-faults``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from benchmarks.bridges.faults import TILT_BAR
from benchmarks.bridges.ros2_faults import ACTS
from benchmarks.bridges.ros2_stage import Stage
from benchmarks.trials import Failed
from tests.controller.bridges.ros2_graph import needs_ros2


@pytest.fixture(scope="module")
def stage(graph: None) -> Iterator[Stage]:
    stage = Stage("faults")
    yield stage
    stage.close()


@needs_ros2
@pytest.mark.parametrize("act", [act for act, _ in ACTS], ids=lambda act: act.__name__)
def test_no_fault_makes_a_robot_fall_and_somebody_is_told(
    stage: Stage, act: Callable[[Stage], None]
) -> None:
    assert stage.play(act) <= TILT_BAR


@needs_ros2
def test_a_scenario_in_which_the_robot_was_not_seen_is_no_success(graph: None) -> None:
    with pytest.raises(Failed, match="no odometry"):
        Stage("nowhere").play(lambda _stage: None)
