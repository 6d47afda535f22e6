"""A page with a verdict and a ghost: what it holds, how small it is."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import viz
from controller.report_view import planned
from go2_wbc.errors import ConfigError
from go2_wbc.recording import Recording
from motions import FeasibilityChecker
from tests.viz.page_reader import packed_parts, read_data
from tests.viz.verdicts import made_up_verdict
from viz.content import ReplayContent
from viz.replay.html_page import PAGE_LIMIT
from viz.replay.page_data import reduced

_ROUNDING = 1e-3
"""Steps of the 16-bit numbers [m, rad, N]."""


@pytest.fixture(scope="module")
def content(recording: Recording) -> ReplayContent:
    ghost = replace(recording, q=recording.q + 0.001, foot_forces=recording.foot_forces * 0.5)
    verdict = made_up_verdict(recording.duration)
    return ReplayContent(recording, is_plan=True, verdict=verdict, ghost=ghost)


@pytest.fixture(scope="module")
def page(content: ReplayContent, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "plan.html"
    return viz.export_html(content, path, title="A plan").read_text(encoding="utf-8")


def test_the_header_is_strict_json(page: str) -> None:
    content = packed_parts(page)["replay-data"]
    length = int.from_bytes(content[:4], "little")
    json.loads(content[4 : 4 + length], parse_constant=pytest.fail)


def test_the_curves_are_the_given_ones(page: str, content: ReplayContent) -> None:
    header, arrays = read_data(page)
    assert content.verdict is not None
    for k, curve in enumerate(content.verdict.ranked()):
        np.testing.assert_allclose(arrays[f"curve{k}.margin"], curve.margin, rtol=1e-6)
        np.testing.assert_allclose(arrays[f"curve{k}.time"], curve.time, rtol=1e-6)
        subjects = header["verdict"]["curves"][k]["subjects"]
        assert subjects[arrays[f"curve{k}.worst"][0]] == curve.subjects[curve.worst[0]]


def test_the_annotations_are_all_there_with_their_times_and_parts(page: str) -> None:
    header, _ = read_data(page)
    annotations = header["verdict"]["annotations"]
    limits = [annotation["limit"] for annotation in annotations]
    assert limits == ["support", "joint position", "friction"]
    assert annotations[1]["parts"] == ["FR_calf"]
    assert annotations[1]["spans"][0][0] < annotations[1]["time"] < annotations[1]["spans"][0][1]


def test_the_ghost_is_stored_beside_the_robot(page: str, content: ReplayContent) -> None:
    header, arrays = read_data(page)
    assert header["ghost"]["frames"] == len(arrays["ghost.q"])
    np.testing.assert_allclose(arrays["ghost.q"], arrays["q"] + 0.001, atol=_ROUNDING)
    np.testing.assert_allclose(arrays["ghost.forces"], arrays["forces"] * 0.5, atol=2 * _ROUNDING)


def test_what_was_written_is_stored_too(content: ReplayContent, tmp_path: Path) -> None:
    both = replace(content, written=content.recording)
    path = viz.export_html(both, tmp_path / "both.html", title="A run")
    header, arrays = read_data(path.read_text(encoding="utf-8"))
    assert header["written"] == header["ghost"]
    np.testing.assert_allclose(arrays["written.q"], arrays["q"], atol=_ROUNDING)


def test_a_long_curve_keeps_its_least_values(content: ReplayContent) -> None:
    assert content.verdict is not None
    curve = content.verdict.curves[2]
    rows = np.arange(100_000) * len(curve.time) // 100_000
    margin = curve.margin[rows] + 0.01
    margin[[3, 77_777]] = -5.0, -7.0
    long = replace(curve, time=np.arange(1e5), margin=margin, worst=curve.worst[rows])
    few = reduced(long)
    assert len(few.time) <= 3000
    assert [t for t, m in zip(few.time, few.margin, strict=True) if m < -1] == [3.0, 77_777.0]


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
