"""The picture of the margins, as SVG and as PNG."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import viz
from go2_wbc.errors import ConfigError
from tests.viz.verdicts import made_up_verdict

_SVG = "{http://www.w3.org/2000/svg}"
_FILL = (243, 167, 167)


def test_the_svg_names_every_limit_and_the_worst_subject(tmp_path: Path) -> None:
    path = viz.export_plot(made_up_verdict(3.0), tmp_path / "m.svg", title='a < "b"')
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    words = [item.text or "" for item in root.iter(f"{_SVG}text")]
    assert words[0] == 'a < "b"'
    assert {"torque", "friction", "joint position", "support"} <= set(words)
    assert any(text.startswith("least -0.2 rad: FR calf at 1.") for text in words)
    assert "trunk: not possible" in words


def test_a_curve_below_its_limit_is_drawn_below_the_dashed_line(tmp_path: Path) -> None:
    verdict = made_up_verdict(3.0)
    only = replace(verdict, curves=(verdict.curves[2],))
    path = viz.export_plot(only, tmp_path / "m.svg", title="t")
    lines = list(ElementTree.fromstring(path.read_bytes()).iter(f"{_SVG}polyline"))
    (limit,) = [item for item in lines if item.get("stroke-dasharray")]
    (curve,) = [item for item in lines if not item.get("stroke-dasharray")]
    zero = _points(limit)[0, 1]
    points = _points(curve)
    middle = points[np.abs(np.arange(len(points)) - 200) < 30, 1]
    assert (middle > zero + 3).all()
    assert (points[:100, 1] < zero - 3).all()
    (red,) = [
        item
        for item in ElementTree.fromstring(path.read_bytes()).iter(f"{_SVG}polygon")
        if item.get("fill") == "#f3a7a7"
    ]
    assert _points(red)[:, 1].min() == pytest.approx(zero, abs=0.1)
    assert _points(red)[:, 1].max() == pytest.approx(middle.max(), abs=0.1)


def test_the_png_shows_what_is_broken(tmp_path: Path) -> None:
    path = viz.export_plot(made_up_verdict(3.0), tmp_path / "m.png", title="t")
    with Image.open(path) as image:
        picture = np.asarray(image.convert("RGB")).reshape(-1, 3)
    assert (picture == _FILL).all(axis=1).sum() > 2000
    calm = replace(made_up_verdict(3.0), curves=made_up_verdict(3.0).curves[:1])
    with Image.open(viz.export_plot(calm, tmp_path / "calm.png", title="t")) as image:
        picture = np.asarray(image.convert("RGB")).reshape(-1, 3)
    assert not (picture == _FILL).all(axis=1).any()


def test_other_suffixes_and_empty_verdicts_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"valid: \.svg, \.png"):
        viz.export_plot(made_up_verdict(3.0), tmp_path / "m.pdf", title="t")
    with pytest.raises(ConfigError, match="no margin to plot"):
        viz.export_plot(replace(made_up_verdict(3.0), curves=()), tmp_path / "m.svg", title="t")
    assert list(tmp_path.iterdir()) == []


def _points(line: ElementTree.Element) -> np.ndarray:
    pairs = (line.get("points") or "").split()
    return np.array([[float(value) for value in pair.split(",")] for pair in pairs])
