"""The replay page: small, self-contained, each mesh once, and a scene tree that moves right."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import viz
from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from tests.viz.page_reader import packed_parts, placement, read_data
from viz.render.robot_meshes import load_robot_visuals
from viz.replay.html_page import PAGE_LIMIT
from viz.replay.page_data import replay_frames

_TITLE = 'Demo <b> & "co" @DATA@ </script>'


@pytest.fixture(scope="module")
def page(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "demo.html"
    assert viz.export_html(recording, path, title=_TITLE) == path
    return path.read_text(encoding="utf-8")


def test_the_page_is_small(page: str) -> None:
    assert len(page.encode()) < PAGE_LIMIT / 2


def test_nothing_in_the_page_is_loaded_from_elsewhere(page: str) -> None:
    code = re.sub(r'<script type="text/plain".*?</script>', "", page, flags=re.DOTALL)
    asks = r"https?://|wss?://|\ssrc\s*=|@import|url\(|fetch\(|XMLHttp|EventSource"
    assert re.findall(asks, code) == []
    assert re.findall(r'href="([^"]*)"', code) == ["data:,"]
    assert "connect()" not in code


def test_the_page_has_every_element_and_style_that_its_scripts_name(page: str) -> None:
    assets = resources.files("viz.replay") / "assets"
    names = [file.name for file in assets.iterdir() if file.name.endswith(".js")]
    scripts = "".join((assets / name).read_text(encoding="utf-8") for name in names)
    wanted = re.findall(r"getElementById\(\"([\w-]+)\"\)", scripts)
    assert len(wanted) > 10
    assert set(wanted) <= set(re.findall(r"\bid=\"([\w-]+)\"", page))
    assert set(re.findall(r"className = \"(\w+)", scripts)) <= set(re.findall(r"\.(\w+)", page))


def test_the_title_is_shown_as_text(page: str) -> None:
    shown = "Demo &lt;b&gt; &amp; &quot;co&quot; @DATA@ &lt;/script&gt;"
    assert page.count(shown) == 2
    assert "<b>" not in page.replace('<b id="now">', "")


def test_meshcats_own_viewer_is_inside(page: str) -> None:
    bundle = packed_parts(page)["meshcat-bundle"]
    assert b"MeshCat" in bundle
    assert len(bundle) > 500_000


def test_each_mesh_is_stored_once_and_every_link_refers_to_it(page: str) -> None:
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


def test_the_motion_in_the_page_is_the_recorded_one(page: str, recording: Recording) -> None:
    header, arrays = read_data(page)
    rate, frames = replay_frames(recording)
    assert (header["rate"], header["frames"]) == (rate, len(frames["q"]))
    for name, values in frames.items():
        step = max(np.nanmax(1.0 * values) - np.nanmin(1.0 * values), 1e-5) / 65535
        np.testing.assert_allclose(arrays[name], values, rtol=1e-6, atol=step)
    assert [label for _, _, label in header["labels"]] == ["stand", "walk", "high_five", "sit"]


def test_the_same_recording_gives_the_same_page(recording: Recording, tmp_path: Path) -> None:
    first = viz.export_html(recording, tmp_path / "a.html", title="t").read_bytes()
    second = viz.export_html(recording, tmp_path / "b.html", title="t").read_bytes()
    assert first == second


def test_an_hour_still_fits_into_the_page(recording: Recording, tmp_path: Path) -> None:
    noise = np.random.default_rng(0).normal(0, 0.01, recording.q.shape)
    stretched = replace(recording, time=recording.time * 1000, q=recording.q + noise)
    path = viz.export_html(stretched, tmp_path / "long.html", title="long")
    assert path.stat().st_size < PAGE_LIMIT


def test_a_page_over_the_limit_is_refused(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("viz.replay.html_page.PAGE_LIMIT", 1000)
    with pytest.raises(ConfigError, match="limit 1000"):
        viz.export_html(recording, tmp_path / "big.html", title="t")
    assert list(tmp_path.iterdir()) == []
