"""The margins of a motion as one picture: a small curve for every limit, the limit as zero.

Draws on a ``Figure`` of its own, without pyplot: no window system, and no state that others share.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output
from viz.content import MarginCurve, Verdict
from viz.style import (
    ACCENT,
    ALARM,
    BROKEN_FILL,
    GOOD,
    INK,
    MUTED,
    PLOT_SUFFIXES,
    STYLE,
    TIGHT,
    save_figure,
)

_COLUMNS = 3
_PANEL = (3.6, 1.75)  # [inch] width and height of one curve with its words
_HEAD, _FOOT = 1.05, 0.45  # [inch] above and below the curves
_ZERO_SHARE = 0.22  # least share of a curve's height below the limit, so that it shows
_ABOVE, _BELOW = "#f6f8fc", "#fdeeee"


@typed()
def export_plot(verdict: Verdict, path: Path, *, title: str) -> Path:
    """Write the margins of every limit over time, the broken ones first; gives the absolute path.

    Args:
        verdict: what a check says.
        path: file to write, ``.svg``, ``.png`` or ``.pdf``.

    Raises:
        ConfigError: for a path that cannot be written, or a verdict without a curve.
    """
    target = checked_output(path, PLOT_SUFFIXES)
    return save_figure(margin_figure(verdict, title=title), target)


@typed()
def margin_figure(verdict: Verdict, *, title: str) -> Figure:
    """The same as a matplotlib figure, to be changed or shown in a notebook.

    Raises:
        ConfigError: for a verdict without a curve.
    """
    curves = verdict.ranked()
    if not curves:
        raise ConfigError("there is no margin to plot: the check could not judge the motion")
    rows = -(-len(curves) // _COLUMNS)
    width, height = _COLUMNS * _PANEL[0], _HEAD + rows * _PANEL[1] + _FOOT
    end = max(float(curve.time[-1]) for curve in curves)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        grid = figure.add_gridspec(rows, _COLUMNS, wspace=0.24, hspace=0.72)
        grid.update(left=0.6 / width, right=1 - 0.25 / width)
        grid.update(bottom=_FOOT / height, top=1 - _HEAD / height)
        _write_head(figure, verdict, title)
        for k, curve in enumerate(curves):
            axes = figure.add_subplot(grid[divmod(k, _COLUMNS)])
            axes.set_xlim(0.0, max(end, 1e-9))
            _draw(axes, curve)
            if k + _COLUMNS >= len(curves):
                axes.set_xlabel("time [s]")
    return figure


def _write_head(figure: Figure, verdict: Verdict, title: str) -> None:
    width, height = figure.get_size_inches()
    left, right, top = 0.15 / width, 1 - 0.25 / width, 1 - 0.3 / height
    note = "what is left to every limit over time; below the dashed line it is broken"
    color = GOOD if verdict.ok else ALARM
    figure.text(left, top, title, size=14, weight="bold", color=INK, parse_math=False)
    figure.text(right, top, verdict.text, size=11, color=color, ha="right", parse_math=False)
    figure.text(left, top - 0.18 / height, note, color=MUTED)


def _draw(axes: Axes, curve: MarginCurve) -> None:
    time, margin = curve.time, np.where(np.isfinite(curve.margin), curve.margin, np.nan)
    high = 1.08 * max(float(np.nanmax(margin, initial=0.0)), 1e-9)
    low = min(1.08 * float(np.nanmin(margin, initial=0.0)), -_ZERO_SHARE / (1 - _ZERO_SHARE) * high)
    color = ALARM if curve.is_broken else TIGHT if curve.least < curve.tight else ACCENT
    axes.set_ylim(low, high)
    axes.axhspan(0.0, high, color=_ABOVE, zorder=0, lw=0)
    axes.axhspan(low, 0.0, color=_BELOW, zorder=0, lw=0)
    axes.axhline(0.0, color=ALARM, lw=0.9, ls=(0, (4, 3)))
    axes.fill_between(time, np.minimum(margin, 0.0), 0.0, color=BROKEN_FILL, lw=0)
    # Two samples are two instants; and one between two that are not known has no line.
    known = np.pad(~np.isnan(margin), 1)
    alone = known[1:-1] & ((~known[:-2] & ~known[2:]) | (len(time) <= 2))
    axes.plot(time, np.where(alone, np.nan, margin), color=color, lw=1.3)
    axes.plot(time[alone], margin[alone], "o", color=color, ms=4, clip_on=False)
    axes.set_ylabel(f"margin [{curve.unit}]" if curve.unit else "margin")
    axes.yaxis.set_label_coords(-0.125, 0.5)
    if known.any():
        axes.locator_params(axis="y", nbins=4)
    else:
        axes.set_yticks([0.0])
    axes.tick_params(length=2.5, pad=2, labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(curve.name, loc="left", size=9.5, weight="bold", color=INK, pad=17)
    axes.annotate(
        _least_words(curve), (0, 1), (0, 6), "axes fraction", "offset points", color=color
    )


def _least_words(curve: MarginCurve) -> str:
    known = np.where(np.isnan(curve.margin), np.inf, curve.margin)
    row = int(known.argmin())
    subject = curve.subjects[int(curve.worst[row])].replace("_", " ")
    if not np.isfinite(curve.margin[row]):
        return f"{subject}: not possible"
    value = f"{float(curve.margin[row]):+.3g} {curve.unit}".strip()
    return f"least {value}: {subject} at {float(curve.time[row]):.2f} s"
