"""How late commands act is found from what motors give, and the state carried on by that."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.latency import KD, KP, LAGS, READ, Latency
from go2_wbc.robot.state import JointCommand, RobotState
from tests import engine_helpers as helpers

MODEL = helpers.symmetric_model()
PERIOD = 0.002
STILL = np.zeros(18)


def jagged(rng: np.random.Generator, ticks: int, step: float = 1.0) -> np.ndarray:
    """Torques [N m] that wander, as those of a walk do."""
    return np.cumsum(step * rng.normal(size=(ticks, 12)), axis=0)


def followed(
    latency: Latency, asked: np.ndarray, late: int, noise: float = 0.0, seed: int = 0
) -> None:
    """Ask for one torque after the other of motors that give each ``late`` ticks later."""
    rng, state = np.random.default_rng(seed), helpers.state_of(helpers.standing_q())
    for tick in range(len(asked)):
        acts = tick - 1 - late
        tau = asked[acts] if acts >= 0 else np.zeros(12)
        latency.ahead(replace(state, tau=tau + noise * rng.normal(size=12)))
        latency.note(asked[tick], STILL)


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("late", [0, 1, 4, LAGS - 1])
def test_the_delay_is_the_lag_at_which_motors_give_what_was_asked(late: int, noise: float) -> None:
    latency = Latency(PERIOD)
    followed(latency, jagged(np.random.default_rng(late), 500), late, noise)
    assert latency.delay == pytest.approx(late * PERIOD)


def test_a_delay_that_changes_is_found_again() -> None:
    latency, asked = Latency(PERIOD), jagged(np.random.default_rng(2), 500)
    for late in (5, 0, 3):
        followed(latency, asked, late)
        assert latency.delay == pytest.approx(late * PERIOD)


def test_which_command_has_acted_is_known_in_each_tick() -> None:
    """By the mean lag, sound motors under commands that came 0 to 18 ms late seemed weak."""
    latency, rng = Latency(PERIOD), np.random.default_rng(9)
    asked, state = jagged(rng, 1500), helpers.state_of(helpers.standing_q())
    lags = rng.integers(LAGS, size=150).repeat(10)
    for tick, late in enumerate(lags):
        latency.ahead(replace(state, tau=asked[max(tick - 1 - late, 0)]))
        if tick > 1000:
            assert latency.acted == late
        latency.note(asked[tick], STILL)


def test_what_does_not_change_or_does_not_obey_tells_nothing() -> None:
    latency, rng = Latency(PERIOD), np.random.default_rng(3)
    asked = jagged(rng, 500)
    followed(latency, np.vstack([asked, np.tile(asked[-1], (500, 1))]), 4, noise=0.02)
    assert latency.delay == pytest.approx(4 * PERIOD)
    # A robot that lay still whatever it was told was taken to move at 0.5 m/s.
    latency, rng = Latency(PERIOD), np.random.default_rng(8)
    state = helpers.state_of(helpers.standing_q())
    for tau in 10.0 + jagged(rng, 500, step=0.1):
        latency.ahead(replace(state, tau=np.zeros(12)))
        latency.note(tau, STILL)
    assert latency.delay == 0.0


def test_a_state_is_left_alone_where_commands_act_at_once_and_others_only_move_on() -> None:
    latency, state = Latency(PERIOD), helpers.random_state(np.random.default_rng(4))
    followed(latency, jagged(np.random.default_rng(5), 100), 0)
    assert latency.ahead(state) is state
    latency, state = Latency(PERIOD), helpers.random_state(np.random.default_rng(6))
    followed(latency, jagged(np.random.default_rng(7), 200), 3)
    latency.forget()
    np.testing.assert_array_equal(latency.ahead(state).v, state.v)


@pytest.mark.parametrize("late", [1, 5, 10])
def test_the_state_is_carried_on_as_the_accelerations_say(late: int) -> None:
    """Against Pinocchio's integration in a hundred times as many steps."""
    rng = np.random.default_rng(late)
    latency, state = Latency(PERIOD), helpers.random_state(rng)
    followed(latency, jagged(rng, 200), late)
    qdd = 20.0 * rng.normal(size=(LAGS, 18))
    for row in qdd:
        latency.note(np.zeros(12), row)
    found = latency.ahead(state)
    q, v, fine = state.q.copy(), state.v.copy(), 100
    for row in qdd[LAGS - late :]:
        for _ in range(fine):
            v += PERIOD / fine * row
            q = pin.integrate(MODEL.pin_model, q, PERIOD / fine * v)
    np.testing.assert_allclose(found.v, v, atol=1e-9)
    moved = pin.difference(MODEL.pin_model, q, found.q)
    assert np.abs(moved).max() < 2e-4  # of 20 mm and 0.1 rad
    assert isinstance(found, RobotState)
    assert found.time == state.time


@pytest.mark.parametrize("late", [0, 1, 2, LAGS - 1])
def test_joints_of_late_commands_are_held_about_what_is_predicted(late: int) -> None:
    rng = np.random.default_rng(late)
    latency, state = Latency(PERIOD), helpers.random_state(rng)
    followed(latency, jagged(rng, 500), late)
    ahead, qdd = MODEL.snapshot(state), 20.0 * rng.normal(size=18)
    command = JointCommand.torque(rng.normal(size=12))
    held = latency.with_servo(command, qdd, ahead)
    if late <= READ:  # by that much readings may be old
        assert held is command
        return
    v = state.v[6:] + 0.5 * PERIOD * qdd[6:]
    q = state.q[7:] + 0.5 * PERIOD * state.v[6:]
    np.testing.assert_allclose(held.asked(q, v), command.tau, atol=1e-12)
    np.testing.assert_allclose(held.asked(q + 0.01, v) - command.tau, -0.01 * KP)
    np.testing.assert_allclose(held.asked(q, v + 0.1) - command.tau, -0.1 * KD)
    latency.forget()  # of a state that was not carried on nothing is predicted
    latency.note(command.tau, qdd)
    assert latency.with_servo(command, qdd, ahead) is command
