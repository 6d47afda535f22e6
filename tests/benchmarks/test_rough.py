"""Stairs, blocks and reversals: what a trial counts."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from benchmarks import rough
from benchmarks.rough import (
    BARRIERS,
    REVERSALS,
    SEEING,
    STUDIES,
    WAYS,
    UnreliablePlant,
    Way,
    measure_way,
)
from benchmarks.study import TrialResult
from controller.sweeps.trials import Trial
from go2_wbc.plant.terrain import Blocks, Stairs
from go2_wbc.robot.state import JointCommand


def measured(way: Way, seed: int = 0) -> TrialResult:
    return replace(way.study, measure=partial(measure_way, way=way, first_seed=seed)).run(0)


def test_who_comes_behind_the_end_in_time_and_stands_has_done_it() -> None:
    way = Way("low", "a low block", Blocks(0.03, 0.5, count=1, start=0.6))
    done = measured(way)
    assert set(done.values) == {metric.name for metric in way.study.metrics}
    assert done.values["low.done"] == 1.0
    assert done.values["low.speed"] < 100.0 * (1.0 - rough.LEAST_SHARE)


def test_who_meets_a_wall_has_not() -> None:
    failed = measured(Way("wall", "a wall", Stairs(0.5, 1, start=0.6), length=1.0))
    assert failed.values["wall.done"] == 0.0
    assert failed.failures["wall.done"] == failed.reason


@pytest.mark.slow
@pytest.mark.parametrize("seed", [6001, 6015])
def test_the_trunk_rises_before_its_nose_meets_the_second_of_two_stairs(seed: int) -> None:
    # It was thrown back by its face, and these two fell: 11 of 20 came past it, 18 since.
    stairs = Stairs(0.14, 2, 0.31)
    climbed = measured(Way("stairs", "2 stairs of 14 cm", stairs, length=1.8), seed)
    assert climbed.values["stairs.done"] == 1.0, climbed.reason


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), [("stairs-14", 18003), ("slope", 18011)])
def test_neither_a_slope_that_ends_nor_the_crest_of_a_ramp_throws_it(name: str, seed: int) -> None:
    # Feet swung on above the landing, and those on the ramp slid: of 30 each fell 7, and 2.
    way = next(way for way in WAYS if way.name == name)
    done = measured(way, seed)
    assert done.values[f"{name}.done"] == 1.0, done.reason


def test_reversals_are_told_by_how_far_the_velocity_is_off(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("EACH", 0.5), ("ROUNDS", 1)):
        monkeypatch.setattr(rough, name, value)
    found = TrialResult()
    rough.measure_reversals(Trial(0), found, first_seed=0)
    assert 0.2 < found.values["off"] < 2.0


def test_commands_are_late_by_what_is_drawn_or_get_lost() -> None:
    plant = UnreliablePlant({"seed": 3}, latest=5, lost=0.2)
    asked, acted = [], []
    for n in range(400):
        asked.append(float(n))
        plant.write(JointCommand.damping(1.0 + 1e-6 * n))
        acted.append(round((plant._sent[0][1].kd[0] - 1.0) * 1e6))
    late = np.array(asked) - np.array(acted)
    assert late[10:].min() >= 0
    assert 4 <= late[10:].max() <= 10
    assert np.all(np.diff(acted) >= 0)
    assert 400 - len(set(acted)) > 40, "some never acted"


def test_each_study_stands_once_and_once_on_sensors() -> None:
    names = [study.name for study in STUDIES]
    twice, once = (*WAYS, *REVERSALS), (*SEEING, *BARRIERS)
    assert len(set(names)) == len(names) == 2 * len(twice) + len(once)
