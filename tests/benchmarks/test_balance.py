"""A sample of every row of ``balance``, and that what judges a fall sees one."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from benchmarks import balance, disturbed
from benchmarks.balance import (
    commanded,
    dropped,
    heading_force,
    impulse_at,
    measure_course,
    trots_on,
)
from benchmarks.robots import PUSH_TIME, UNTOLD, plant_of
from benchmarks.study import IMU, TrialResult, chosen_studies
from controller.modes import Mode
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.safety import FallDetector, SafetyConfig
from tests.unchecked import run_trials


def measured(name: str, seed: int) -> dict[str, float]:
    (study,) = chosen_studies(balance.STUDIES, [name])
    return study.run(seed).values


@pytest.mark.parametrize(
    ("angle", "impulse"), [(0.0, 45.0), (math.pi, 45.0), (math.pi / 2, 36.0), (-math.pi / 2, 36.0)]
)
def test_a_push_has_the_impulse_of_its_direction(angle: float, impulse: float) -> None:
    assert impulse_at(angle) == pytest.approx(impulse)
    force = heading_force(angle, impulse)
    assert np.linalg.norm(force) * PUSH_TIME == pytest.approx(impulse)
    assert math.atan2(force[1], force[0]) == pytest.approx(angle)


def test_a_drop_begins_above_the_floor() -> None:
    plant = dropped(7)
    lowest = plant.data.geom_xpos[plant.model.geom_bodyid > 0, 2].min()
    assert 0.1 <= lowest <= 0.5
    assert plant.base_contact_force == 0.0
    plant.close()


@pytest.mark.parametrize(
    ("name", "seed"),
    [("recover", 1), ("sensed-recover", 1), ("sensed-gaits", 9), ("sensed-stand-90", 1)],
)
def test_a_robot_stands_again(name: str, seed: int, tmp_path: Path) -> None:
    assert run_trials("balance", name, [seed], tmp_path)[name][seed].values[name] == 1.0


@pytest.mark.parametrize(("seed", "phase", "side"), [(0, 5, 1.0), (1, 4, 1.0), (4, 12, -1.0)])
def test_a_trot_holds_a_push_by_a_fifth_harder_than_is_asked(
    seed: int, phase: int, side: float
) -> None:
    # With all the weight on the attitude the legs in the air were swung aside, and it fell here.
    angle, impulse = balance.TROT_PUSHES["lateral"]
    with TrialRobot(plant_of(Trial(seed), 41000, UNTOLD)) as robot:
        assert trots_on(robot, phase, heading_force(side * angle, 1.2 * impulse))


def test_random_commands_are_followed_and_what_falls_is_not() -> None:
    trial, followed, thrown = Trial(1, sensors=IMU), TrialResult(), TrialResult()
    measure_course(trial, followed, commanded, 4)
    assert followed.values == {"": 1.0, "failures": 0.0}
    measure_course(trial, thrown, _thrown, 4)
    assert thrown.values[""] == 0.25


def _thrown(robot: TrialRobot, _rng: np.random.Generator, _count: int) -> Iterator[float]:
    yield 0.1
    robot.push(np.array([0.0, 900.0, 0.0]), PUSH_TIME)
    yield 2.0


@pytest.mark.parametrize("name", ["disturbed", "sensed-disturbed"])
def test_a_disturbed_robot_says_in_time_that_it_has_fallen(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disturbed, "CALLS", 2)
    values = measured(name, 2)
    assert values[f"{name}.delay"] <= 0.2
    assert values[f"{name}.falls"] > 0.0


@pytest.mark.parametrize(
    ("seed", "what"),
    [
        (573, "2 ms before the end of a run"),
        (208, "60.0 to 60.1 deg for a moment, thrown in a jump"),
    ],
)
def test_falls_that_were_not_noticed_in_time_are(seed: int, what: str, tmp_path: Path) -> None:
    name, seed = "sensed-disturbed", 64000 - disturbed.FIRST_SEED + seed
    values = run_trials("balance", name, [seed], tmp_path)[name][seed].values
    assert values["sensed-disturbed.delay"] <= 0.2, what
    assert values["sensed-disturbed.falls"] > 0.0


def test_a_fall_that_nobody_notices_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FallDetector, "reason", lambda *_, **__: None)
    patient = Config(safety=SafetyConfig(grave_limit_time=100.0))
    with TrialRobot(MujocoPlant(control_period=0.004), patient) as robot:
        watch = disturbed.Watch(robot, np.random.default_rng(0))
        robot.require(robot.go2.stand())
        robot.truth.on_tick = watch.look
        robot.plant.push(heading_force(math.pi / 2, 90.0), PUSH_TIME)
        robot.go2.wait(2.0)
        (fall,) = watch.all_falls
        assert fall.mode is Mode.MOVING  # it steps for balance
        assert fall.delay == math.inf


def test_going_limp_to_recover_is_no_fall() -> None:
    with TrialRobot(MujocoPlant(control_period=0.004)) as robot:
        watch = disturbed.Watch(robot, np.random.default_rng(0))
        watch._next = math.inf
        robot.truth.on_tick = watch.look
        robot.require(robot.go2.recover())
        assert not watch.all_falls
