"""The reduction of a recording for the page keeps what matters."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_description
from viz.render.camera import smoothed
from viz.render.robot_meshes import PosedRobot, load_robot_visuals
from viz.replay.page_data import replay_frames

MICROMETRE = 1e-6  #: m


def test_frames_are_even_and_feet_those_of_the_robot(recording: Recording) -> None:
    rate, frames = replay_frames(recording)
    assert rate == pytest.approx(50.0, rel=0.02)
    assert (len(frames["q"]) - 1) / rate == pytest.approx(recording.duration)
    np.testing.assert_array_equal(frames["q"][0], recording.q[0])
    np.testing.assert_allclose(np.abs(frames["q"][-1]), np.abs(recording.q[-1]))
    _, frames = replay_frames(recording)
    posed = PosedRobot(load_robot_visuals())
    feet = np.array([posed.feet(q).ravel() for q in frames["q"]])
    np.testing.assert_allclose(frames["feet"], feet, atol=MICROMETRE)


@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_a_frame_shows_the_sample_nearest_to_its_time(recording: Recording, jitter: float) -> None:
    count, period = len(recording.time), 0.01
    late = jitter * period * np.random.default_rng(0).uniform(-1.0, 1.0, count)
    q = recording.q.copy()
    q[:, 0] = period * np.arange(count)
    rate, frames = replay_frames(replace(recording, q=q, time=q[:, 0] + late))
    shown = frames["q"][:-1, 0]
    assert shown == pytest.approx(np.arange(len(shown)) / rate, abs=0.8 * period)


def test_a_spike_between_two_frames_is_not_lost(recording: Recording) -> None:
    wanted = (recording.tau, recording.foot_forces, recording.support_margin)
    tau, forces, margin = (values.copy() for values in wanted)
    for k in (33, 34, 35):  # one of three neighbours lies between frames of half the rate
        tau[:], forces[:], margin[:] = 0.0, 0.0, 0.1
        tau[k, 5] = -1.5 * find_description().efforts[5]
        forces[k, 2], margin[k] = 321.0, -0.07
        changed = replace(recording, tau=tau, foot_forces=forces, support_margin=margin)
        _, frames = replay_frames(changed)
        assert frames["torque"].max() == pytest.approx(1.5)
        assert frames["forces"][:, 2].max() == 321.0
        assert frames["margin"].min() == -0.07


def test_a_margin_may_be_undefined_and_a_flipped_quaternion_does_not_spin(
    recording: Recording,
) -> None:
    margin = np.full_like(recording.support_margin, np.nan)
    _, frames = replay_frames(replace(recording, support_margin=margin))
    assert np.all(np.isnan(frames["margin"]))
    q = recording.q.copy()
    q[100:, 3:7] *= -1
    _, frames = replay_frames(replace(recording, q=q))
    assert np.all(np.sum(frames["q"][1:, 3:7] * frames["q"][:-1, 3:7], axis=1) > 0.9)


def test_smoothing_keeps_a_constant_and_has_no_delay() -> None:
    time = np.sort(np.random.default_rng(1).uniform(0, 10, 400))
    ramp = np.column_stack([np.full(400, 3.0), 0.5 * time])
    result = smoothed(time, ramp, 0.5)
    np.testing.assert_allclose(result[:, 0], 3.0)
    middle = (time > 2.5) & (time < 7.5)
    np.testing.assert_allclose(result[middle, 1], ramp[middle, 1], atol=0.01)
