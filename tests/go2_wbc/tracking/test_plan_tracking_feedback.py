"""A solved plan's feedback: what its torques do to the trunk while the feet on the ground stay."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.motion_plan import PlanFeedback
from go2_wbc.reference import Anchor, LegTask, Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.plan_tracking import acceleration_of, fed_back, state_error
from tests.engine_helpers import holding_reference, random_state

MODEL = RobotModel()
REAR = (LegTask.SWING, LegTask.SWING, LegTask.STANCE, LegTask.STANCE)
ANCHOR = Anchor(np.array([0.3, -0.2, 0.05]), 0.8)
SMALL = 1e-4  #: Size of the errors that first order is good for


def moment(seed: int) -> tuple[Snapshot, Reference, np.random.Generator]:
    rng = np.random.default_rng(seed)
    snapshot = MODEL.snapshot(random_state(rng))
    return snapshot, holding_reference(snapshot, REAR), rng


def planned(snapshot: Snapshot, off: np.ndarray, gains: np.ndarray) -> PlanFeedback:
    """The plan from which ``snapshot`` is off by ``off``, as Pinocchio integrates."""
    state, turn = snapshot.state, yaw_rotation(ANCHOR.yaw)
    back = pin.integrate(MODEL.pin_model, state.q, -off[:18])
    q, R = back.copy(), pin.Quaternion(back[3:7]).toRotationMatrix()
    q[:3] = turn.T @ (back[:3] - ANCHOR.p_world)
    q[3:7] = pin.Quaternion(turn.T @ R).coeffs()
    return PlanFeedback(q, state.v - off[18:], gains)


@pytest.mark.parametrize("seed", range(3))
def test_the_error_is_that_of_pinocchio_wherever_the_motion_takes_place(seed: int) -> None:
    snapshot, _, rng = moment(seed)
    off = SMALL * rng.normal(size=36)
    feedback = planned(snapshot, off, np.zeros((12, 36)))
    np.testing.assert_allclose(state_error(feedback, ANCHOR, snapshot), off, atol=30 * SMALL**2)


@pytest.mark.parametrize("seed", range(3))
def test_torques_accelerate_the_robot_as_its_dynamics_say_and_leave_the_feet(seed: int) -> None:
    snapshot, reference, rng = moment(seed)
    tau = rng.normal(scale=5.0, size=12)
    a = acceleration_of(tau, reference, snapshot)
    J = snapshot.J_contacts[2:].reshape(-1, 18)
    np.testing.assert_allclose(J @ a, 0.0, atol=1e-5)
    left = snapshot.mass_matrix @ a - np.concatenate([np.zeros(6), tau])
    force, *_ = np.linalg.lstsq(J.T, left, rcond=None)
    np.testing.assert_allclose(J.T @ force, left, atol=1e-4)


def test_on_its_plan_or_on_three_feet_a_robot_is_asked_for_the_plan() -> None:
    snapshot, reference, rng = moment(0)
    feedback = planned(snapshot, np.zeros(36), rng.normal(size=(12, 36)))
    asked = fed_back(reference, feedback, ANCHOR, snapshot).body
    np.testing.assert_allclose(asked.a_world, reference.body.a_world, atol=1e-6)
    np.testing.assert_allclose(asked.dw_world, reference.body.dw_world, atol=1e-6)
    snapshot, _, rng = moment(0)
    three = holding_reference(snapshot, (LegTask.SWING, *[LegTask.STANCE] * 3))
    feedback = planned(snapshot, rng.normal(size=36), rng.normal(size=(12, 36)))
    assert fed_back(three, feedback, ANCHOR, snapshot) is three


@pytest.mark.parametrize("seed", range(3))
def test_what_is_asked_of_the_trunk_is_what_the_gains_ask_and_no_other_feedback(seed: int) -> None:
    snapshot, reference, rng = moment(seed)
    off, gains = SMALL * rng.normal(size=36), rng.normal(scale=50.0, size=(12, 36))
    shifted = replace(
        reference.body,
        p_world=reference.body.p_world + 0.02,
        R_world_base=reference.body.R_world_base @ pin.exp3(np.full(3, 0.1)),
    )
    asked = fed_back(
        replace(reference, body=shifted), planned(snapshot, off, gains), ANCHOR, snapshot
    )
    a = acceleration_of(-gains @ off, reference, snapshot)
    np.testing.assert_allclose(
        asked.body.a_world - reference.body.a_world, snapshot.J_com @ a, atol=1e-2
    )
    np.testing.assert_allclose(
        asked.body.dw_world - reference.body.dw_world, snapshot.R_world_base @ a[3:6], atol=1e-2
    )
    np.testing.assert_array_equal(asked.body.p_world, snapshot.p_world_com)
    np.testing.assert_array_equal(asked.body.R_world_base, snapshot.R_world_base)
    np.testing.assert_array_equal(asked.p_world_feet, reference.p_world_feet)
