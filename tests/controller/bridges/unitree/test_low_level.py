"""What reaches the motors of the simulated robot: good commands, or damping. Needs no DDS."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from controller.behaviours import DAMPING
from controller.bridges.unitree import messages
from controller.bridges.unitree.low_level import (
    RAMP_TIME,
    RELEASE,
    SILENCE,
    CommandGate,
    GuardConfig,
    Guards,
    is_passive,
    require_sane,
)
from controller.bridges.unitree.messages import encode_message
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.legs import Leg
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternion_from_rpy
from go2_wbc.robot.state import JointCommand, RobotState
from tests.controller.plants import Clock, is_limp, lying_state

OWN = JointCommand.torque(np.full(12, 1.5))
TICK = 0.002


def sample(
    change: Callable[[np.ndarray], None] = lambda message: None, *, sealed: bool = True
) -> bytes:
    """A good command: the front right thigh held at 0.8 rad, the rest damped; then changed."""
    message = np.zeros(1, messages.LOW_CMD)
    motors = message["motor_cmd"]
    motors["mode"][0, :12] = messages.SERVO
    motors["q"][0, :12], motors["kd"][0, :12] = messages.POSITION_STOP, 2.0
    motors["q"][0, 1], motors["kp"][0, 1], motors["tau"][0, 1] = 0.8, 30.0, 4.0
    if sealed:
        change(message)
    messages.seal(message)
    if not sealed:
        change(message)
    return encode_message(message)


def setting(name: str, motor: int, value: float) -> Callable[[np.ndarray], None]:
    def change(message: np.ndarray) -> None:
        message["motor_cmd"][name][0, motor] = value

    return change


def tick(gate: CommandGate, samples: list[bytes], own: JointCommand) -> JointCommand:
    """The command of a tick before which these samples have come."""
    gate.hear(samples)
    return gate.choose(own)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def gate(clock: Clock) -> CommandGate:
    model = RobotModel()
    return CommandGate(model.q_lower, model.q_upper, clock)


def test_a_good_command_reaches_its_motor_and_none_one_that_is_off(gate: CommandGate) -> None:
    assert tick(gate, [], OWN) is OWN
    assert not gate.is_active
    command = tick(gate, [sample()], OWN)
    thigh = 3 * Leg.FR + 1
    assert command.kp[thigh] == 30.0
    assert command.q_des[thigh] == pytest.approx(0.8)
    assert command.tau[thigh] == 4.0
    assert np.count_nonzero(command.kp) == np.count_nonzero(command.tau) == 1
    assert (command.kd == 2.0).all()
    command = tick(gate, [sample(setting("mode", 1, 0))], OWN)
    thigh = 3 * Leg.FR + 1
    assert command.kp[thigh] == command.kd[thigh] == command.tau[thigh] == 0.0


@pytest.mark.parametrize(
    ("reason", "name", "motor", "value"),
    [
        ("tau is not finite", "tau", 3, np.nan),
        ("q is not finite", "q", 1, np.inf),
        ("kp is not finite", "kp", 0, -np.inf),
        ("q out of limits", "q", 1, 9.0),
        ("kp out of limits", "kp", 1, 5000.0),
        ("kp out of limits", "kp", 1, -1.0),
        ("kd out of limits", "kd", 1, -1.0),
        ("tau out of limits", "tau", 11, 1e9),
        ("dq out of limits", "dq", 2, 500.0),
    ],
)
def test_garbage_is_refused_and_counted(
    gate: CommandGate, reason: str, name: str, motor: int, value: float
) -> None:
    assert tick(gate, [sample(setting(name, motor, value))], OWN) is OWN
    assert gate.refused == {reason: 1}
    assert gate.accepted == 0


def test_a_wrong_checksum_and_cut_off_bytes_are_refused(gate: CommandGate) -> None:
    broken = sample(setting("q", 1, 0.9), sealed=False)
    assert tick(gate, [broken, b"rubbish"], OWN) is OWN
    assert gate.refused["wrong checksum"] == 1
    assert sum(gate.refused.values()) == 2


def test_among_garbage_the_newest_good_command_counts(gate: CommandGate) -> None:
    bad = sample(setting("tau", 1, np.nan))
    command = tick(gate, [sample(setting("tau", 1, 1.0)), sample(), bad, bad], OWN)
    assert command.tau.max() == 4.0


def test_silence_damps_and_later_gives_the_robot_back(gate: CommandGate, clock: Clock) -> None:
    tick(gate, [sample()], OWN)
    clock.now = SILENCE - TICK
    assert not is_limp(tick(gate, [], OWN))
    clock.now = SILENCE + TICK
    assert is_limp(tick(gate, [], OWN))
    clock.now = RELEASE + TICK
    assert is_limp(tick(gate, [], OWN))
    assert tick(gate, [], OWN) is OWN
    assert not gate.is_active


def test_garbage_is_as_good_as_silence(gate: CommandGate, clock: Clock) -> None:
    tick(gate, [sample()], OWN)
    clock.now = SILENCE + TICK
    assert is_limp(tick(gate, [sample(setting("kp", 1, np.nan))], OWN))


def test_commands_go_on_after_a_gap(gate: CommandGate, clock: Clock) -> None:
    tick(gate, [sample()], OWN)
    clock.now = SILENCE + TICK
    assert tick(gate, [], OWN).kd[0] == DAMPING
    assert tick(gate, [sample()], OWN).kp.max() == 30.0


def test_a_closed_gate_lets_nothing_in_but_does_not_cut_off_who_is_inside(
    gate: CommandGate,
) -> None:
    gate.is_open = False
    assert tick(gate, [sample()], OWN) is OWN
    gate.is_open = True
    tick(gate, [sample()], OWN)
    gate.is_open = False
    assert tick(gate, [sample()], OWN).kp.max() == 30.0


TUCKED_JOINTS = find_profile().tucked_joints

TAU = JointCommand.torque(np.full(12, 5.0))
RAMP = RAMP_TIME


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


def test_a_robot_that_tilts_bends_too_far_or_is_not_finite_is_a_fault(guards: Guards) -> None:
    assert guards.fault(at(0.0, roll=1.1)) is None
    assert guards.fault(at(0.0, roll=1.3)) == "tilted: roll 74 deg, pitch 0 deg"
    joints = TUCKED_JOINTS.copy()
    joints[5] = -0.5
    reason = guards.fault(at(0.0, joints))
    assert reason is not None
    assert reason.startswith("joint 5 is 0.3")
    joints = TUCKED_JOINTS.copy()
    joints[0] = np.nan
    assert guards.fault(at(0.0, joints)) == "the measured state is not finite"


def test_only_damping_is_passive_and_what_is_not_finite_or_no_limit_is_refused() -> None:
    assert is_passive(JointCommand.damping(3.0))
    assert not is_passive(TAU)
    assert not is_passive(JointCommand.servo(TUCKED_JOINTS, np.zeros(12), 1.0, 1.0))
    with pytest.raises(CommandError, match="kp must be 12 finite numbers"):
        require_sane(replace(TAU, kp=np.full(12, np.nan)))
    with pytest.raises(ConfigError, match="stale_limit"):
        GuardConfig(stale_limit=0.0)
    with pytest.warns(FutureWarning, match=r"ramp_time has no effect any more: it is always 0\.5"):
        assert GuardConfig(**{"ramp_time": 1.0}) == GuardConfig()
