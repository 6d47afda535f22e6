"""The kernels of play are held to the readable playback."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.contacts import ContactSchedule
from go2_wbc.kernels.playing import exp_rotation, log_rotation
from go2_wbc.planning.correction import CorrectionConfig
from go2_wbc.planning.playback import Playback, ReadablePlayback
from go2_wbc.reference import Anchor, BodyTarget, LegTask, Reference, TrackedPoint
from go2_wbc.robot import rotations
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.payload import NO_PAYLOAD, Payload
from tests.engine_helpers import holding_reference, random_state, standing_q, state_of

MODEL = RobotModel()
TICK = 0.002
ROUNDING = 1e-10
ODD = CorrectionConfig(
    rate=1.7,
    position_limit=0.013,
    position_window=0.31,
    angle_limit=0.11,
    angle_window=0.47,
    height_per_weight=0.0007,
    roll_per_moment=0.043,
    pitch_per_moment=0.019,
)
"""No two numbers alike, so that one in another's place is seen."""


def random_reference(rng: np.random.Generator, near: np.ndarray | None) -> Reference:
    """Every number another one; the attitude anything, or close to ``near``."""
    R = rotations.rotation_from_rpy(*rng.uniform(-3.0, 3.0, size=3))
    if near is not None:
        R = near @ rotations.exp_rotation(rng.normal(scale=0.2, size=3))
    p, v, a, w, dw = rng.normal(scale=0.3, size=(5, 3))
    point = TrackedPoint.COM if rng.random() < 0.5 else TrackedPoint.BASE
    legs = tuple(LegTask(int(task)) for task in rng.integers(3, size=4))
    loads, feet = rng.uniform(size=(2, 4)), rng.normal(size=(3, 4, 3))
    joints, forces = rng.normal(size=(3, 12)), rng.normal(size=(4, 3))
    return Reference(
        BodyTarget(point, p, v, a, R, w, dw),
        legs,
        *loads,
        *feet,
        *joints,
        f_world_feet=forces,
        force_weight=0.01,
    )


@pytest.mark.parametrize("config", [CorrectionConfig(), ODD], ids=["default", "odd"])
def test_a_playback_is_the_readable_one_tick_by_tick(config: CorrectionConfig) -> None:
    rng = np.random.default_rng(5)
    anchor = Anchor(np.array([0.31, -0.17, 0.043]), 1.3)
    ours, theirs = (kind(anchor, None, config) for kind in (Playback, ReadablePlayback))
    turn = rotations.yaw_rotation(-anchor.yaw)
    corrected = 0
    for tick in range(600):
        state = random_state(rng, tilt=0.3)
        near = turn @ state.R_world_base if tick % 3 else None
        reference = random_reference(rng, near)
        q = state.q.copy()
        q[:3] = anchor.p_world + turn.T @ reference.body.p_world + rng.normal(scale=0.03, size=3)
        carried = NO_PAYLOAD
        if tick // 100 % 2:  # and it grows, and lies anywhere
            carried = Payload(0.02 * (tick % 100), (*rng.uniform(-0.1, 0.1, size=2), 0.02))
        snapshot = MODEL.snapshot(replace(state, q=q), carried)
        plan = reference.row.copy()
        tracked = ours.follow(plan, snapshot, 0.02 * tick, 0.02)
        expected = theirs.follow(plan, snapshot, 0.02 * tick, 0.02)
        np.testing.assert_allclose(tracked.row, expected.row, atol=ROUNDING, rtol=0)
        np.testing.assert_array_equal(plan, reference.row, "the plan's own row is changed")
        corrected += bool(np.abs(tracked.row - reference.placed(anchor).row).max() > 1e-6)
        found, wanted = ours.deviation, theirs.deviation
        assert found.place == pytest.approx(wanted.place, abs=ROUNDING)
        assert found.attitude == pytest.approx(wanted.attitude, abs=1e-8)
        assert found.joints == pytest.approx(wanted.joints, abs=ROUNDING)
        assert ours.sag_and_lean == pytest.approx(theirs.sag_and_lean, abs=1e-7)
    assert corrected > 500


@pytest.mark.parametrize("kind", [Playback, ReadablePlayback])
def test_a_trunk_that_a_load_leans_is_judged_by_the_plan_and_not_by_its_correction(
    kind: type[Playback] | type[ReadablePlayback],
) -> None:
    q = standing_q()
    q[3:7] = rotations.quaternion_from_rpy(0.2, 0.0, 0.0)
    snapshot = MODEL.snapshot(state_of(q))
    upright = holding_reference(MODEL.snapshot(state_of(standing_q())))
    playback = kind(Anchor(np.zeros(3), 0.0))
    tracked = upright
    for _ in range(2000):
        tracked = playback.follow(upright.row, snapshot, 0.0, TICK)
    assert np.arccos(tracked.body.R_world_base[2, 2]) > 0.25, "the correction pulls against it"
    assert playback.sag_and_lean[1] == pytest.approx(0.2, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 0.3, 2.0, 3.1, np.pi - 1e-7])
def test_logarithm_and_exponential_are_pinocchios(angle: float) -> None:
    rng = np.random.default_rng(6)
    for axis in (*np.eye(3), *-np.eye(3), *rng.normal(size=(20, 3))):
        vector = angle * axis / np.linalg.norm(axis)
        R, found = np.empty((3, 3)), np.empty(3)
        exp_rotation(vector, R)
        np.testing.assert_allclose(R, rotations.exp_rotation(vector), atol=1e-14)
        log_rotation(R, found)
        np.testing.assert_allclose(found, vector, atol=1e-8)


def test_a_schedule_holds_its_ends() -> None:
    schedule = ContactSchedule((0.0, 1.0), np.array([[1, 1, 1, 1], [1, 0, 1, 1]], dtype=bool))
    assert np.isneginf(schedule.since[0]).all()
    np.testing.assert_array_equal(schedule.until[0], [np.inf, 1.0, np.inf, np.inf])
    np.testing.assert_array_equal(schedule.since[1], [-np.inf, 1.0, -np.inf, -np.inf])
