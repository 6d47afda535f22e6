"""The benchmark of nearest motions: what is refused, what is measured, a sample of its row."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks import nearest
from benchmarks.nearest import KINDS, STUDIES, off_written, refused_motion
from go2_wbc.reference import Anchor
from go2_wbc.robot.rotations import yaw_rotation
from motions import FeasibilityChecker, Timeline
from motions.postures import standing_feet
from tests.go2_wbc.plant.helpers import empty_recording
from tests.solver import needs_solver

SAMPLE = 1006
"""Two diagonal feet; one of the seeds that were worked with, not of those that are judged."""


def test_seeds_give_every_kind_in_turn_and_the_check_refuses_each(
    checker: FeasibilityChecker,
) -> None:
    motions = [refused_motion(seed, checker) for seed in range(1000, 1000 + len(KINDS))]
    assert [motion.kind for motion in motions] == list(KINDS)
    for seed, motion in enumerate(motions, start=1000):
        assert not checker.check(motion.line).ok
        assert motion.nearest.physics == "nearest"
        assert refused_motion(seed, checker) == motion
    assert refused_motion(1005, checker).line.keys != motions[0].line.keys


def test_what_is_measured_is_the_distance_from_what_was_written(
    checker: FeasibilityChecker,
) -> None:
    checked = checker.evaluate(Timeline().body(y=0.03, over=0.5).home(over=0.5))
    model, path = checker.model, checked.path
    anchor = Anchor(np.array([2.0, 1.0, 0.0]), 0.8)
    feet, turn = standing_feet(model), Rotation.from_euler("z", anchor.yaw)
    count = len(path.times)
    recorded = replace(
        empty_recording(count, np.zeros((count, 4, 3))),
        time=5.0 + path.times,
        q=path.q.copy(),
        p_world_feet=np.tile(anchor.p_world + feet @ yaw_rotation(anchor.yaw).T, (count, 1, 1)),
    )
    recorded.q[:, :3] = turn.apply(path.q[:, :3]) + anchor.p_world
    recorded.q[:, 3:7] = (turn * Rotation.from_quat(path.q[:, 3:7])).as_quat()
    assert off_written(recorded, checked, model) == pytest.approx((0.0, 0.0), abs=1e-9)
    recorded.q[40, :3] += [0.003, 0.0, 0.004]
    tilted = Rotation.from_euler("y", 0.1) * Rotation.from_quat(recorded.q[60, 3:7])
    recorded.q[60, 3:7] = tilted.as_quat()
    assert off_written(recorded, checked, model) == pytest.approx((0.005, 0.1), abs=1e-9)


@needs_solver
def test_a_sample_is_found_played_and_as_far_off_as_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(nearest, "FIRST_SEED", SAMPLE)
    measured = STUDIES[0].run(0)
    assert set(measured.values) == {metric.name for metric in STUDIES[0].metrics}
    assert not measured.failures
    assert measured.values["nearest.found"] == 100.0
    assert measured.values["nearest.done"] == 1.0
    assert measured.values["nearest.as_reported"] <= nearest.AS_REPORTED
    assert measured.values["nearest.measured"] > 1.0


@needs_solver
def test_a_run_that_is_not_as_reported_is_a_failure_whatever_the_mean(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(nearest, "FIRST_SEED", SAMPLE)
    monkeypatch.setattr(nearest, "play", lambda *_: {"measured": 50.0})
    assert "mm" in STUDIES[0].run(0).failures["nearest.as_reported"]


def test_only_what_was_found_is_to_be_done(monkeypatch: pytest.MonkeyPatch) -> None:
    refused = Timeline().body(z=-0.2, over=0.05).home(over=0.05)
    monkeypatch.setattr(nearest, "refused_motion", lambda *_: SimpleNamespace(nearest=refused))
    measured = STUDIES[0].run(0)
    assert measured.values == {"nearest.found": 0.0}
    asked = {metric.name for metric in STUDIES[0].metrics} - measured.not_asked.keys()
    assert asked == {"nearest.found"}
    assert measured.failure("nearest.found") is None
