"""What stands between the controller and a robot's motors. Needs no DDS library."""

from dataclasses import replace

import numpy as np
import pytest

from controller.behaviours.joints import DAMPING
from controller.bridges.unitree.low_level import GuardConfig, Guards, is_passive, require_sane
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.profile import find_profile
from go2_wbc.robot.rotations import quaternion_from_rpy
from go2_wbc.robot.state import JointCommand, RobotState
from tests.controller.plants import lying_state

TUCKED_JOINTS = find_profile().tucked_joints

TAU = JointCommand.torque(np.full(12, 5.0))
RAMP = GuardConfig().ramp_time


@pytest.fixture
def guards() -> Guards:
    return Guards(RobotModel(), GuardConfig())


def at(time: float, joints: np.ndarray = TUCKED_JOINTS, roll: float = 0.0) -> RobotState:
    q = np.concatenate([[0.0, 0.0, 0.08], quaternion_from_rpy(roll, 0.0, 0.0), joints])
    return replace(lying_state(time), q=q)


def test_torque_and_stiffness_grow_from_nothing(guards: Guards) -> None:
    servo = JointCommand.servo(TUCKED_JOINTS, np.zeros(12), 40.0, 2.0)
    first = guards.soften(servo, at(10.0))
    assert first.kp.max() == 0.0
    assert first.kd.min() == DAMPING
    half = guards.soften(servo, at(10.0 + RAMP / 2))
    assert half.kp == pytest.approx(20.0)
    full = guards.soften(servo, at(10.0 + RAMP))
    assert full.kp == pytest.approx(40.0)
    assert full.kd == pytest.approx(2.0)


def test_a_single_damped_tick_does_not_begin_the_ramp_anew(guards: Guards) -> None:
    guards.soften(TAU, at(0.0))
    guards.soften(TAU, at(RAMP))
    guards.soften(JointCommand.damping(3.0), at(RAMP + 0.002))
    assert guards.soften(TAU, at(RAMP + 0.004)).tau == pytest.approx(5.0)


def test_after_a_rest_the_ramp_begins_anew(guards: Guards) -> None:
    guards.soften(TAU, at(0.0))
    guards.soften(JointCommand.damping(3.0), at(1.0))
    assert guards.soften(TAU, at(2.0)).tau.max() == 0.0


def test_torque_is_limited_and_never_pushes_past_a_joints_limit(guards: Guards) -> None:
    model = RobotModel()
    upper = np.array(model.pin_model.upperPositionLimit[7:])
    guards.soften(TAU, at(0.0))
    strong = JointCommand.torque(np.full(12, 400.0))
    assert np.array_equal(guards.soften(strong, at(RAMP)).tau, model.torque_limits)
    turning = replace(at(RAMP), v=np.concatenate([np.zeros(6), 0.8 * model.speed_limits]))
    given = model.motor.limits(turning.joint_velocities)[1]
    assert np.array_equal(guards.soften(strong, turning).tau, given)
    assert given.max() < 0.5 * model.torque_limits.max()
    joints = TUCKED_JOINTS.copy()
    joints[2] = upper[2] + 0.01
    assert guards.soften(strong, at(RAMP, joints)).tau[2] == 0.0
    assert guards.soften(JointCommand.torque(np.full(12, -9.0)), at(RAMP, joints)).tau[2] == -9.0


def test_a_tilted_robot_is_a_fault(guards: Guards) -> None:
    assert guards.fault(at(0.0, roll=1.1)) is None
    assert guards.fault(at(0.0, roll=1.3)) == "tilted: roll 74 deg, pitch 0 deg"


def test_a_joint_far_beyond_its_limit_is_a_fault(guards: Guards) -> None:
    joints = TUCKED_JOINTS.copy()
    joints[5] = -0.5
    reason = guards.fault(at(0.0, joints))
    assert reason is not None
    assert reason.startswith("joint 5 is 0.3")


def test_a_state_that_is_not_finite_is_a_fault(guards: Guards) -> None:
    joints = TUCKED_JOINTS.copy()
    joints[0] = np.nan
    assert guards.fault(at(0.0, joints)) == "the measured state is not finite"


def test_only_damping_is_passive() -> None:
    assert is_passive(JointCommand.damping(3.0))
    assert not is_passive(TAU)
    assert not is_passive(JointCommand.servo(TUCKED_JOINTS, np.zeros(12), 1.0, 1.0))


def test_a_command_that_is_not_finite_is_named() -> None:
    with pytest.raises(CommandError, match="kp must be 12 finite numbers"):
        require_sane(replace(TAU, kp=np.full(12, np.nan)))


def test_limits_must_be_positive() -> None:
    with pytest.raises(ConfigError, match="stale_limit"):
        GuardConfig(stale_limit=0.0)
