"""Friction fed forward: what the model says, within the limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.robot.joint_friction import FrictionFeedForward, JointFriction
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController
from tests.engine_helpers import cases, random_state

MODEL = RobotModel()
ROUNDING = 1e-12  # [N m] of sums below 50
ODD = JointFriction(
    dry=tuple(0.1 * (n + 1) for n in range(12)),
    viscous=tuple(0.05 * (12 - n) for n in range(12)),
    transition=0.17,
    lookahead=0.013,
)
"""No two numbers alike, so that one in another's place is seen."""


def turning(state: RobotState, rng: np.random.Generator) -> RobotState:
    """The same with joints as fast as in a jump."""
    speeds = 0.9 * MODEL.speed_limits * rng.uniform(-1.0, 1.0, 12)
    return replace(state, v=np.concatenate([state.v[:6], speeds]))


def test_a_joint_at_rest_gets_friction_only_if_it_shall_move() -> None:
    friction, rest = JointFriction(), np.zeros(12)
    assert not friction.torque(rest, rest).any()
    started = friction.torque(rest, np.full(12, 20.0))
    assert (started > 0.9 * np.array(friction.dry)).all()


def test_by_part_repeats_hip_thigh_and_calf_for_every_leg() -> None:
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
        np.testing.assert_allclose(motors, np.clip(tau + friction, lower, upper), atol=ROUNDING)
        np.testing.assert_allclose(ODD.torque(v, qdd[6:]), friction, atol=ROUNDING)
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
        np.testing.assert_allclose(solution.tau_motors, expected, atol=ROUNDING)
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
        np.testing.assert_allclose(solution.tau_motors, solution.tau, atol=ROUNDING)
