"""The picture of the margins, and what it says."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import viz
from go2_wbc.errors import ConfigError
from tests.viz.verdicts import made_up_verdict
from viz.content import MarginCurve, Verdict

_SVG = "{http://www.w3.org/2000/svg}"
_FILL = (243, 167, 167)


def test_the_svg_names_every_limit_and_the_worst_subject(tmp_path: Path) -> None:
    path = viz.export_plot(made_up_verdict(3.0), tmp_path / "m.svg", title='a < "b" $c$')
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    words = [item.text or "" for item in root.iter(f"{_SVG}text")]
    assert {'a < "b" $c$', "torque", "friction", "joint position", "support"} <= set(words)
    assert {"margin [rad]", "margin [N m]", "time [s]", "2 limits broken, 1 tight margin"} <= set(
        words
    )
    assert any(text.startswith("least -0.2 rad: FR calf at 1.") for text in words)
    assert "trunk: not possible" in words


@pytest.mark.parametrize("suffix", viz.PLOT_SUFFIXES)
def test_the_same_verdict_gives_the_same_file(tmp_path: Path, suffix: str) -> None:
    files = [tmp_path / f"{name}{suffix}" for name in ("a", "b")]
    first, second = (viz.export_plot(made_up_verdict(3.0), file, title="t") for file in files)
    assert first.read_bytes() == second.read_bytes()


def test_a_curve_below_its_limit_is_drawn_and_filled_below_the_dashed_line() -> None:
    verdict = made_up_verdict(3.0)
    curve = verdict.curves[2]
    (axes,) = viz.margin_figure(replace(verdict, curves=(curve,)), title="t").axes
    limit, margin, _ = axes.lines
    assert limit.get_linestyle() == "--"
    np.testing.assert_array_equal(limit.get_ydata(), 0.0)
    np.testing.assert_array_equal(margin.get_xdata(), curve.time)
    np.testing.assert_array_equal(margin.get_ydata(), curve.margin)
    low, high = axes.get_ylim()
    assert low < -0.2 < 0.5 < high
    (red,) = axes.collections
    box = red.get_datalim(axes.transData)
    assert (box.y0, box.y1) == pytest.approx((-0.2, 0.0))
    broken = curve.time[curve.margin < 0]
    deep = np.concatenate([path.vertices for path in red.get_paths()])
    deep = deep[deep[:, 1] < -0.1, 0]
    assert (deep.min(), deep.max()) == pytest.approx((broken[0], broken[-1]))


def test_broken_limits_come_first_and_instants_are_dots() -> None:
    axes = viz.margin_figure(made_up_verdict(3.0), title="t").axes
    names = [panel.get_title(loc="left") for panel in axes]
    assert names == ["joint position", "support", "entry and exit", "friction", "torque"]
    curve = MarginCurve("landing", "m", np.arange(3.0), np.array([np.nan, 0.1, np.nan]), ("FR",),
                        np.zeros(3, dtype=int))  # fmt: skip
    (panel,) = viz.margin_figure(Verdict(True, "feasible", (), (curve,)), title="t").axes
    dots = panel.lines[2]
    np.testing.assert_array_equal(dots.get_xydata(), [[1.0, 0.1]])
    assert dots.get_marker() == "o"


def test_the_png_shows_what_is_broken(tmp_path: Path) -> None:
    path = viz.export_plot(made_up_verdict(3.0), tmp_path / "m.png", title="t")
    assert _filled(path) > 2000
    calm = replace(made_up_verdict(3.0), curves=made_up_verdict(3.0).curves[:1])
    assert _filled(viz.export_plot(calm, tmp_path / "calm.png", title="t")) == 0


def _filled(path: Path) -> int:
    """Pixels between a curve and the limit that it breaks."""
    with Image.open(path) as image:
        return int((np.asarray(image.convert("RGB")) == _FILL).all(axis=2).sum())


def test_empty_verdicts_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no margin to plot"):
        viz.export_plot(replace(made_up_verdict(3.0), curves=()), tmp_path / "m.svg", title="t")
    assert list(tmp_path.iterdir()) == []
