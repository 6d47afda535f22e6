"""Figures of the evidence: how exactly a speed is followed, how often what was stated came true."""

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from viz.style import ACCENT, INK, MUTED, STYLE, TRACK

_PANEL_SIZE, _DIAGRAM_SIZE = (3.0, 2.8), (4.6, 4.0)  # [inch]


@dataclass(frozen=True, slots=True)
class SpeedLine:
    """One line of a panel."""

    label: str  #: for the legend
    color: str  #: as ``#rrggbb``
    speeds: Float[np.ndarray, " n"]  #: told [m/s]
    values: Float[np.ndarray, " n"]  #: mean over the runs
    worst: Float[np.ndarray, " n"]
    """Of the runs, up to which a bar is drawn; nan where there is none."""


@dataclass(frozen=True, slots=True)
class SpeedPanel:
    """One quantity over the speed, in a logarithmic scale if it ``is_logarithmic``."""

    title: str
    lines: Sequence[SpeedLine]
    is_logarithmic: bool = False


def speed_figure(panels: Sequence[SpeedPanel]) -> Figure:
    """Errors of a robot over the speed that it is told: panels side by side, with one legend."""
    width, height = _PANEL_SIZE
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width * len(panels), height), layout="constrained")
        all_axes = np.atleast_1d(figure.subplots(1, len(panels)))
        for axes, panel in zip(all_axes, panels, strict=True):
            _draw_speeds(axes, panel)
        most = max(all_axes, key=lambda axes: len(axes.get_legend_handles_labels()[0]))
        figure.legend(
            *most.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False
        )
    return figure


def _draw_speeds(axes: Axes, panel: SpeedPanel) -> None:
    for line in panel.lines:
        axes.vlines(line.speeds, line.values, line.worst, color=line.color, lw=1.2, alpha=0.6)
        axes.plot(line.speeds, line.values, "o-", color=line.color, ms=3, lw=1.2, label=line.label)
    if panel.is_logarithmic:
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=0.0)
    axes.set_xlabel("speed told, m/s")
    axes.set_xlim(left=0.0)
    axes.grid(color=TRACK, lw=0.5)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(panel.title, loc="left", size=8.0, color=INK)


def reliability_figure(
    stated: Float[np.ndarray, " n"],
    done: Float[np.ndarray, " n"],
    counts: Float[np.ndarray, " n"],
    intervals: Float[np.ndarray, "n 2"],
    *,
    title: str,
) -> Figure:
    """Share that came true over the chance stated, in ``n`` bins, with their intervals.

    Args:
        stated: mean chance stated in each bin.
        done: share of it that came true.
        counts: runs in each bin.
        intervals: least and greatest share that each bin is compatible with.
        title: a line above the diagram.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=_DIAGRAM_SIZE, layout="constrained")
        axes = figure.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1.0], color=TRACK, lw=1.2)
        axes.vlines(stated, intervals[:, 0], intervals[:, 1], color=ACCENT, lw=1.6)
        axes.plot(stated, done, "o", color=INK, ms=4)
        for x, y, n in zip(stated, done, counts, strict=True):
            axes.annotate(f"{n:.0f}", (x, y), (5, -8), textcoords="offset points", color=MUTED)
        axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
        axes.set(xlabel="chance stated", ylabel="share done")
        axes.set_xticks(np.linspace(0.0, 1.0, 11), minor=True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_aspect("equal")
        axes.set_title(title, loc="left", size=8.0, color=INK)
    return figure
