"""What a learner sees and does: order, units, limits, and actions that mean what they say."""

import math
from pathlib import Path

import numpy as np
import pytest

from controller.observation import (
    ACTIONS,
    OBSERVATION,
    STANCE,
    STANCE_HEIGHT,
    TARGETS,
    TORQUES,
    Actuation,
    observed,
)
from go2_wbc.errors import CommandError
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.state import RobotState

LIMITS = np.linspace(10.0, 45.0, 12)


def state_of(quaternion: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)) -> RobotState:
    rng = np.random.default_rng(0)
    q = np.concatenate([[0.0, 0.0, STANCE_HEIGHT], quaternion, rng.uniform(-2.0, 2.0, 12)])
    zeros = np.zeros(4)
    return RobotState(0.0, q, rng.uniform(-1.0, 1.0, 18), np.zeros(12), zeros, zeros > 0.0)


def seen(state: RobotState) -> dict[str, np.ndarray]:
    row = observed(OBSERVATION, state, np.array([0.5, -0.1, 0.2]), 0.25, np.full(12, 0.3))
    return OBSERVATION.split(row)


def test_every_number_stands_where_the_layout_says() -> None:
    state = state_of()
    terms = seen(state)
    assert sum(len(term) for term in terms.values()) == OBSERVATION.size == len(OBSERVATION.parts)
    for name, values in (
        ("linear_velocity", state.v[:3]),
        ("angular_velocity", state.v[3:6]),
        ("command", [0.5, -0.1, 0.2]),
        ("clock", [1.0, 0.0]),
        ("joint_positions", state.q[7:]),
        ("joint_velocities", state.v[6:]),
        ("last_action", np.full(12, 0.3)),
    ):
        np.testing.assert_allclose(terms[name], values, atol=1e-6, err_msg=name)
    place = OBSERVATION.parts.index(f"joint_positions.{JOINT_NAMES[4]}")
    assert place == OBSERVATION.slices["joint_positions"].start + 4


def test_gravity_is_seen_from_the_base() -> None:
    roll = math.radians(30.0)
    tilted = state_of((math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2)))
    down = rotation_from_rpy(roll, 0.0, 0.0).T @ [0.0, 0.0, -1.0]
    np.testing.assert_allclose(seen(tilted)["gravity"], down, atol=1e-6)


def test_what_is_out_of_all_bounds_is_cut() -> None:
    state = state_of()
    state.v[6:] = 1e6
    row = observed(OBSERVATION, state, np.zeros(3), 0.0, np.zeros(12))
    assert np.abs(row).max() <= OBSERVATION.limits.max()
    assert (np.abs(row) <= OBSERVATION.limits).all()


def test_terms_are_chosen_by_name_and_others_named_in_the_error() -> None:
    layout = OBSERVATION.chosen(["gravity", "command"])
    assert layout.parts == (
        *("gravity.x", "gravity.y", "gravity.z"),
        *("command.linear_x", "command.linear_y", "command.angular_z"),
    )
    assert layout.units == ("1", "1", "1", "m/s", "m/s", "rad/s")
    for wrong in (["height"], [], ["gravity", "gravity"]):
        with pytest.raises(CommandError, match="term"):
            OBSERVATION.chosen(wrong)
    for name in OBSERVATION.names:
        assert name in OBSERVATION.table()


@pytest.mark.parametrize("kind", [TARGETS, TORQUES])
def test_an_action_means_what_it_was_made_of(kind: str) -> None:
    actuation = Actuation(kind, LIMITS)
    action = np.random.default_rng(1).uniform(-1.0, 1.0, 12)
    command = actuation.command(action)
    meant = command.tau if kind == TORQUES else command.q_des
    np.testing.assert_allclose(actuation.action(meant), action, atol=1e-6)
    assert (np.abs(actuation.action(100.0 * LIMITS)) == ACTIONS[kind].limits).all()


def test_targets_are_pursued_by_the_servo_and_torques_by_none() -> None:
    servo = Actuation(TARGETS, LIMITS, kp=30.0, kd=0.5).command(np.zeros(12))
    assert (servo.kp == 30.0).all()
    assert (servo.kd == 0.5).all()
    assert (servo.q_des == np.tile(STANCE, 4)).all()
    torque = Actuation(TORQUES, LIMITS).command(np.full(12, 3.0))
    assert (torque.tau == LIMITS).all()
    assert not torque.kp.any()
    with pytest.raises(CommandError, match="targets"):
        Actuation("speeds", LIMITS)


def test_the_page_for_learners_names_every_term_with_its_size_and_units() -> None:
    page = Path(__file__).parents[2].joinpath("docs/how-to/learning.md").read_text("utf-8")
    for term in OBSERVATION.terms:
        units = ", ".join(term.units if len(set(term.units)) > 1 else term.units[:1])
        assert f"| `{term.name}` | {term.size} | {units} |" in page
    assert f"\n{OBSERVATION.size} numbers" in page


def test_in_the_stance_the_feet_touch_the_ground_below_the_hips() -> None:
    model = RobotModel()
    q = np.array([0.0, 0.0, STANCE_HEIGHT, 0.0, 0.0, 0.0, 1.0, *STANCE * 4])
    feet = model.snapshot(
        RobotState(0.0, q, np.zeros(18), np.zeros(12), np.zeros(4), np.zeros(4) > 0.0)
    )
    soles = feet.p_world_feet[:, 2] - feet.foot_radius
    assert np.abs(soles).max() < 0.005
    assert np.abs(feet.p_world_feet[:, 0] - model.p_base_hips[:, 0]).max() < 0.03
