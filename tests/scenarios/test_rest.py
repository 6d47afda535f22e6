"""A robot that has walked comes to rest, stays there, and does what it is asked next."""

from dataclasses import replace

import pytest

from benchmarks import combined
from benchmarks.combined import CALLS, RESTING, measure_rest
from benchmarks.study import TrialResult
from benchmarks.unknown_world import Robot
from controller.sweeps.trials import Trial

OWN, GYM, MENAGERIE = RESTING


@pytest.mark.parametrize(
    ("robot", "speed", "time", "sensors"),
    [
        *((OWN, 0.8, 2.0, sensors) for sensors in ("ideal", "imu")),
        *((GYM, speed, 2.0, sensors) for speed in (0.8, 1.2) for sensors in ("ideal", "imu")),
        # Its legs hardly swung: it fell within 3 s of 0.8 m/s.
        pytest.param(MENAGERIE, 1.2, 4.0, "ideal", marks=pytest.mark.slow),
    ],
    ids=lambda value: value.name if isinstance(value, Robot) else value,
)
def test_stop_says_true_of_a_robot_that_stays_at_rest_and_is_ready_for_more(
    robot: Robot, speed: float, time: float, sensors: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It said so while its trunk still moved at up to 45 mm/s, or never, as its feet were aside."""
    for name, value in (("SPEEDS", (speed,)), ("TIMES", (time,)), ("FIRST_SEED", 0)):
        monkeypatch.setattr(combined, name, value)
    found = TrialResult()
    mjcf = robot.mjcf if robot is MENAGERIE else None
    measure_rest(Trial(0, sensors=sensors), found, replace(robot, mjcf=mjcf))
    assert found.values == dict.fromkeys(CALLS, 1.0), found.notes
