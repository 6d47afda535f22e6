"""Whatever the middleware does, the robot stands or lies, and somebody says why.

The scenarios are those of ``python -m benchmarks bridges ros2-faults``.
"""

from __future__ import annotations

import pytest

from benchmarks.bridges.faults import TILT_LIMIT, Fault
from benchmarks.bridges.ros2_faults import FAULTS, tilt_during
from controller.sweeps.trials import TrialFailed
from tests.controller.bridges.ros2_graph import needs_ros2


@needs_ros2
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name.removeprefix("ros2."))
def test_no_fault_makes_a_robot_fall_and_somebody_is_told(graph: None, fault: Fault) -> None:
    assert tilt_during(fault) <= TILT_LIMIT


@needs_ros2
def test_a_scenario_in_which_the_robot_was_not_seen_is_no_success(graph: None) -> None:
    with pytest.raises(TrialFailed, match="no odometry"):
        tilt_during(Fault("nothing", "nothing", lambda _scene: None))
