"""How outcomes depend on parameters: a curve with intervals, or a grid over two of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output
from viz.style import ACCENT, INK, MUTED, PLOT_SUFFIXES, STYLE, TRACK, save_figure

MOST_PANELS = 60
"""More would not be legible."""
_LINE, _GRID = (3.4, 2.2), (5.2, 4.2)  # [inch] width and height of a panel
_DARK = 0.6  # of a grid's colours: white letters above it


@typed()
@dataclass(frozen=True, slots=True)
class Relation:
    """An outcome over one parameter, or two.

    Attributes:
        over: the parameters.
        outcome: what depends on them.
        is_rate: it is a share of the runs, 0 to 1.
        labels: the bins of each parameter, in words.
        stats: mean, both ends of its 95 % interval, and number of runs, in each bin.
        places: of one parameter: its mean in each bin.
        dots: of one parameter and a number: both, of every run.
    """

    over: tuple[str, ...]
    outcome: str
    is_rate: bool
    labels: tuple[tuple[str, ...], ...]
    stats: Float[np.ndarray, "*bins 4"]
    places: Float[np.ndarray, " k"]
    dots: Float[np.ndarray, "n 2"]


@typed()
def export_relations(relations: Sequence[Relation], path: Path, *, title: str) -> Path:
    """Write a figure with a panel for each relation; gives the absolute path.

    Args:
        relations: those of one outcome side by side.
        path: file to write, ``.svg``, ``.png`` or ``.pdf``.
        title: what was run.

    Raises:
        ConfigError: for a path that cannot be written, or nothing to draw.
    """
    target = checked_output(path, PLOT_SUFFIXES)
    return save_figure(relation_figure(relations, title=title), target)


def relation_figure(relations: Sequence[Relation], *, title: str) -> Figure:
    """The same as a matplotlib figure; raises ConfigError if there is nothing to draw."""
    drawn = relations[:MOST_PANELS]
    if not drawn:
        raise ConfigError("there is nothing to plot: no outcome over a parameter")
    size = _LINE if len(drawn[0].over) == 1 else _GRID
    columns = sum(item.outcome == drawn[0].outcome for item in drawn)
    columns = columns if columns > 1 else min(len(drawn), 2)
    rows = -(-len(drawn) // columns)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(columns * size[0], rows * size[1] + 0.4), layout="constrained")
        head = figure.suptitle(title, x=0.01, ha="left", size=13, weight="bold", color=INK)
        head.set_parse_math(False)
        for axes, item in zip(np.ravel(figure.subplots(rows, columns)), drawn, strict=False):
            draw = _draw_line if len(item.over) == 1 else _draw_grid
            draw(axes, item)
            words = "rate" if item.is_rate else "mean"
            text = f"{item.outcome}: {words}, 95 %"
            axes.set_title(text, loc="left", size=9.0, color=INK).set_parse_math(False)
            axes.set_xlabel(item.over[0]).set_parse_math(False)
        for axes in figure.axes[len(drawn) :]:
            axes.remove()
    return figure


def _draw_line(axes: Axes, item: Relation) -> None:
    mean, low, high, count = item.stats.T
    axes.plot(*item.dots.T, ".", color=ACCENT, ms=3, alpha=0.3)
    known = count > 0
    axes.vlines(item.places[known], low[known], high[known], color=INK, lw=1.4)
    axes.plot(item.places[known], mean[known], "o-", color=INK, ms=4, lw=0.8)
    for x, y, n in zip(item.places[known], mean[known], count[known], strict=True):
        axes.annotate(f"{n:.0f}", (x, y), (4, -9), textcoords="offset points", color=MUTED, size=6)
    if item.is_rate:
        axes.set_ylim(-0.03, 1.03)
    axes.locator_params(axis="x", nbins=6)
    axes.grid(color=TRACK, lw=0.4)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_grid(axes: Axes, item: Relation) -> None:
    axes.set_ylabel(item.over[1]).set_parse_math(False)
    mean, low, high, count = np.moveaxis(item.stats, -1, 0)
    if not count.any():
        return
    ends = (0.0, 1.0) if item.is_rate else (np.nanmin(mean), np.nanmax(mean))
    span = max(ends[1] - ends[0], 1e-12)
    axes.imshow(mean.T, origin="lower", aspect="auto", cmap="Blues", vmin=ends[0], vmax=ends[1])
    form = ".2f" if item.is_rate else ".2g"
    for i, j in np.argwhere(count).tolist():
        color = "white" if (mean[i, j] - ends[0]) / span > _DARK else INK
        interval = f"{low[i, j]:{form}} to {high[i, j]:{form}}"
        words = f"{mean[i, j]:{form}}\n{interval}\nn = {count[i, j]:.0f}"
        axes.text(i, j, words, ha="center", va="center", color=color, size=6)
    for axis, names in ((axes.xaxis, item.labels[0]), (axes.yaxis, item.labels[1])):
        axis.set_ticks(range(len(names)), names, size=6)
    axes.tick_params(axis="x", rotation=30)
