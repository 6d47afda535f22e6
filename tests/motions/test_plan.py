"""What a plan asks of the body and the joints fits together: rates are derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation
from motions import Timeline, compile_timeline, deg
from motions.postures import sit_down

STEP = 1e-5  # s; of the differences
EXACT = dict(rtol=1e-5, atol=1e-5)
START = np.array([0.02, -0.01, 0.25, 0.15, -0.2, 0.4])


def lively() -> MotionPlan:
    line = Timeline().body(x=0.02, z=-0.03, roll=deg(6), pitch=deg(-7), yaw=deg(10), over=0.8)
    return compile_timeline(line.foot("FR", z=0.05, over=0.8).home(over=1.0), RobotModel())


@pytest.mark.parametrize("make", [lively, lambda: sit_down(START)])
def test_velocities_and_accelerations_of_a_plan_are_derivatives(make) -> None:  # noqa: ANN001
    plan = make()
    for t in np.linspace(0.0, plan.duration, 23)[1:-1] + 0.0123:
        if t > plan.duration - 0.01:
            continue
        before, now, after = (plan.at(float(t + d)) for d in (-STEP, 0.0, STEP))
        b0, b, b1 = before.body, now.body, after.body
        two = 2.0 * STEP
        assert b.p_world.shape == (3,)
        np.testing.assert_allclose(b.v_world, (b1.p_world - b0.p_world) / two, **EXACT)
        np.testing.assert_allclose(b.a_world, (b1.v_world - b0.v_world) / two, **EXACT)
        turned = log_rotation(b1.R_world_base @ b0.R_world_base.T) / two
        np.testing.assert_allclose(b.w_world, turned, **EXACT)
        np.testing.assert_allclose(b.dw_world, (b1.w_world - b0.w_world) / two, **EXACT)
        np.testing.assert_allclose(now.v_joints, (after.q_joints - before.q_joints) / two, **EXACT)
        np.testing.assert_allclose(now.a_joints, (after.v_joints - before.v_joints) / two, **EXACT)
