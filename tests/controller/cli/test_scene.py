"""``new --scene`` writes a scene that runs as it is; an edit that goes wrong is told in words."""

import json
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from controller import GO2Controller
from controller.cli.common import ExitCode
from go2_wbc.errors import ConfigError, ModelMismatch
from go2_wbc.plant import MujocoPlant
from go2_wbc.recording import Recording
from tests.controller.cli.conftest import Run

STANDING = 0.306  #: m; height of the base of a robot that stands on level ground


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scene")


@pytest.fixture
def yard(folder: Path, run: Run) -> Path:
    """The scene, written once."""
    path = folder / "yard.xml"
    if not path.exists():
        told = json.loads(run("new", "yard", "--scene", "--out", folder, "--json").out)
        assert told == {"scene": "yard", "file": str(path)}
        assert "exists already" in run("new", "yard", "--scene", "--out", folder, code=2).err
    return path


@pytest.mark.parametrize("sensors", ["ideal", "imu"])
@pytest.mark.parametrize(("keyframe", "pitch"), [("floor", 0.0), ("ramp", -10.0)])
def test_a_robot_begins_in_the_keyframe_that_is_named(
    keyframe: str, pitch: float, sensors: str, yard: Path
) -> None:
    plant = MujocoPlant(yard, keyframe=keyframe, sensors=sensors, seed=9604)
    assert plant.truth().feet_in_contact.all()
    assert np.degrees(plant.read().rpy[1]) == pytest.approx(pitch, abs=1.5)
    feet = plant.p_world_feet
    with GO2Controller(plant=plant) as go2:
        assert go2.take_over(), go2.last_outcome.reason
        assert np.abs(plant.p_world_feet - feet).max() < 0.01
        box = plant.data.body("box").xpos
        assert box[2] - plant.truth().q[2] == pytest.approx(0.1, abs=0.01)


def test_a_scene_is_run_watched_filmed_and_exported(
    yard: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[float] = []

    class Window:
        def show(self, time: float) -> None:
            shown.append(time)

        def close(self) -> None:
            shown.append(-1.0)

    monkeypatch.setattr("go2_wbc.plant.mujoco.viewer.open_viewer", lambda _plant: Window())
    monkeypatch.setattr("controller.pacing.Pacer.wait", lambda _pacer: 0.0)
    film, data = tmp_path / "nod.webp", tmp_path / "nod.npz"
    words = ("--viewer", "--video", film, "--export", data)
    assert "\ndone\n" in run("run", "nod", "--mjcf", yard, "--keyframe", "ramp", *words).out
    recording = Recording.load(data)
    assert {"lying", "stand", "nod"} <= set(recording.labels)
    assert "tuck" not in recording.labels, "it began standing"
    assert recording.q[:, 2].min() > STANDING, "on the ramp"
    assert shown[-1] == -1.0
    assert len(shown) > 100
    assert film.stat().st_size > 10_000


def test_without_a_display_or_an_extra_it_is_said(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert "\ndone\n" in run("run", "nod", "--viewer").out
    assert "no viewer: cannot open the viewer: there is no display" in caplog.text
    monkeypatch.setitem(sys.modules, "rerun", None)
    said = run("run", "nod", "--export", tmp_path / "nod.rrd", code=ExitCode.RUNTIME).err
    assert 'pip install "go2-wbc[rerun]"' in said


EDITS = {
    '<compiler angle="radian"/>': (
        "",
        'angles are in radians, it needs <compiler angle="radian"/>',
    ),
    'type="box" mass="2"': (
        'type="box" mass="200"',
        "216.1 kg.* the heaviest part is 'box': 200.0 kg",
    ),
    'range="-2.7227 -0.83776"': ('range="-156 -48"', "FL_calf_joint turns from -156 .* be degrees"),
    'range="-2.7227 -0.8377': ('range="-2.2 -0.8377', "FL_calf_joint .* lying needs -2.66"),
    "-1.66339 0 0.836": (
        "-95.3 0 0.836",
        "keyframe 'floor' has FL_calf_joint at -95.3 rad.* degrees",
    ),
    '"FL_thigh" pos="0 0.0955 0"': (
        '"FL_thigh" pos="0 95.5 0"',
        "thigh's joint is 95.5.* m, not 0.09",
    ),
    '<key name="floor" qpos="': ('<key name="floor" qpos="0 ', "invalid qpos size"),
}


@pytest.mark.parametrize("old", EDITS)
def test_an_edit_that_cannot_be_meant_is_told(old: str, yard: Path, tmp_path: Path) -> None:
    new, told = EDITS[old]
    text = yard.read_text(encoding="utf-8")
    ET.fromstring(text)
    assert old in text
    mine = tmp_path / "mine.xml"
    mine.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ModelMismatch, match=f"(?s){told}"):
        MujocoPlant(mine)


def test_a_keyframe_that_is_not_there_is_named(yard: Path) -> None:
    with pytest.raises(ConfigError, match="unknown keyframe 'hill'; valid: floor, ramp"):
        MujocoPlant(yard, keyframe="hill")
    with pytest.raises(ConfigError, match="keyframe needs an mjcf"):
        MujocoPlant(keyframe="floor")
