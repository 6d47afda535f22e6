"""The benchmark of locomotion: what a recorded run is worth."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.locomotion import BEYOND, RUNS, Run, measured
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.envelopes import envelope_of
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth, TruthRecording
from go2_wbc.robot.state import JointCommand


@pytest.fixture(scope="module")
def fallen() -> TruthRecording:
    """Two seconds of a limp robot, of which what is measured is then written over."""
    plant = MujocoPlant()
    truth = GroundTruth(plant)
    for _ in range(1000):
        truth.write(JointCommand.damping(1.0))
    recorded = truth.recording()
    plant.close()
    return recorded


def test_errors_are_along_the_command_both_ways_and_turning_by_the_heading(
    fallen: TruthRecording,
) -> None:
    n, dt = len(fallen.time), np.diff(fallen.time)[:, None]
    along, across = np.array([0.6, 0.8, 0.0]), np.array([-0.8, 0.6, 0.0])
    sway = np.where(np.arange(n - 1) % 2, 0.1, -0.1)[:, None]
    steps = (0.49 * along + sway * along + 7.0 * across) * dt
    p = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    run = Run("any", "trot", VelocityCommand(0.3, 0.4), 1.0)
    tau, v = np.tile([2.0, -2.0, 0.0], (n, 4)), np.full((n, 18), 3.0)
    values = measured(run, replace(fallen, p_world_com=p, rpy=np.zeros((n, 3)), tau=tau, v=v), 16.0)
    assert values["mean"] == pytest.approx(2.0, abs=0.1)
    assert values["mae"] == pytest.approx(0.1, abs=1e-4)
    assert values["cost"] == pytest.approx(8 * 2.0 * 3.0 / (16.0 * 9.81 * 0.5))
    assert {f"any.{name}" for name in values} == {m.name for m in run.study.metrics}
    rpy = np.zeros((len(fallen.time), 3))
    rpy[:, 2] = 2.2 * fallen.time
    run = Run("any", "trot", VelocityCommand(0.0, 0.0, 2.0), 1.0)
    values = measured(run, replace(fallen, rpy=rpy), 16.0)
    assert values["turn"] == pytest.approx(10.0, abs=1e-6)
    assert {f"any.{name}" for name in values} == {m.name for m in run.study.metrics}


def test_every_named_gait_has_a_row_and_every_row_is_within_what_is_allowed() -> None:
    assert {run.gait for run in RUNS} == set(GAITS)
    for run in RUNS:
        envelope = (
            BEYOND.envelope if run.group == "moonshot" else envelope_of(GAITS[run.gait], None)
        )
        assert envelope is not None
        assert envelope.clip(run.command) == run.command
