"""Reliability diagram: how often what was stated with a chance came true."""

from __future__ import annotations

import matplotlib
import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from viz.palette import ACCENT, INK, MUTED, TRACK
from viz.render.figure_style import STYLE

_SIZE = (4.6, 4.0)
"""Of the figure [inch]."""


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
        figure = Figure(figsize=_SIZE, layout="constrained")
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
