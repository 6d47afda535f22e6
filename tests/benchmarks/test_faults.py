"""Broken parts: what a trial counts."""

from dataclasses import replace

import pytest

from benchmarks import faults
from benchmarks.faults import (
    FEET,
    MOTORS,
    STUDIES,
    UNFELT,
    measure_alarms,
    measure_break,
    measure_walk,
)
from benchmarks.study import TrialResult
from benchmarks.unknown_world import WORLDS
from controller.sweeps.trials import Trial
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.state import PartFault


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faults, "STATES", ("trotting",))
    monkeypatch.setattr(faults, "WATCHED", 1.0)
    monkeypatch.setattr(faults, "WALK_TIME", 2.0)
    monkeypatch.setattr(faults, "LIFE", 3.0)
    monkeypatch.setattr(faults, "FIRST_SEED", 0)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    ("what", "sensors"),
    [*((what, "imu") for what in (FEET[0], FEET[2], *UNFELT)), (FEET[2], "ideal")],
    ids=lambda value: value if isinstance(value, str) else value.name,
)
def test_a_walk_goes_on_without_a_sensor(what: faults.Break, sensors: str) -> None:
    found = TrialResult()
    measure_walk(Trial(1, sensors=sensors), found, what)
    assert found.values["way"] < 10.0
    assert found.values["calls"] == 1.0, found.notes
    assert found.values.get("others", 0.0) == 0.0


@pytest.mark.usefixtures("short")
def test_a_sound_life_is_counted_and_a_broken_part_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    sound, broken = TrialResult(), TrialResult()
    world = WORLDS[0]
    measure_alarms(Trial(0, sensors="imu"), sound, world)
    assert sound.values["alarms"] == 0.0
    assert sound.values["time"] >= 3.0 / 60.0
    make = faults.make

    def breaks(robot: object, *rest: object) -> None:
        robot.plant.fault("encoder", part="FL_hip_joint")  # type: ignore[attr-defined]
        make(robot, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(faults, "make", breaks)
    measure_alarms(Trial(0, sensors="imu"), broken, world)
    assert broken.values["alarms"] == 1.0


@pytest.mark.usefixtures("short")
def test_what_was_named_for_a_moment_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    gyro, sound, broken = PartFault("gyro", "turns", True, 1.0), TrialResult(), TrialResult()
    told = property(lambda plant: (gyro,) if 0.5 < plant.time % 1.0 < 0.6 else ())
    monkeypatch.setattr(MujocoPlant, "sensor_faults", told)
    measure_alarms(Trial(0), sound, WORLDS[0])
    assert sound.values["alarms"] == 1.0
    measure_break(Trial(0), broken, FEET[0])
    assert broken.values["trotting-others"] == 1.0
    assert broken.values["trotting-named"] == 0.0


def test_on_three_legs_the_raised_one_breaks() -> None:
    assert {MOTORS[0].broken(seed, "three-legs") for seed in range(9)} == {("FR_hip_joint",)}
    assert len({MOTORS[0].broken(seed) for seed in range(9)}) == 4
    assert replace(MOTORS[0], at_once=True).broken(0) == MOTORS[0].parts
    assert len({study.name for study in STUDIES}) == len(STUDIES)
