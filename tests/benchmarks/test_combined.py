"""Rest and combined worlds: what a trial counts."""

import pytest

from benchmarks import combined, locomotion
from benchmarks.combined import (
    CALLS,
    RESTING,
    STUDIES,
    measure_combined,
    measure_curve,
    measure_rest,
)
from benchmarks.study import IDEAL, IMU, TrialResult
from controller.sweeps.trials import Trial

HEIGHT_BAR, VELOCITY_BAR = 15.0, 0.03  #: mm, of which it was up to 90 off; m/s


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(combined, "SPEEDS", (0.5,))
    monkeypatch.setattr(combined, "TIMES", (1.0,))
    monkeypatch.setattr(combined, "LOADS", (0.0,))
    monkeypatch.setattr(combined, "WALKS", (0.5,))
    monkeypatch.setattr(combined, "WALK_TIME", 1.0)
    monkeypatch.setattr(combined, "FIRST_SEED", 0)


@pytest.mark.usefixtures("short")
def test_every_call_after_a_walk_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    done, moved = TrialResult(), TrialResult()
    measure_rest(Trial(0), done, RESTING[0])
    assert done.values == dict.fromkeys(CALLS, 1.0)
    monkeypatch.setattr(combined, "AT_REST", 0.0)
    measure_rest(Trial(0), moved, RESTING[0])
    assert {call for call in CALLS if not moved.values[call]} == {"stays"}
    assert "stays 0.5 m/s 1 s" in moved.notes


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(("friction", "share"), [(0.6, 1.0), (0.01, 0.0)])
def test_a_walk_on_ice_is_not_done(friction: float, share: float) -> None:
    found = TrialResult()
    measure_combined(Trial(0), found, 0.0, friction)
    assert found.values == {"done": share}
    assert len(found.notes) == 1.0 - share


@pytest.mark.slow
@pytest.mark.parametrize(("sensors", "seed"), [(IDEAL, 19), (IMU, 3)])
def test_a_curve_over_boxes_is_walked(
    sensors: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It fell: too fast, and by a gyro that was named as feet slid off boxes."""
    monkeypatch.setattr(combined, "FIRST_SEED", 0)
    monkeypatch.setattr(combined, "CURVE_TIME", 12.0)
    measure_curve(Trial(seed, sensors=sensors), TrialResult())


@pytest.mark.slow
@pytest.mark.parametrize(("ground", "seed"), [("stairs", 2), ("ramp", 3), ("waves", 3)])
def test_the_height_is_known_after(ground: str, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locomotion, "FIRST_SEED", 0)
    found = TrialResult()
    studies = {study.name: study for study in locomotion.ESTIMATED}
    studies[f"{ground}-height"].measure(Trial(seed, sensors=IMU), found)
    assert found.values["height"] < HEIGHT_BAR
    assert found.values["velocity"] < VELOCITY_BAR


def test_a_long_run_tells_what_was_done_and_held(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("CIRCLES", 0.4), ("FULL_AFTER", 0.2), ("FIVES", 1)):
        monkeypatch.setattr(combined, name, value)
    found = TrialResult()
    combined.measure_long(Trial(0), found)
    assert (found.values["circles"], found.values["fives"]) == (1.0, 1.0)
    assert abs(found.values["memory"]) < 500.0


def test_each_study_stands_once_and_once_on_sensors() -> None:
    names = [study.name for study in STUDIES]
    assert len(set(names)) == len(names) == 2 * (len(RESTING) + 20 + 2)
