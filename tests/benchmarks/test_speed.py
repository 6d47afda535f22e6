"""The speed benchmark measures what it names; how fast that is, no test says."""

from functools import cache

import numpy as np
import pytest

from benchmarks import speed, speed_solves, speed_ticks
from benchmarks.speed_placo import BarePlaco
from benchmarks.study import chosen_studies
from controller.sweeps.trials import Trial
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController

KNEE_DIFFERENCE = 0.2
"""Torque [N m] of 6 by which the knees differ in standing. The hips differ by more: PlaCo also
weighs torques, and so prefers other forces between the feet."""


record = speed_solves.recorded_ticks
recorded_ticks = cache(record)
"""One run of few rounds for all tests: nothing changes a tick that is recorded."""


@pytest.fixture(autouse=True)
def few_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed_solves, "ROUNDS", 3)
    monkeypatch.setattr(speed_solves, "WARM_UP", 1)
    for module in (speed_solves, speed_ticks):
        monkeypatch.setattr(module, "recorded_ticks", recorded_ticks)


def measured(name: str) -> dict[str, float]:
    """One trial of a study, which gives every value that it says."""
    (study,) = chosen_studies(speed.STUDIES, [name])
    found = study.run(0)
    assert set(found.values) == {metric.name for metric in study.metrics}, found.reason
    assert min(value for name, value in found.values.items() if name != "sight.more") >= 0.0
    return found.values


def test_both_solve_the_same_ticks_which_are_packed_again_if_they_came_unpacked() -> None:
    assert min(measured("solves").values()) > 0.0
    ticks = recorded_ticks(Trial(0))
    for tick in (tick for kept in ticks.values() for tick in kept):
        assert (tick.asked()._row is not None) == tick.is_packed


def test_placo_is_asked_for_the_same_torques(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed_solves, "ROUNDS", 700)
    standing = record(Trial(0))[4][-1]
    model, config = RobotModel(), WbcConfig()
    tau = BarePlaco(model, config).tick(standing.snapshot.state, standing.reference)
    ours = WholeBodyController(model).solve(standing.snapshot, standing.reference)
    assert np.abs((tau - ours.tau)[2::3]).max() < KNEE_DIFFERENCE


def test_a_tick_is_timed_in_every_mode() -> None:
    assert min(measured("ticks").values()) > 0.0


@pytest.mark.parametrize(
    ("name", "cut", "middle", "least", "others"),
    [
        ("commands", {"COMMAND_TIME": 2.0, "TRACED_TICKS": 20}, "p99", 1.0, ["peak"]),
        ("estimated", {"ESTIMATED_TIME": 0.5, "REPEATS": 2}, "p99", 1.0, []),
        ("sight", {"SIGHT_TIME": 0.5}, "median", 0.0, ["fused"]),
    ],
)
def test_the_worst_tick_is_found(
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    cut: dict[str, float],
    middle: str,
    least: float,
    others: list[str],
) -> None:
    for constant, value in cut.items():
        monkeypatch.setattr(speed_ticks, constant, value)
    values = measured(name)
    assert values[f"{name}.worst"] >= values[f"{name}.{middle}"] >= least
    assert all(values[f"{name}.{other}"] > 0.0 for other in [middle, *others])


def test_a_start_is_measured_in_a_process_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "PROCESSES", 1)
    starts = {name: (what, "sum(range(10**6))", 1.0) for name, (what, _, _) in speed.STARTS.items()}
    monkeypatch.setattr(speed, "STARTS", starts)
    assert min(measured("startup").values()) > 0.0


def test_late_ticks_are_counted_at_the_pace_of_the_wall_clock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(speed_ticks, "REAL_TIME", 0.2)
    assert measured("realtime")["realtime.ticks"] > 0.0


def test_checking_and_compiling_are_timed_for_every_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "ROUNDS", 1)
    assert min(measured("checks").values()) > 0.0


@pytest.mark.parametrize("seconds", speed.LENGTHS)
def test_the_motions_are_as_long_as_they_say(seconds: int) -> None:
    assert speed.lively_motion(seconds).end == pytest.approx(seconds, rel=0.2)


def test_environments_and_a_data_set_are_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("STEPS", 20), ("IN_TURN", 1), ("MANY", 3), ("MINUTES", 1.0 / 60.0)):
        monkeypatch.setattr(speed, name, value)
    assert min(measured("environments").values()) > 0.0
    assert measured("dataset")["dataset.rows"] == 1000.0
