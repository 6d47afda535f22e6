"""A policy sees and does the same in every layout, and gives nothing that is not finite."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.policies import laid_out
from controller.policies import TROT, Policy, Sidecar
from controller.policies.policy import Player
from go2_wbc.errors import MissingDependency, PolicyError
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState
from tests.controller.policies.layouts import ISAAC_LAB, SIDECAR, UNITREE
from tests.engine_helpers import random_state

COMMAND = VelocityCommand(0.4, -0.1, 0.2)
WIDE = np.full(12, 10.0)
ROUNDING = 1e-9


def linear(seed: int, side: Sidecar = SIDECAR) -> Policy:
    """A policy that is any linear function."""
    W = np.random.default_rng(seed).normal(scale=0.1, size=(12, side.observation_size))
    return Policy("linear", side, lambda x: W @ x)


def seeing(side: Sidecar) -> Player:
    """One that is asked for observations only."""
    return Player(linear(0, side), -WIDE, WIDE)


def states(n: int) -> list[RobotState]:
    rng = np.random.default_rng(3)
    return [replace(random_state(rng), time=0.02 * i) for i in range(n)]


def commands(policy: Policy) -> list[JointCommand]:
    player = Player(policy, -WIDE, WIDE)
    return [player.command(state, COMMAND) for state in states(5)]


@pytest.mark.parametrize("order", [ISAAC_LAB, UNITREE], ids=["isaac-lab", "unitree"])
@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_a_policy_does_the_same_in_another_order_with_other_signs_and_scales(
    order: np.ndarray, factor: float
) -> None:
    policy, rng = linear(1), np.random.default_rng(2)
    signs, scales = rng.choice([-1.0, 1.0], size=12), rng.uniform(0.2, 5.0, len(SIDECAR.terms))
    other = laid_out(policy, order, signs, scales, factor)
    for own, same in zip(commands(policy), commands(other), strict=True):
        for part in ("q_des", "v_des", "tau", "kp", "kd"):
            np.testing.assert_allclose(getattr(own, part), getattr(same, part), atol=ROUNDING)


def test_an_observation_holds_each_term_by_its_meaning() -> None:
    state, observer = states(1)[0], seeing(replace(SIDECAR, order=ISAAC_LAB))
    observer.restart(0.3)
    observer.action = np.arange(12).astype(float)
    row = observer.observe(state, COMMAND)
    parts = np.split(row, np.cumsum([len(term.scale) for term in SIDECAR.terms])[:-1])
    assert (parts[0] == state.v[:3]).all()
    assert (parts[1] == state.v[3:6]).all()
    np.testing.assert_allclose(state.R_world_base @ parts[2], [0.0, 0.0, -1.0], atol=ROUNDING)
    assert parts[3].tolist() == [0.4, -0.1, 0.2]
    joints = state.joint_positions[ISAAC_LAB]
    np.testing.assert_allclose(parts[4] + SIDECAR.default, joints, atol=ROUNDING)
    assert (parts[5] == state.joint_velocities[ISAAC_LAB]).all()
    assert (parts[6] == np.arange(12)).all()
    np.testing.assert_allclose(parts[7], [np.sin(0.6 * np.pi), np.cos(0.6 * np.pi)])


def test_the_clock_goes_on_with_its_frequency_and_has_a_sine_and_cosine_for_each_offset() -> None:
    term = replace(SIDECAR.terms[-1], offsets=(0.0, 0.5), scale=np.ones(4))
    observer = seeing(replace(SIDECAR, terms=(term,)))
    first, second = (observer.observe(state, COMMAND) for state in states(2))
    np.testing.assert_allclose(first, [0.0, 1.0, 0.0, -1.0], atol=ROUNDING)
    turn = 2.0 * np.pi * 2.5 / 50.0
    expected = [np.sin(turn), np.cos(turn), -np.sin(turn), -np.cos(turn)]
    np.testing.assert_allclose(second, expected, atol=ROUNDING)


@pytest.mark.parametrize("oldest_first", [True, False])
@pytest.mark.parametrize("by_terms", [True, False])
def test_a_history_stands_as_the_sidecar_says(by_terms: bool, oldest_first: bool) -> None:
    side = replace(SIDECAR, history=3, by_terms=by_terms, oldest_first=oldest_first)
    single, observer = seeing(SIDECAR), seeing(side)
    rows = [single.observe(state, COMMAND) for state in states(4)]
    seen = [observer.observe(state, COMMAND) for state in states(4)]
    ends = np.cumsum([len(term.scale) for term in SIDECAR.terms])[:-1]
    for i, observation in enumerate(seen):
        chosen = [rows[max(j, 0)] for j in (i - 2, i - 1, i)]
        table = np.array(chosen if oldest_first else chosen[::-1])
        parts = [part.ravel() for part in np.split(table, ends, axis=1)]
        expected = np.concatenate(parts) if by_terms else table.ravel()
        np.testing.assert_array_equal(observation, expected)


def test_what_goes_in_and_comes_out_is_clipped() -> None:
    side = replace(SIDECAR, observation_clip=0.5, action_clip=0.2)
    assert np.abs(seeing(side).observe(states(1)[0], COMMAND)).max() == 0.5
    assert np.abs(linear(1, side).act(np.full(side.observation_size, 10.0))).max() == 0.2


def test_targets_stay_within_the_joints_limits_and_are_held_for_a_period() -> None:
    model = RobotModel()
    far = Policy("far", SIDECAR, lambda x: np.full(12, 50.0) * np.sign(x[0]))
    player = Player(far, model.q_lower, model.q_upper)
    state = replace(states(1)[0], v=np.ones(18))
    assert (player.command(state).q_des == model.q_upper).all()
    back = replace(state, v=-np.ones(18))
    held = player.command(replace(back, time=state.time + 0.018))
    assert (held.q_des == model.q_upper).all()
    assert (player.command(replace(back, time=state.time + 0.02)).q_des == model.q_lower).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_action_that_is_not_finite_is_refused(bad: float) -> None:
    policy = Policy("broken", SIDECAR, lambda _: np.full(12, bad))
    with pytest.raises(PolicyError, match=r"policy broken gave \[(nan|inf)"):
        policy.act(np.zeros(SIDECAR.observation_size))


def test_the_file_that_comes_with_the_project_is_small_and_gives_12_actions() -> None:
    policy = Policy.load(TROT)
    assert TROT.stat().st_size < 300_000
    assert policy.act(np.zeros(policy.sidecar.observation_size)).shape == (12,)


def _shorter(text: str) -> str:
    return text.replace('    { name = "gravity" },\n', "")


@pytest.mark.parametrize(
    ("change", "network", "said"),
    [
        (_shorter, TROT.read_bytes(), r"takes 50 numbers, its sidecar describes 47"),
        (str, b"no network", r"is no network that onnxruntime can run"),
    ],
)
def test_files_that_do_not_fit_each_other_are_refused(
    change: Callable[[str], str], network: bytes, said: str, tmp_path: Path
) -> None:
    text = TROT.with_suffix(".toml").read_text(encoding="utf-8")
    (tmp_path / "a.toml").write_text(change(text), encoding="utf-8")
    (tmp_path / "a.onnx").write_bytes(network)
    with pytest.raises(PolicyError, match=said):
        Policy.load(tmp_path / "a.onnx")


def test_a_file_that_is_not_there_is_named() -> None:
    with pytest.raises(PolicyError, match=r"there is no policy absent\.onnx"):
        Policy.load("absent.onnx")


def test_without_onnxruntime_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(MissingDependency, match=r'pip install "go2-wbc\[policies\]"'):
        Policy.load(TROT)
