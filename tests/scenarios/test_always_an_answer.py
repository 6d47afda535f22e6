"""Where the QP contradicts itself there is an answer, and the robot is not damped for that.

A sample of ``python -m benchmarks qp_infeasibility``, one seed of each row.
"""

import math
from pathlib import Path

import pytest

from benchmarks.robots import PUSH_TIME, UNTOLD, heading_force, plant_of
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.config import Config
from go2_wbc.planning.locomotion import LocomotionConfig
from go2_wbc.planning.mpc import MpcConfig
from tests.unchecked import run_trials

SAMPLES = [("boxes", 19), ("pushes", 17), ("stops", 11)]  #: Study and seed
CONTRADICTORY = ("pushes", "stops")
"""Where the hard QP has no solution in some ticks; over boxes it had none until feet that stumble
began another swing."""
GRAVE = 0.1  # [%] of the ticks


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), SAMPLES)
def test_contradictions_are_answered_and_never_damp_an_upright_robot(
    name: str, seed: int, tmp_path: Path
) -> None:
    values = run_trials("qp_infeasibility", name, [seed], tmp_path)[name][seed].values
    assert values[f"{name}.failures"] == 0.0
    assert values[f"{name}.damped"] == 0.0
    assert values[f"{name}.unreported"] == values[f"{name}.falls"] == 0.0
    if name in CONTRADICTORY:
        assert values[f"{name}.relaxed"] > 0.0, "or the test would say nothing"
    assert values[f"{name}.grave"] <= GRAVE


@pytest.mark.parametrize(("seed", "time"), [(23, 2.3), (43, 2.3), (21, 2.3)])
def test_a_hip_at_its_stop_for_a_moment_does_not_damp_a_robot_that_is_pushed(
    seed: int, time: float
) -> None:
    """They were damped after 0.02 s; left alone they step on.

    The attitude keeps its weight, and the ground is known to hold, or no hip comes to its stop.
    """
    config = Config(
        locomotion=LocomotionConfig(ground_friction=0.6, mpc=MpcConfig(throw_speed=1e9))
    )
    with TrialRobot(plant_of(Trial(seed, sensors="imu"), 7100, UNTOLD), config) as robot:
        robot.require(robot.go2.stand())
        robot.require(robot.go2.walk())
        robot.go2.move(0.5)
        robot.wait(time)
        robot.push(heading_force(-math.pi / 2, 28.0), PUSH_TIME)
        robot.wait(2.0)
        assert robot.go2.telemetry.grave_ticks > 10
