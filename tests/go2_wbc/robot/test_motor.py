"""The motors' line: continuous, falling, mirrored; a braking motor keeps its peak.

What plants and telemetry make of it in every tick is held to numpy's interpolation of the line.
"""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.records import packed
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import (
    LEAST_SHARE,
    MOTORS,
    FrictionFeedForward,
    JointFriction,
    MotorModel,
    drive,
    note_peaks,
)
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController
from tests.engine_helpers import cases, random_state

KNEE_SHARE = find_profile().knee_share

MODEL = RobotModel()
LINE = MODEL.motor
SPEEDS = np.linspace(-1.3, 1.3, 2601)[:, None] * MODEL.speed_limits
"""(n, 12) velocities of every joint, beyond the speed without load on both sides."""
ROUNDING = 1e-9

COUNT = 1000
EXACT = 1e-12  # N m; sums in another order
ODD = JointFriction(
    dry=tuple(0.1 * (n + 1) for n in range(12)),
    viscous=tuple(0.05 * (12 - n) for n in range(12)),
    transition=0.17,
    lookahead=0.013,
)
"""No two numbers alike, so that one in another's place is seen."""


def line(motor: MotorModel, v: np.ndarray) -> np.ndarray:
    """Greatest torques at velocities ``v`` (n, 12), by interpolation between the line's corners."""
    most = np.tile(motor.peak, (len(v), 1))
    for n in np.flatnonzero(np.isfinite(motor.no_load_speed)):
        corners = np.array([motor.knee_speed[n], motor.no_load_speed[n]])
        most[:, n] = np.interp(v[:, n], corners, np.array([motor.peak[n], 0.0]))
    return most


@pytest.mark.parametrize("name", MOTORS)
def test_the_limits_are_the_line_between_its_corners(name: str) -> None:
    motor = RobotModel(motor=name).motor
    lower, upper = motor.limits(SPEEDS)
    np.testing.assert_allclose(upper, line(motor, SPEEDS), atol=EXACT)
    np.testing.assert_allclose(lower, -line(motor, -SPEEDS), atol=EXACT)


def test_limits_have_the_shape_of_the_velocities_and_no_more_power_than_a_motor_gives() -> None:
    v = SPEEDS[:24].reshape(2, 3, 4, 12)
    lower, upper = LINE.limits(v)
    assert lower.shape == upper.shape == v.shape
    np.testing.assert_array_equal(upper[1, 2, 3], LINE.limits(SPEEDS[23])[1])
    _, upper = LINE.limits(SPEEDS)
    most = LINE.limits(LINE.no_load_speed / 2)[1] * LINE.no_load_speed / 2
    assert ((upper * SPEEDS).max(axis=0) <= most + ROUNDING).all()
    np.testing.assert_allclose(most, 324.2, atol=0.1)  # of hip, thigh and calf alike


def test_the_numbers_are_the_descriptions_and_the_calf_is_a_hip_behind_a_linkage() -> None:
    np.testing.assert_array_equal(LINE.peak, MODEL.description.efforts)
    np.testing.assert_array_equal(LINE.no_load_speed, MODEL.description.speeds)
    np.testing.assert_allclose(LINE.knee_speed, KNEE_SHARE * MODEL.speed_limits)
    np.testing.assert_array_equal(MODEL.torque_limits, LINE.peak)
    # The module's docstring says so: the ratio of torques is that of speeds.
    by_torque, by_speed = LINE.peak[2] / LINE.peak[0], LINE.no_load_speed[0] / LINE.no_load_speed[2]
    assert by_torque == pytest.approx(by_speed, rel=1e-3)


def test_a_share_scales_the_whole_line_and_is_one_on_it() -> None:
    for whole, part in zip(LINE.limits(SPEEDS), LINE.scaled(0.4).limits(SPEEDS), strict=True):
        np.testing.assert_allclose(part, 0.4 * whole)
    v = 0.7 * MODEL.speed_limits
    lower, upper = LINE.limits(v)
    np.testing.assert_allclose(LINE.share(upper, v), 1.0)
    np.testing.assert_allclose(LINE.share(lower / 2, v), 0.5)
    np.testing.assert_allclose(LINE.share(LINE.peak, LINE.no_load_speed), 1 / LEAST_SHARE)


def test_a_torque_is_that_of_the_servo_cut_to_the_line() -> None:
    rng = np.random.default_rng(1)
    tau, q_des, v_des = rng.normal(size=(3, 12))
    command = JointCommand(tau, q_des, v_des, np.full(12, 7.0), np.full(12, 0.5))
    q, v = rng.normal(size=12), rng.normal(size=12)
    wanted = command.tau + 7.0 * (command.q_des - q) + 0.5 * (command.v_des - v)
    np.testing.assert_allclose(LINE.torque(command, q, v), wanted)
    strong = JointCommand.torque(np.full(12, 1000.0))
    fast = 0.9 * MODEL.speed_limits
    np.testing.assert_array_equal(LINE.torque(strong, q, fast), LINE.limits(fast)[1])
    np.testing.assert_array_equal(LINE.torque(strong, q, -fast), LINE.peak)


def test_an_unknown_motor_is_refused_with_the_names_that_exist() -> None:
    with pytest.raises(ConfigError, match=r"unknown motor 'perfect'; valid: ideal, torque-speed"):
        MotorModel.named("perfect", MODEL.description)
    with pytest.raises(ConfigError, match="valid: ideal, torque-speed"):
        RobotModel(motor="perfect")


@pytest.mark.parametrize("name", MOTORS)
def test_a_plant_is_driven_by_the_servos_torque_cut_to_the_line(name: str) -> None:
    motor, rng = RobotModel(motor=name).motor, np.random.default_rng(31)
    cut = 0
    for _ in range(COUNT):
        places = np.array([rng.permutation(20)[:12] for _ in range(3)])
        qpos, qvel, ctrl = rng.normal(size=20), 15.0 * rng.normal(size=20), np.zeros(20)
        rows = rng.normal(size=(5, 12)) * np.array([[30.0], [1.0], [5.0], [20.0], [2.0]])
        total = rng.normal(size=12)
        before = total.copy()
        drive(rows, packed(motor), places, qpos, qvel, ctrl, total)
        q, v = qpos[places[0]], qvel[places[1]]
        tau, q_des, v_des, kp, kd = rows
        most, least = line(motor, v[None])[0], -line(motor, -v[None])[0]
        asked = tau + kp * (q_des - q) + kd * (v_des - v)
        expected = np.clip(asked, least, most)
        np.testing.assert_allclose(ctrl[places[2]], expected, atol=EXACT, rtol=0)
        np.testing.assert_allclose(total, before + expected, atol=EXACT, rtol=0)
        np.testing.assert_allclose(motor.torque(JointCommand(*rows), q, v), expected, atol=EXACT)
        assert np.count_nonzero(ctrl) == np.count_nonzero(expected)
        cut += bool(((expected != asked) & (most - least > 0.0)).any())
    assert cut > COUNT / 10


@pytest.mark.parametrize("name", MOTORS)
def test_peaks_are_those_of_all_ticks_so_far(name: str) -> None:
    motor, rng = RobotModel(motor=name).motor, np.random.default_rng(32)
    tau, v, before = (size * rng.normal(size=(COUNT, 12)) for size in (15.0, 12.0, 12.0))
    peaks = np.zeros((3, 12))
    for rows in zip(tau, v, before, strict=True):
        note_peaks(*rows, packed(motor), peaks)
    most = np.where(tau < 0.0, line(motor, -before), line(motor, before))
    shares = np.abs(tau) / np.maximum(most, LEAST_SHARE * motor.peak)
    expected = [np.abs(tau), np.abs(v), shares]
    np.testing.assert_allclose(peaks, [rows.max(axis=0) for rows in expected], rtol=EXACT)


def turning(state: RobotState, rng: np.random.Generator) -> RobotState:
    """The same with joints as fast as in a jump."""
    speeds = 0.9 * MODEL.speed_limits * rng.uniform(-1.0, 1.0, 12)
    return replace(state, v=np.concatenate([state.v[:6], speeds]))


def test_friction_is_by_part_and_given_at_rest_only_to_move() -> None:
    friction, rest = JointFriction(), np.zeros(12)
    assert not friction.torque(rest, rest).any()
    started = friction.torque(rest, np.full(12, 20.0))
    assert (started > 0.9 * np.array(friction.dry)).all()
    friction = JointFriction.by_part((0.1, 0.2, 0.9), (0.0, 0.1, 0.3))
    assert friction.dry == (0.1, 0.2, 0.9) * 4
    assert friction.viscous == (0.0, 0.1, 0.3) * 4


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"dry": (0.2, 0.2, 0.2)}, r"JointFriction\.dry must be 12 numbers, got 3"),
        ({"viscous": (-0.1,) * 12}, r"JointFriction\.viscous must be at least 0"),
        ({"dry": (float("nan"),) * 12}, r"JointFriction\.dry must be at least 0"),
        ({"transition": 0.0}, r"JointFriction\.transition must be positive"),
        ({"lookahead": -0.01}, r"JointFriction\.lookahead must be at least 0"),
    ],
)
def test_a_number_out_of_range_is_refused(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        replace(JointFriction(), **wrong)


def test_the_motors_get_torque_and_friction_within_their_line() -> None:
    rng = np.random.default_rng(31)
    feed_forward = FrictionFeedForward(ODD, MODEL.motor)
    saturated = 0
    for _ in range(300):
        snapshot = MODEL.snapshot(turning(random_state(rng), rng))
        qdd, tau = rng.normal(scale=20.0, size=18), rng.normal(scale=20.0, size=12)
        v = snapshot.state.joint_velocities
        soon = v + ODD.lookahead * qdd[6:]
        friction = ODD.dry * np.tanh(soon / ODD.transition) + ODD.viscous * v
        lower, upper = MODEL.motor.limits(v)
        motors = feed_forward.motor_torques(snapshot, qdd, tau)
        np.testing.assert_allclose(motors, np.clip(tau + friction, lower, upper), atol=EXACT)
        np.testing.assert_allclose(ODD.torque(v, qdd[6:]), friction, atol=EXACT)
        is_slowed = upper - lower < 2.0 * MODEL.torque_limits
        saturated += int(is_slowed[(motors == lower) | (motors == upper)].sum())
    assert saturated > 100, "or the line is not tested"


@pytest.mark.parametrize("backend", ["condensed", "full", "placo"])
def test_every_back_end_feeds_the_same_friction_forward(backend: str) -> None:
    wbc = WholeBodyController(MODEL, backend, replace(WbcConfig(), joint_friction=ODD))
    for snapshot, reference in cases(MODEL, 20, seed=32):
        solution = wbc.solve(snapshot, reference, relax=True)
        friction = ODD.torque(snapshot.state.joint_velocities, solution.qdd[6:])
        limits = MODEL.motor.limits(snapshot.state.joint_velocities)
        expected = np.clip(solution.tau + friction, *limits)
        np.testing.assert_allclose(solution.tau_motors, expected, atol=EXACT)
        np.testing.assert_array_equal(solution.command.tau, solution.tau_motors)


@pytest.mark.parametrize("share", [1.0, 0.6])
def test_friction_asks_no_motor_for_more_than_it_gives_at_its_speed(share: float) -> None:
    """Added after the QP, it once went beyond the line of a motor that was at it already."""
    friction = JointFriction.by_part((3.0, 3.0, 3.0))
    config = replace(WbcConfig(), joint_friction=friction, torque_share=share)
    wbc, motor = WholeBodyController(MODEL, config=config), MODEL.motor.scaled(share)
    cut, rng = 0, np.random.default_rng(35)
    for slow, reference in cases(MODEL, 40, seed=34):
        snapshot = MODEL.snapshot(turning(slow.state, rng))
        solution = wbc.solve(snapshot, reference, relax=True)
        v = snapshot.state.joint_velocities
        asked = solution.tau + friction.torque(v, solution.qdd[6:])
        cut += int((motor.share(asked, v) > 1.0).sum())
        assert motor.share(solution.tau_motors, v).max() <= 1.0
    assert cut > 10, "or nothing is cut"


@pytest.mark.parametrize("backend", ["condensed", "full"])
def test_without_friction_the_motors_get_the_torques_of_the_dynamics(backend: str) -> None:
    config = replace(WbcConfig(), joint_friction=JointFriction.none())
    wbc = WholeBodyController(MODEL, backend, config)
    for snapshot, reference in cases(MODEL, 5, seed=33):
        solution = wbc.solve(snapshot, reference, relax=True)
        np.testing.assert_allclose(solution.tau_motors, solution.tau, atol=EXACT)
