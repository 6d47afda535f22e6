"""How exactly a robot follows a speed: its errors over the speed that it is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from viz.palette import INK, TRACK
from viz.render.figure_style import STYLE

_SIZE = (3.0, 2.8)
"""Of one panel [inch]."""


@dataclass(frozen=True, slots=True)
class SpeedLine:
    """One line of a panel.

    Attributes:
        label: for the legend.
        color: as ``#rrggbb``.
        speeds: told [m/s].
        values: mean over the runs.
        worst: of the runs, up to which a bar is drawn; nan where there is none.
    """

    label: str
    color: str
    speeds: Float[np.ndarray, " n"]
    values: Float[np.ndarray, " n"]
    worst: Float[np.ndarray, " n"]


@dataclass(frozen=True, slots=True)
class SpeedPanel:
    """One quantity over the speed, in a logarithmic scale if it ``is_logarithmic``."""

    title: str
    lines: Sequence[SpeedLine]
    is_logarithmic: bool = False


def speed_figure(panels: Sequence[SpeedPanel]) -> Figure:
    """The panels side by side, with one legend."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(_SIZE[0] * len(panels), _SIZE[1]), layout="constrained")
        all_axes = np.atleast_1d(figure.subplots(1, len(panels)))
        for axes, panel in zip(all_axes, panels, strict=True):
            _draw(axes, panel)
        most = max(all_axes, key=lambda axes: len(axes.get_legend_handles_labels()[0]))
        figure.legend(
            *most.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False
        )
    return figure


def _draw(axes: Axes, panel: SpeedPanel) -> None:
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
