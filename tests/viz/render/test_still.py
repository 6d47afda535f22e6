"""The filmstrip: one telling panel for each behaviour, nothing outside the recording."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import viz
from go2_wbc.errors import ConfigError
from go2_wbc.legs import Leg
from go2_wbc.recording import Recording
from viz.render.camera import camera_path, heading_path, nearest_rows
from viz.render.frame_renderer import FrameRenderer, ShotStyle
from viz.render.pictures import telling_times
from viz.render.robot_meshes import PosedRobot, load_robot_visuals


def test_it_is_a_picture_with_round_transparent_corners(
    recording: Recording, tmp_path: Path
) -> None:
    path = viz.export_filmstrip(recording, tmp_path / "strip.png", times=[0.1, 2.0])
    with Image.open(path) as image:
        assert image.mode == "RGBA"
        pixels = np.asarray(image)
    assert pixels[0, 0, 3] == 0
    assert pixels[pixels.shape[0] // 2, 200, 3] == 255
    assert pixels.shape[1] > 2.5 * pixels.shape[0]


def test_each_behaviour_gets_its_most_telling_moment(recording: Recording) -> None:
    times = telling_times(recording)
    rows = nearest_rows(recording, np.array(times))
    assert [recording.labels[row] for row in rows] == ["stand", "walk", "high_five", "sit"]
    robot = PosedRobot(load_robot_visuals())
    paw = robot.feet(recording.q[rows[2]])[Leg.FR, 2]
    highest = max(robot.feet(q)[Leg.FR, 2] for q in recording.q)
    assert paw == pytest.approx(highest, abs=0.01)


@pytest.mark.parametrize(
    ("times", "why"),
    [
        ([-0.1], "outside the recording; valid: 0 to"),
        ([1.0, 1e6], "outside the recording; valid: 0 to"),
        ([], "at least one time"),
    ],
)
def test_times_outside_the_recording_and_none_are_refused(
    recording: Recording, tmp_path: Path, times: list[float], why: str
) -> None:
    with pytest.raises(ConfigError, match=why):
        viz.export_filmstrip(recording, tmp_path / "strip.png", times=times)


def test_the_camera_follows_calmly_and_its_heading_over_full_turns(recording: Recording) -> None:
    times, points = camera_path(recording, PosedRobot(load_robot_visuals()), smoothing=0.5)
    base = recording.q[nearest_rows(recording, times), :2]
    assert np.linalg.norm(points[:, :2] - base, axis=1).max() < 0.35
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times)
    assert speed.max() < 0.8
    yaw = np.linspace(0.0, 3 * np.pi, len(recording.time))
    q = recording.q.copy()
    q[:, 3:7] = 0.0
    q[:, 5], q[:, 6] = np.sin(yaw / 2), np.cos(yaw / 2)
    heading = heading_path(replace(recording, q=q), smoothing=0.1)
    assert np.all(np.diff(heading) >= 0)
    assert heading[-1] - heading[0] == pytest.approx(3 * np.pi, abs=0.5)
    np.testing.assert_allclose(heading[100:240], yaw[100:240], atol=0.01)


def test_the_picture_of_a_robot_that_turned_round_shows_it_from_the_same_side(
    recording: Recording,
) -> None:
    q = recording.q.copy()
    q[:, :2] = 0.0
    q[:, 3:7] = [0.0, 0.0, 0.0, 1.0]
    turned = q.copy()
    turned[:, 3:7] = [0.0, 0.0, 1.0, 0.0]
    style = ShotStyle(size=(160, 100), sway=0.0)
    ahead = FrameRenderer(replace(recording, q=q), style).shoot(0.1).astype(float)
    back = FrameRenderer(replace(recording, q=turned), style).shoot(0.1).astype(float)
    assert np.abs(ahead - back).mean() < 4.0  # the tiles of the floor differ, the robot does not
