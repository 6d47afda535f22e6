"""The replay page: small, self-contained, each mesh once, and a scene tree that moves right."""

import json
import re
from collections import Counter
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import viz
from controller.report_view import planned
from go2_wbc.errors import ConfigError
from go2_wbc.recording import LIMIT_ROWS, Recording
from motions import FeasibilityChecker
from tests.viz.page_reader import packed_parts, placement, read_data
from tests.viz.synthetic import step_ahead
from tests.viz.verdicts import made_up_verdict
from viz.content import ReplayContent
from viz.render.robot_meshes import load_robot_visuals
from viz.replay.page_data import PAGE_LIMIT, replay_frames

_ROUNDING = 1e-3
"""Steps of the 16-bit numbers [m, rad, N]."""
_TITLE = 'Demo <b> & "co" @DATA@ </script>'


@pytest.fixture(scope="module")
def page(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "demo.html"
    assert viz.export_html(recording, path, title=_TITLE) == path
    return path.read_text(encoding="utf-8")


def test_the_page_is_small_loads_nothing_and_has_its_title_and_viewer(page: str) -> None:
    assert len(page.encode()) < PAGE_LIMIT / 2
    code = re.sub(r'<script type="text/plain".*?</script>', "", page, flags=re.DOTALL)
    asks = r"https?://|wss?://|\ssrc\s*=|@import|url\(|fetch\(|XMLHttp|EventSource"
    assert re.findall(asks, code) == []
    assert re.findall(r'href="([^"]*)"', code) == ["data:,"]
    assert "connect()" not in code
    shown = "Demo &lt;b&gt; &amp; &quot;co&quot; @DATA@ &lt;/script&gt;"
    assert page.count(shown) == 2
    assert "<b>" not in page.replace('<b id="now">', "")
    bundle = packed_parts(page)["meshcat-bundle"]
    assert b"MeshCat" in bundle
    assert len(bundle) > 500_000


def test_the_ground_that_was_seen_is_in_the_page(recording: Recording, tmp_path: Path) -> None:
    ground = step_ahead(0.2, at=0.5)
    page = viz.export_html(replace(recording, ground=ground), tmp_path / "a.html", title="a")
    header, arrays = read_data(page.read_text(encoding="utf-8"))
    x, y, cell = (header["ground"][name] for name in ("x", "y", "cell"))
    row, column = round((1.0 - x) / cell), round((0.3 - y) / cell)
    assert (arrays["ground"][row, column], arrays["ground"][0, 0]) == (200, -32768)
    assert arrays["target"].shape == (header["frames"], 3)
    assert arrays["target"][:, 2] == pytest.approx(0.0, abs=0.1)


def test_what_bound_is_in_the_page_without_its_short_breaks(
    recording: Recording, tmp_path: Path
) -> None:
    y, n = np.zeros((len(recording.time), 48)), len(recording.time)
    y[[10, 12, 13, 60], LIMIT_ROWS.index("FL_calf torque")] = 1.0
    explained = replace(recording, multipliers=y, gave_way=np.arange(n) == 100)
    page = viz.export_html(explained, tmp_path / "a.html", title="a").read_text(encoding="utf-8")
    torque, near = "torque limit of FL_calf", pytest.approx
    assert read_data(page)[0]["binding"] == [
        [near(0.1), near(0.14), torque],
        [near(0.6), near(0.61), torque],
        [near(1.0), near(1.01), "limits contradict each other"],
    ]


def test_the_page_has_every_element_and_style_that_its_scripts_name(page: str) -> None:
    assets = resources.files("viz.replay") / "assets"
    files = [file for file in assets.iterdir() if file.name.endswith(".js")]
    scripts = "".join(file.read_text(encoding="utf-8") for file in files)
    page += (assets / "studio.css").read_text(encoding="utf-8")
    wanted = re.findall(r"getElementById\(\"([\w-]+)\"\)", scripts)
    assert len(wanted) > 10
    assert set(wanted) <= set(re.findall(r"\bid=\"([\w-]+)\"", page))
    assert set(re.findall(r"className = \"(\w+)", scripts)) <= set(re.findall(r"\.(\w+)", page))


def test_the_motion_in_the_page_is_the_recorded_one_and_each_mesh_is_stored_once(
    page: str, recording: Recording
) -> None:
    header, arrays = read_data(page)
    visuals = load_robot_visuals()
    parts = sum(len(parts) for parts in visuals.meshes.values())
    assert header["meshes"] == parts
    assert sum(name.endswith(".points") for name in arrays) == parts
    objects = [c["object"] for c in header["commands"] if c["type"] == "set_object"]
    references = Counter(
        geometry["index"]
        for item in objects
        for geometry in item["geometries"]
        if geometry["type"] == "SharedMesh"
    )
    assert set(references) == set(range(parts))
    assert max(references.values()) == 4
    assert not any("data" in geometry for item in objects for geometry in item["geometries"])
    rate, frames = replay_frames(recording)
    assert (header["rate"], header["frames"]) == (rate, len(frames["q"]))
    for name, values in frames.items():
        step = max(np.nanmax(1.0 * values) - np.nanmin(1.0 * values), 1e-5) / 65535
        np.testing.assert_allclose(arrays[name], values, rtol=1e-6, atol=step)
    assert [label for _, _, label in header["labels"]] == ["stand", "walk", "high_five", "sit"]


def test_stored_meshes_are_those_of_the_robot(page: str) -> None:
    _, arrays = read_data(page)
    surfaces = [part for parts in load_robot_visuals().meshes.values() for part in parts]
    for k, surface in enumerate(surfaces):
        np.testing.assert_allclose(arrays[f"mesh{k}.points"], surface.points, atol=1e-5)
        np.testing.assert_array_equal(arrays[f"mesh{k}.triangles"], surface.triangles)
        np.testing.assert_allclose(arrays[f"mesh{k}.normals"] / 127, surface.normals, atol=0.005)


@pytest.mark.parametrize("seed", range(3))
def test_the_scene_tree_moves_every_link_as_pinocchio_does(page: str, seed: int) -> None:
    header, _ = read_data(page)
    visuals = load_robot_visuals()
    rng = np.random.default_rng(seed)
    q = np.concatenate([rng.normal(size=7), rng.uniform(-1.2, 1.2, 12)])
    q[3:7] /= np.linalg.norm(q[3:7])
    data = visuals.model.createData()
    pin.forwardKinematics(visuals.model, data, q)
    nodes = [
        command["path"].removeprefix("/meshcat/")
        for command in header["commands"]
        if command["type"] == "set_object" and "/robot/" in command["path"]
    ]
    for item in visuals.geometry.geometryObjects:
        link = visuals.model.frames[item.parentFrame].name
        node = next(node for node in nodes if node.endswith(f"/{link}_0"))
        T_world_visual = data.oMi[item.parentJoint] * item.placement
        np.testing.assert_allclose(
            placement(header, node, q), T_world_visual.homogeneous, atol=1e-9
        )


def test_the_same_recording_gives_the_same_page_and_an_hour_still_fits(
    recording: Recording, tmp_path: Path
) -> None:
    first = viz.export_html(recording, tmp_path / "a.html", title="t").read_bytes()
    second = viz.export_html(recording, tmp_path / "b.html", title="t").read_bytes()
    assert first == second
    noise = np.random.default_rng(0).normal(0, 0.01, recording.q.shape)
    stretched = replace(recording, time=recording.time * 1000, q=recording.q + noise)
    path = viz.export_html(stretched, tmp_path / "long.html", title="long")
    assert path.stat().st_size < PAGE_LIMIT


def test_a_page_over_the_limit_is_refused(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("viz.replay.page_data.PAGE_LIMIT", 1000)
    with pytest.raises(ConfigError, match="limit 1000"):
        viz.export_html(recording, tmp_path / "big.html", title="t")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def content(recording: Recording) -> ReplayContent:
    ghost = replace(recording, q=recording.q + 0.001, foot_forces=recording.foot_forces * 0.5)
    verdict = made_up_verdict(recording.duration)
    return ReplayContent(recording, is_plan=True, verdict=verdict, ghost=ghost)


@pytest.fixture(scope="module")
def plan_page(content: ReplayContent, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "plan.html"
    return viz.export_html(content, path, title="A plan").read_text(encoding="utf-8")


def test_the_plan_in_the_page_has_its_curves_annotations_and_ghost(
    plan_page: str, content: ReplayContent
) -> None:
    data = packed_parts(plan_page)["replay-data"]
    length = int.from_bytes(data[:4], "little")
    json.loads(data[4 : 4 + length], parse_constant=pytest.fail)
    header, arrays = read_data(plan_page)
    assert content.verdict is not None
    for k, curve in enumerate(content.verdict.ranked()):
        np.testing.assert_allclose(arrays[f"curve{k}.margin"], curve.margin, rtol=1e-6)
        np.testing.assert_allclose(arrays[f"curve{k}.time"], curve.time, rtol=1e-6)
        subjects = header["verdict"]["curves"][k]["subjects"]
        assert subjects[arrays[f"curve{k}.worst"][0]] == curve.subjects[curve.worst[0]]
    annotations = header["verdict"]["annotations"]
    limits = [annotation["limit"] for annotation in annotations]
    assert limits == ["support", "joint position", "friction"]
    assert annotations[1]["parts"] == ["FR_calf"]
    assert annotations[1]["spans"][0][0] < annotations[1]["time"] < annotations[1]["spans"][0][1]
    assert header["ghost"]["frames"] == len(arrays["ghost.q"])
    np.testing.assert_allclose(arrays["ghost.q"], arrays["q"] + 0.001, atol=_ROUNDING)
    np.testing.assert_allclose(arrays["ghost.forces"], arrays["forces"] * 0.5, atol=2 * _ROUNDING)


def test_what_was_written_is_stored_too(content: ReplayContent, tmp_path: Path) -> None:
    both = replace(content, written=content.recording)
    path = viz.export_html(both, tmp_path / "both.html", title="A run")
    header, arrays = read_data(path.read_text(encoding="utf-8"))
    assert header["written"] == header["ghost"]
    np.testing.assert_allclose(arrays["written.q"], arrays["q"], atol=_ROUNDING)


@pytest.mark.parametrize("name", ["bow", "high_five", "dance"])
def test_pages_of_the_library_are_small(name: str, tmp_path: Path) -> None:
    checked = FeasibilityChecker().evaluate(name)
    path = viz.export_html(planned(checked), tmp_path / "page.html", title=name)
    assert path.stat().st_size < PAGE_LIMIT / 2


@pytest.mark.parametrize("ghost", ["ghost", "written"])
def test_a_ghost_that_cannot_be_drawn_is_refused(
    content: ReplayContent, tmp_path: Path, ghost: str
) -> None:
    lost = replace(content.recording, q=content.recording.q * np.nan)
    broken = replace(content, **{ghost: lost})
    with pytest.raises(ConfigError, match="not finite"):
        viz.export_html(broken, tmp_path / "page.html", title="t")
    assert list(tmp_path.iterdir()) == []
