"""A learned policy walks under the same safety as a gait, and hands over from and to the WBC."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.robots import menagerie_go2
from controller import GO2Controller, Mode
from controller.behaviours.learned import HAND_OVER
from controller.behaviours.walking import Walking
from controller.policies import TROT, Policy, probe
from go2_wbc.errors import CommandError, ModeError, PolicyError
from go2_wbc.legs import Leg
from go2_wbc.planning.locomotion import LocomotionPlanner
from go2_wbc.plant import MujocoPlant
from tests.controller.plants import WatchedPlant

OTHERS = sorted((Path(__file__).parent / "policies/others").glob("*.onnx"))
SPEED = 0.5  # m/s
STRIDE = 0.36  # s, of the cloned trot
PHASES = 20
SWAY = 0.1  # rad: twice the tilt of a trot on estimated states
SLACK = 0.1  # share of the speed by which the clone may be off


@pytest.fixture(scope="module")
def policy() -> Policy:
    return Policy.load(TROT)


@pytest.fixture
def walking(go2: GO2Controller, policy: Policy) -> GO2Controller:
    """Follows ``SPEED`` by the policy."""
    assert go2.walk(policy=policy)
    go2.move(SPEED)
    go2.wait(1.0)
    return go2


def broken(policy: Policy, network: Callable[[np.ndarray], np.ndarray]) -> Policy:
    return Policy("broken.onnx", policy.sidecar, network)


def test_a_policy_walks_as_it_is_told_by_its_servos_and_comes_to_rest_by_the_wbc(
    plant: WatchedPlant, walking: GO2Controller, policy: Policy
) -> None:
    kp, kd = policy.sidecar.kp, policy.sidecar.kd
    assert (plant.commands[-1].kp == kp).all()
    assert (plant.commands[-1].kd == kd).all()
    assert not plant.commands[-1].tau.any()
    walking.wait(1.0)
    recorded = walking.recording()
    last = recorded.time > recorded.time[-1] - 1.0
    assert set(np.array(recorded.labels)[last]) == {"policy"}
    way = np.diff(recorded.p_world_com[last][[0, -1]], axis=0)
    speed = np.linalg.norm(way) / np.ptp(recorded.time[last])
    assert speed == pytest.approx(SPEED, rel=SLACK)
    walking.stop()
    assert walking.last_outcome.ok
    assert walking.mode is Mode.WALKING
    assert not plant.commands[-1].kp.any()
    assert np.linalg.norm(walking.state.v[:3]) < 0.02


def test_without_a_command_the_wbc_stands_and_after_walk_it_trots_again(
    plant: WatchedPlant, go2: GO2Controller, policy: Policy
) -> None:
    assert go2.walk(policy=policy)
    assert not plant.commands[-1].kp.any()
    go2.move(SPEED)
    go2.wait(0.3)
    assert plant.commands[-1].kp.all()
    assert go2.walk()
    assert not plant.commands[-1].kp.any()
    assert go2.command.linear_x == SPEED
    assert go2.stand()


@pytest.mark.parametrize("sensors", ["ideal", "imu"])
def test_each_hands_over_to_the_other_at_every_phase_of_a_trot(
    sensors: str, policy: Policy
) -> None:
    tilts = [0.0]
    with GO2Controller(
        plant=(plant := MujocoPlant(sensors=sensors, seed=1)),
        after_tick=lambda: tilts.append(plant.truth().tilt),
    ) as go2:
        assert go2.walk()
        go2.move(SPEED)
        go2.wait(1.0)
        for _ in range(PHASES):  # that a call takes is no whole number of strides
            assert go2.walk(policy=policy)
            go2.wait(STRIDE / PHASES)
            assert go2.walk()
        assert go2.mode is Mode.WALKING
        assert max(tilts) < SWAY


def test_while_it_is_handed_over_the_torques_pass_from_one_to_the_other(
    plant: WatchedPlant, go2: GO2Controller, policy: Policy
) -> None:
    assert go2.walk()
    go2.move(SPEED)
    go2.wait(0.5)
    before = len(plant.commands)
    assert go2.walk(policy=policy)
    shares = np.array([command.kp / policy.sidecar.kp for command in plant.commands[before:]])
    assert (np.ptp(shares, axis=1) < 1e-12).all()
    steps = np.diff(shares[:, 0])
    assert shares[-1, 0] == 1.0
    with pytest.raises(ModeError, match="nothing to explain"):
        go2.explain()
    assert (steps >= 0.0).all()
    assert steps.max() == pytest.approx(plant.control_period / HAND_OVER)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_policy_that_gives_no_numbers_is_refused_and_the_wbc_lets_the_robot_come_to_rest(
    plant: WatchedPlant,
    walking: GO2Controller,
    policy: Policy,
    bad: float,
    caplog: pytest.LogCaptureFixture,
) -> None:
    calls = iter(range(10**6))
    sick = broken(policy, lambda x: policy.network(x) * (bad if next(calls) > 20 else 1.0))
    assert walking.walk(policy=sick)
    walking.wait(1.5)
    assert not walking.last_outcome
    assert "policy broken.onnx gave [" in walking.last_outcome.reason
    assert "the whole-body controller takes over" in caplog.text
    assert walking.mode is Mode.WALKING
    assert np.linalg.norm(walking.state.v[:3]) < 0.1
    assert np.isfinite([command.numbers() for command in plant.commands]).all()
    assert walking.move_forward(0.3)


def test_a_goal_that_a_policy_cannot_end_is_not_done(go2: GO2Controller, policy: Policy) -> None:
    calls = iter(range(10**6))
    sick = broken(policy, lambda x: policy.network(x) * (np.nan if next(calls) > 20 else 1.0))
    assert go2.walk(policy=sick)
    assert not go2.move_forward(1.0)
    assert "policy broken.onnx gave [nan" in go2.last_outcome.reason


def test_a_policy_that_lets_the_robot_fall_is_told_of(go2: GO2Controller, policy: Policy) -> None:
    assert go2.walk(policy=broken(policy, lambda _: np.tile([0.0, 4.0, -4.0], 4)))
    go2.move(SPEED)
    go2.wait(3.0)
    assert go2.mode is Mode.FALLEN
    assert "fell at t=" in go2.last_outcome.reason
    assert go2.recover()


def test_commands_are_kept_within_what_the_policy_was_trained_on(
    walking: GO2Controller, caplog: pytest.LogCaptureFixture
) -> None:
    walking.move(1.3, 0.2)
    assert walking.command.linear_x == 1.0
    assert walking.command.angular_z == 0.2
    assert "the envelope of policy trot.onnx is -0.2 to 1 m/s ahead" in caplog.text
    with pytest.raises(CommandError, match=r"policy trot\.onnx takes no pose of the trunk"):
        walking.move(0.3, height=-0.03)
    assert walking.walk()
    walking.move(1.3, height=-0.03)
    assert walking.command.linear_x == 1.3


def test_a_policy_of_another_robot_and_a_thing_that_is_none_are_refused(
    go2: GO2Controller, policy: Policy
) -> None:
    other = Policy("a1.onnx", replace(policy.sidecar, robot="a1"), policy.network)
    with pytest.raises(PolicyError, match=r"policy a1\.onnx is for a1, the plant is go2"):
        go2.walk(policy=other)
    with pytest.raises(PolicyError, match=r"there is no policy absent\.onnx"):
        go2.walk(policy="absent.onnx")
    with pytest.raises(CommandError, match="policy"):
        go2.walk(policy=3)  # type: ignore[arg-type]
    assert go2.mode is Mode.LYING


@pytest.mark.parametrize("path", [TROT, *OTHERS], ids=lambda path: path.stem)
def test_a_policy_of_anybody_walks_and_hands_over(path: Path, go2: GO2Controller) -> None:
    assert go2.walk(policy=path)
    go2.move(SPEED)
    go2.wait(1.5)
    before = go2.state.p_world_base.copy()
    go2.wait(3.0)
    speed = np.linalg.norm(go2.state.p_world_base - before) / 3.0
    assert speed == pytest.approx(SPEED, rel=2.0 * SLACK)
    assert go2.walk()
    go2.wait(1.0)
    assert go2.mode is Mode.WALKING


@pytest.mark.parametrize("path", [TROT, *OTHERS], ids=lambda path: path.stem)
@pytest.mark.parametrize("sensors", ["ideal", "imu"])
def test_a_policy_walks_in_another_authors_file_whose_joints_brake(
    path: Path, sensors: str
) -> None:
    # With 2 N m s/rad, as Menagerie has it, the clone's legs hardly swung: it fell.
    plant = MujocoPlant(menagerie_go2(), sensors=sensors)
    with GO2Controller(plant=plant) as go2:
        assert go2.walk(policy=path)
        go2.move(SPEED)
        go2.wait(2.0)
        before, since = plant.truth().q[:2], plant.time
        go2.wait(4.0)
        speed = np.linalg.norm(plant.truth().q[:2] - before) / (plant.time - since)
        assert go2.last_outcome.ok
        go2.stop()
        assert go2.last_outcome.ok
    assert speed == pytest.approx(SPEED, rel=0.2)


@pytest.mark.parametrize("path", OTHERS, ids=lambda path: path.stem)
def test_a_policy_of_others_is_not_accused(path: Path) -> None:
    assert probe(Policy.load(path))


def test_the_shadow_of_a_policy_keeps_in_step_with_its_feet(policy: Policy) -> None:
    plant, phases, contact = MujocoPlant(), [], [True, True]
    planner: LocomotionPlanner | None = None

    def look() -> None:
        contact[:] = contact[1], bool(plant.truth().feet_in_contact[Leg.FL])
        if planner is not None and contact == [False, True]:
            phases.append((planner.phase + 0.5) % 1.0 - 0.5)

    with GO2Controller(plant=plant, after_tick=look) as go2:
        assert go2.walk(policy=policy)
        go2.move(SPEED)
        go2.wait(1.5)
        behaviour = go2._runner.loop.behaviour
        assert isinstance(behaviour, Walking)
        planner = behaviour._planner
        go2.wait(4.0)
    assert len(phases) > 8
    assert np.abs(phases).max() < 0.1
