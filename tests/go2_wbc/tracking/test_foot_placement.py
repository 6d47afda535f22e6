"""Two feet that swing come down where the CoM goes, across their line, and keep to their way."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.reference import LegTask, Reference, Target, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.tracking.foot_placement import (
    DAMPING,
    FALLING,
    MOST_ASIDE,
    STIFFNESS,
    place_feet,
)
from tests.engine_helpers import holding_reference, random_state

NOW = RobotModel().snapshot(random_state(np.random.default_rng(4)))
STAND, SWING, RAISED = LegTask.STANCE, LegTask.SWING, LegTask.JOINTS
DIAGONAL = (STAND, SWING, SWING, STAND)
PLAN = replace(holding_reference(NOW), legs=DIAGONAL)
small = st.floats(-0.02, 0.02)


def placed(
    off: np.ndarray, speed: np.ndarray, plan: Reference = PLAN, *, is_com: bool = True
) -> tuple[np.ndarray, Target]:
    """How far the feet's goals are moved for a CoM that is ``off`` and too fast by ``speed``."""
    target = Target.of(plan.row.copy())
    target.is_com = is_com
    target.v_world[:] = NOW.v_world_com - speed
    feet = target.p_world_feet.copy()
    place_feet(NOW, np.concatenate([-off, np.zeros(3)]), target)
    return target.p_world_feet - feet, target


@given(small, small, st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_feet_go_where_the_com_goes_across_their_line_and_no_farther_than_allowed(
    x: float, y: float, v_x: float, v_y: float
) -> None:
    off, speed = np.array([x, y, 0.01]), np.array([v_x, v_y, 0.1])
    moved, target = placed(off, speed)
    line = target.p_world_feet[2, :2] - target.p_world_feet[1, :2]
    across = np.array([-line[1], line[0]]) / np.linalg.norm(line)
    asked = float(across @ (off + FALLING * speed)[:2])
    wanted = np.clip(asked, -MOST_ASIDE, MOST_ASIDE) * across
    for leg in (1, 2):
        np.testing.assert_allclose(moved[leg], [*wanted, 0.0], atol=1e-12)
        late = target.v_world_feet[leg] - NOW.v_world_feet[leg]
        pull = STIFFNESS * (target.p_world_feet[leg] - NOW.p_world_feet[leg]) + DAMPING * late
        np.testing.assert_allclose(target.a_world_feet[leg] - PLAN.a_world_feet[leg], pull)
    assert not moved[[0, 3]].any()


@pytest.mark.parametrize(
    ("legs", "is_com", "weight"),
    [
        ((STAND,) * 4, True, 0.0),
        ((STAND, STAND, STAND, SWING), True, 0.0),
        ((STAND, SWING, SWING, RAISED), True, 0.0),
        ((STAND, STAND, SWING, RAISED), True, 0.0),
        ((SWING,) * 4, True, 0.0),
        (DIAGONAL, False, 0.0),
        (DIAGONAL, True, 0.01),
    ],
)
def test_other_feet_keep_their_goals(
    legs: tuple[LegTask, ...], is_com: bool, weight: float
) -> None:
    plan = replace(PLAN, legs=legs, force_weight=weight)
    moved, target = placed(np.full(3, 0.01), np.zeros(3), plan, is_com=is_com)
    assert not moved.any()
    np.testing.assert_array_equal(target.a_world_feet, plan.a_world_feet)
    assert PLAN.body.point is TrackedPoint.COM
