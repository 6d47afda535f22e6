"""What Foxglove and Rerun read of a recording is what was measured; a plot shows it too."""

import importlib
import io
import json
import os
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import ConfigError, MissingDependency
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.recording import EXPORTS, Recording
from go2_wbc.robot.model import RobotModel

ROUNDING = 1e-6
"""Numbers in an MCAP file have six digits after the point."""
SINGLE = 1e-6
"""Numbers in an rrd file are of single precision."""


@pytest.fixture(scope="module")
def run(recording: Recording) -> Recording:
    """A short one, with speeds that differ."""
    v = np.random.default_rng(3).normal(size=(60, 18))
    return replace(recording.part(slice(10, 70)), v=v)


@pytest.fixture(scope="module")
def messages(run: Recording, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """What MCAP's own library reads, by topic."""
    reader = pytest.importorskip("mcap.reader", reason='needs pip install "go2-wbc[mcap]"')
    path = run.export(tmp_path_factory.mktemp("mcap") / "run.mcap")
    found: dict[str, list[Any]] = defaultdict(list)
    content = reader.make_reader(io.BytesIO(path.read_bytes()), validate_crcs=True)
    for schema, channel, message in content.iter_messages():
        told, row = json.loads(schema.data), json.loads(message.data)
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        assert set(told["properties"]) == set(row), "the schema is of these messages"
        found[channel.topic].append((message.log_time, schema.name, row))
    return found


def test_an_mcap_file_has_what_was_measured(run: Recording, messages: dict[str, list[Any]]) -> None:
    times = np.rint(1e9 * run.time).astype(int).tolist()
    for topic, kind in {
        "/tf": "foxglove.FrameTransforms",
        "/joint_states": "foxglove.JointStates",
        "/base": "foxglove.Odometry",
        "/feet": "go2_wbc.Feet",
        "/com": "go2_wbc.CentreOfMass",
    }.items():
        assert [(time, name) for time, name, _ in messages[topic]] == [(t, kind) for t in times]

    def read(topic: str, *keys: str) -> np.ndarray:
        rows = [row for _, _, row in messages[topic]]
        for key in keys:
            rows = [row[key] for row in rows]
        return np.array([[*row.values()] if isinstance(row, dict) else row for row in rows])

    joints = [row["joints"] for _, _, row in messages["/joint_states"]]
    assert [joint["name"] for joint in joints[0]] == list(JOINT_NAMES)
    for key, values in {
        "position": run.q[:, 7:],
        "velocity": run.v[:, 6:],
        "effort": run.tau,
    }.items():
        np.testing.assert_allclose(
            [[one[key] for one in row] for row in joints], values, atol=ROUNDING
        )
    np.testing.assert_allclose(read("/base", "pose", "position"), run.q[:, :3], atol=ROUNDING)
    np.testing.assert_allclose(read("/base", "pose", "orientation"), run.q[:, 3:7], atol=ROUNDING)
    np.testing.assert_allclose(read("/base", "linear_velocity"), run.v[:, :3], atol=ROUNDING)
    np.testing.assert_allclose(read("/base", "angular_velocity"), run.v[:, 3:6], atol=ROUNDING)
    np.testing.assert_allclose(read("/com", "position"), run.p_world_com, atol=ROUNDING)
    margins = read("/com", "support_margin").astype(float)  # None, where there is none, is nan
    np.testing.assert_allclose(margins, run.support_margin, atol=ROUNDING)
    for leg in LEGS:
        forces = run.foot_forces[:, leg]
        np.testing.assert_allclose(read("/feet", leg.name, "force"), forces, atol=ROUNDING)
        np.testing.assert_array_equal(read("/feet", leg.name, "stance"), run.stance[:, leg])
    told = [row["message"] for _, _, row in messages["/label"]]
    assert told == [span.label for span in run.spans()]


def test_the_frames_of_an_mcap_file_lead_to_the_feet(
    run: Recording, messages: dict[str, list[Any]]
) -> None:
    model = RobotModel()
    foot = model.pin_model.frames[model.pin_model.getFrameId("RL_foot")]
    for row in (0, 30, 59):
        frames = {frame["child_frame_id"]: frame for frame in messages["/tf"][row][2]["transforms"]}
        assert len(frames) == 13
        T, name = foot.placement, "RL_calf"
        while name != "world":
            turn, place = (
                np.array([*frames[name][key].values()]) for key in ("rotation", "translation")
            )
            T, name = (
                pin.XYZQUATToSE3(np.concatenate([place, turn])) * T,
                frames[name]["parent_frame_id"],
            )
        _, feet = model.forward_kinematics(run.q[row])
        np.testing.assert_allclose(T.translation, feet[2], atol=1e-5)


def test_an_rrd_file_has_the_tree_of_links_and_the_signals(run: Recording, tmp_path: Path) -> None:
    if "GO2_WBC_REQUIRE_CLUSTER" not in os.environ:  # `make test-cluster` installs it
        pytest.importorskip("rerun", reason='needs pip install "go2-wbc[rerun]"')
    rr = importlib.import_module("rerun")
    chunks: dict[str, Any] = {}
    for chunk in rr.chunk.RrdReader(run.export(tmp_path / "run.rrd")).stream():
        if not chunk.is_static:
            chunks[chunk.entity_path] = chunk.to_record_batch().to_pydict()
    assert "/world/base/RR_hip/RR_thigh/RR_calf" in chunks

    def read(path: str, component: str) -> np.ndarray:
        rows = chunks[path]
        times = [time.total_seconds() for time in rows["time"]]
        np.testing.assert_allclose(times, run.time, atol=ROUNDING)
        return np.array(rows[component]).squeeze()

    place = read("/world/base", "Transform3D:translation")
    np.testing.assert_allclose(place, run.q[:, :3], atol=SINGLE)
    turn = read("/world/base", "Transform3D:quaternion")
    np.testing.assert_allclose(turn, run.q[:, 3:7], atol=SINGLE)
    for name, values in {"torques": run.tau, "foot_forces": run.foot_forces}.items():
        np.testing.assert_allclose(read(f"/signals/{name}", "Scalars:scalars"), values)
    labels = chunks["/label"]["TextLog:text"]
    assert [label for (label,) in labels] == [span.label for span in run.spans()]


def test_a_plot_shows_trunk_feet_and_torques_against_their_limits(run: Recording) -> None:
    panels = {axes.get_title(loc="left"): axes for axes in run.plot().axes}
    height, *_, torque = panels.values()
    np.testing.assert_array_equal(height.lines[0].get_ydata(), run.q[:, 2])
    share = np.abs(run.tau / RobotModel().torque_limits)
    shown = np.asarray(torque.lines[3].get_ydata())
    np.testing.assert_allclose(shown, share[:, 9:].max(axis=1))
    for leg in LEGS:
        forces = panels["foot forces [N]"].lines[leg].get_ydata()
        np.testing.assert_array_equal(forces, run.foot_forces[:, leg])


@pytest.mark.parametrize("suffix", EXPORTS)
def test_what_is_missing_and_what_is_empty_is_said(
    suffix: str, run: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ConfigError, match=r"\.mcap.*\.rrd"):
        run.export(tmp_path / "run.bag")
    extra = EXPORTS[suffix]
    for name in [name for name in sys.modules if name.partition(".")[0] == extra]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, f"viz.replay.{extra}_file", raising=False)
    monkeypatch.setitem(sys.modules, extra, None)
    with pytest.raises(MissingDependency, match=rf'pip install "go2-wbc\[{extra}\]"'):
        run.export(tmp_path / f"run{suffix}")
    with pytest.raises(ConfigError, match="no sample"):
        run.part(slice(0, 0)).plot()
    assert not list(tmp_path.iterdir())
