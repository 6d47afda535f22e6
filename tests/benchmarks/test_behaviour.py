"""What the rows of ``behaviour`` measure."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import robots
from benchmarks.behaviour import StepCheck, failure_of
from benchmarks.high_five import highest_window, largest_slip, longest_run
from benchmarks.robots import plant_of
from controller.demo.steps import DEMO_STEPS, DemoProgress, StepResult
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.legs import LEGS, Leg
from tests.go2_wbc.plant.helpers import empty_recording


def test_plants_of_trials_differ_within_their_ranges() -> None:
    with closing(plant_of(Trial(0), 4100)) as one, closing(plant_of(Trial(1), 4100)) as other:
        assert one.read().rpy[2] != other.read().rpy[2]
    assert (robots.FRICTION_RANGE, robots.MASS_RANGE) == ((0.6, 1.0), (0.95, 1.05))


def test_what_was_held_longest_and_slid_farthest_is_found() -> None:
    flags = np.array([1, 0, 1, 1, 0, 1, 1, 1], dtype=bool)
    assert longest_run(flags) == slice(5, 8)
    assert longest_run(np.zeros(3, dtype=bool)) == slice(0, 0)
    heights = np.array([0.0, 0.9, 0.59, 0.61, 0.62, 0.6, 0.0])
    assert highest_window(heights, 3) == slice(3, 6)
    with pytest.raises(TrialFailed):
        highest_window(heights, 8)
    v = np.zeros((201, 4, 3))
    v[1:101, Leg.RL, 0], v[101:, Leg.RL, 0] = 0.02, -0.02  # 4 mm there and back
    recorded = empty_recording(201, v)
    assert largest_slip(recorded, list(LEGS)) == pytest.approx(0.004)
    assert largest_slip(recorded, [Leg.FL]) == 0.0


def test_no_step_of_the_demo_is_true_of_a_robot_that_lies_there() -> None:
    with TrialRobot(Trial(0)) as robot:
        before = robot.plant.read()
        robot.go2.wait(0.01)
        names = [step.name for step in DEMO_STEPS]  # each has a criterion
        failures = {name: failure_of(name, robot, before) for name in names}
    assert [name for name, failure in failures.items() if failure is None] == []
    assert "went" in str(failures["forward"])
    assert "turned" in str(failures["turn"])


def test_a_true_that_the_simulator_contradicts_is_noted() -> None:
    result = StepResult("sit", "sit", ok=True, reason="done", start=0.0, duration=0.0)
    with TrialRobot(Trial(0)) as robot:
        check = StepCheck(robot)
        check(DemoProgress(0, 1, "sit"))
        check(DemoProgress(0, 1, "sit", result))
        check(DemoProgress(0, 1, "sit", replace(result, ok=False, reason="fell")))
    assert len(check.untrue) == 1
    assert check.untrue[0].startswith("sit: pitch ")
