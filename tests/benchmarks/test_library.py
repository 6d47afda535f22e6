"""What a motion that says True must have done, in truth."""

from typing import Any, cast

import numpy as np
import pytest

from benchmarks.library import Ending, ending
from controller.acceptance import END_HEADING, END_PLACE
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions import Timeline, compile_timeline
from tests.engine_helpers import standing_q, state_of

MODEL = RobotModel()
FEET = MODEL.snapshot(state_of(standing_q())).p_world_feet


class Recorded:
    """Feet at the first and the last tick."""

    def __init__(self, yaw: float, shift: tuple[float, float, float], turn: float) -> None:
        R, middle = yaw_rotation(yaw), FEET.mean(axis=0)
        begun = (FEET - middle) @ R.T + [0.3, -0.2, middle[2]]
        ended = (begun - begun.mean(axis=0)) @ yaw_rotation(turn).T + begun.mean(axis=0)
        self.p_world_feet = np.array([begun, ended + R @ np.array(shift)])


def test_the_end_is_seen_from_where_the_robot_stood() -> None:
    plan = compile_timeline(Timeline().walk(0.5), MODEL)
    true = cast(Any, Recorded(2.0, (0.51, 0.03, 0.0), 0.05))
    end = ending(true, plan)
    assert end.way == pytest.approx(0.5, abs=1e-3)
    assert end.off == pytest.approx(np.hypot(0.01, 0.03), abs=2e-3)
    assert end.turned == pytest.approx(0.05, abs=1e-3)
    assert end.is_as_said


@pytest.mark.parametrize(("off", "turned"), [(1.3, 0.5), (0.5, 1.4)])
def test_a_motion_that_ends_elsewhere_in_truth_was_not_as_it_said(
    off: float, turned: float
) -> None:
    assert not Ending(off * END_PLACE, turned * END_HEADING, 0.5).is_as_said
    assert Ending(1.1 * END_PLACE, 0.5 * END_HEADING, 0.5).is_as_said, "1.5 % of the way drifts"
