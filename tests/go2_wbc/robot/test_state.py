"""What is read off a measured state, against Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.state import JointCommand
from tests.engine_helpers import random_state, standing_q, state_of

EXACT = 1e-12  # rounding of numbers of order one
SEEDS = range(30)


@pytest.mark.parametrize("seed", SEEDS)
def test_orientation_angles_and_tilt_are_pinocchios(seed: int) -> None:
    rng = np.random.default_rng(seed)
    state = random_state(rng, tilt=0.6)
    R = pin.Quaternion(state.q[3:7]).matrix()
    np.testing.assert_allclose(state.R_world_base, R, atol=EXACT)
    np.testing.assert_allclose(state.rpy, pin.rpy.matrixToRpy(R), atol=1e-9)
    np.testing.assert_allclose(rotation_from_rpy(*state.rpy), R, atol=1e-9)
    up = R @ np.array([0.0, 0.0, 1.0])
    assert state.tilt == pytest.approx(np.arccos(up[2]), abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 2, 2.5, np.pi])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_tilt_goes_up_to_half_a_turn_and_ignores_yaw(angle: float, axis: int) -> None:
    lean = pin.AngleAxis(angle, np.eye(3)[axis]).matrix()
    R = rotation_from_rpy(0.0, 0.0, 1.3) @ lean
    q = standing_q()
    q[3:7] = pin.Quaternion(R).coeffs()
    assert state_of(q).tilt == pytest.approx(angle, abs=1e-7)


def test_the_pitch_at_the_pole_is_finite() -> None:
    q = standing_q()
    q[3:7] = pin.Quaternion(rotation_from_rpy(0.0, np.pi / 2, 0.0)).coeffs() * (1 + 1e-12)
    assert state_of(q).rpy[1] == pytest.approx(np.pi / 2, abs=1e-5)


def test_the_parts_of_a_state_are_where_pinocchio_has_them() -> None:
    state = state_of(np.arange(19.0), np.arange(18.0))
    np.testing.assert_array_equal(state.p_world_base, [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(state.joint_positions, np.arange(7.0, 19.0))
    np.testing.assert_array_equal(state.joint_velocities, np.arange(6.0, 18.0))


def test_a_torque_command_has_no_servo_and_a_servo_no_torque() -> None:
    tau = np.arange(12.0)
    torque = JointCommand.torque(tau)
    np.testing.assert_array_equal(torque.tau, tau)
    assert not torque.kp.any()
    assert not torque.kd.any()
    servo = JointCommand.servo(tau, 2 * tau, kp=30.0, kd=1.0)
    assert not servo.tau.any()
    np.testing.assert_array_equal(servo.q_des, tau)
    np.testing.assert_array_equal(servo.v_des, 2 * tau)
    assert set(servo.kp) == {30.0}
    assert set(servo.kd) == {1.0}
    damping = JointCommand.damping(3.0)
    assert not damping.tau.any()
    assert not damping.kp.any()
    assert set(damping.kd) == {3.0}


def test_the_shared_zeros_of_commands_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="read-only"):
        JointCommand.damping(1.0).tau[0] = 1.0
