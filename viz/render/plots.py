"""The margins of a motion, a small curve for every limit; and figures of many runs.

They draw on a ``Figure`` of their own, without pyplot: no window system, no shared state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from viz import style
from viz.content import MarginCurve, Verdict

_M_COLUMNS = 3
_M_PANEL = (3.6, 1.75)  # [inch] width and height of one curve with its words
_M_HEAD, _M_FOOT = 1.05, 0.45  # [inch] above and below the curves
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
    target = checked_output(path, style.PLOT_SUFFIXES)
    return style.save_figure(margin_figure(verdict, title=title), target)


@typed()
def margin_figure(verdict: Verdict, *, title: str) -> Figure:
    """The same as a matplotlib figure, to be changed or shown in a notebook.

    Raises:
        ConfigError: for a verdict without a curve.
    """
    curves = verdict.ranked()
    if not curves:
        raise ConfigError("there is no margin to plot: the check could not judge the motion")
    rows = -(-len(curves) // _M_COLUMNS)
    width, height = _M_COLUMNS * _M_PANEL[0], _M_HEAD + rows * _M_PANEL[1] + _M_FOOT
    end = max(float(curve.time[-1]) for curve in curves)
    with matplotlib.rc_context(style.STYLE):
        figure = Figure(figsize=(width, height))
        grid = figure.add_gridspec(rows, _M_COLUMNS, wspace=0.24, hspace=0.72)
        grid.update(left=0.6 / width, right=1 - 0.25 / width)
        grid.update(bottom=_M_FOOT / height, top=1 - _M_HEAD / height)
        _write_head(figure, verdict, title)
        for k, curve in enumerate(curves):
            axes = figure.add_subplot(grid[divmod(k, _M_COLUMNS)])
            axes.set_xlim(0.0, max(end, 1e-9))
            _draw(axes, curve)
            if k + _M_COLUMNS >= len(curves):
                axes.set_xlabel("time [s]")
    return figure


def _write_head(figure: Figure, verdict: Verdict, title: str) -> None:
    width, height = figure.get_size_inches()
    left, right, top = 0.15 / width, 1 - 0.25 / width, 1 - 0.3 / height
    note = "what is left to every limit over time; below the dashed line it is broken"
    color = style.GOOD if verdict.ok else style.ALARM
    figure.text(left, top, title, size=14, weight="bold", color=style.INK, parse_math=False)
    figure.text(right, top, verdict.text, size=11, color=color, ha="right", parse_math=False)
    figure.text(left, top - 0.18 / height, note, color=style.MUTED)


def _draw(axes: Axes, curve: MarginCurve) -> None:
    time, margin = curve.time, np.where(np.isfinite(curve.margin), curve.margin, np.nan)
    high = 1.08 * max(float(np.nanmax(margin, initial=0.0)), 1e-9)
    low = min(1.08 * float(np.nanmin(margin, initial=0.0)), -_ZERO_SHARE / (1 - _ZERO_SHARE) * high)
    color = (
        style.ALARM
        if curve.is_broken
        else style.TIGHT
        if curve.least < curve.tight
        else style.ACCENT
    )
    axes.set_ylim(low, high)
    axes.axhspan(0.0, high, color=_ABOVE, zorder=0, lw=0)
    axes.axhspan(low, 0.0, color=_BELOW, zorder=0, lw=0)
    axes.axhline(0.0, color=style.ALARM, lw=0.9, ls=(0, (4, 3)))
    axes.fill_between(time, np.minimum(margin, 0.0), 0.0, color=style.BROKEN_FILL, lw=0)
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
    axes.set_title(curve.name, loc="left", size=9.5, weight="bold", color=style.INK, pad=17)
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


RateWithInterval = tuple[float, float, float]
"""A share of the runs, and the lower and upper end of its interval; 0 to 1."""
MOST_PANELS = 60  #: Panels that are drawn; more would not be legible
_COLUMNS = 3
_PANEL = (3.2, 1.7)  # [inch] width and height of one panel with its words
_HEAD, _FOOT = 0.8, 0.3  # [inch] above and below the panels
_BINS = 30


@typed()
def export_distributions(
    numbers: Mapping[str, Sequence[float]],
    rates: Mapping[str, RateWithInterval],
    path: Path,
    *,
    title: str,
) -> Path:
    """Write a figure of many runs; gives the absolute path.

    Args:
        numbers: the values of all runs by name; what is not finite is left out, and counted.
        rates: shares of the runs by name.
        path: file to write, ``.svg``, ``.png`` or ``.pdf``.
        title: what was run.

    Raises:
        ConfigError: for a path that cannot be written, or nothing to draw.
    """
    target = checked_output(path, style.PLOT_SUFFIXES)
    return style.save_figure(distribution_figure(numbers, rates, title=title), target)


def distribution_figure(
    numbers: Mapping[str, Sequence[float]], rates: Mapping[str, RateWithInterval], *, title: str
) -> Figure:
    """The same as a matplotlib figure; raises ConfigError if there is nothing to draw."""
    drawn = dict(list(numbers.items())[:MOST_PANELS])
    count = bool(rates) + len(drawn)
    if not count:
        raise ConfigError("there is nothing to plot: no number and no rate")
    rows, columns = -(-count // _COLUMNS), min(count, _COLUMNS)
    width, height = _COLUMNS * _PANEL[0], _HEAD + rows * _PANEL[1] + _FOOT
    with matplotlib.rc_context(style.STYLE):
        figure = Figure(figsize=(width, height))
        grid = figure.add_gridspec(rows, columns, wspace=0.3, hspace=0.75)
        grid.update(left=0.8 / width, right=1 - 0.25 / width)
        grid.update(bottom=_FOOT / height, top=1 - _HEAD / height)
        figure.text(
            0.15 / width, 1 - 0.35 / height, title, size=13, weight="bold", color=style.INK,
            parse_math=False,
        )  # fmt: skip
        panels = [figure.add_subplot(grid[divmod(k, columns)]) for k in range(count)]
        if rates:
            _draw_rates(panels.pop(0), rates)
        for axes, (name, values) in zip(panels, drawn.items(), strict=True):
            _draw_numbers(axes, name, np.asarray(values, dtype=float))
    return figure


def _draw_rates(axes: Axes, rates: Mapping[str, RateWithInterval]) -> None:
    places = np.arange(len(rates))
    share, low, high = np.array(list(rates.values())).T
    axes.barh(places, share, height=0.6, color=style.ACCENT, alpha=0.5)
    axes.hlines(places, low, high, color=style.INK, lw=1.2)
    axes.set_yticks(places, [name.replace("$", r"\$") for name in rates])
    axes.set_xlim(0.0, 1.0)
    axes.invert_yaxis()
    _finish(axes, "share of the runs, 95 % interval", "")


def _draw_numbers(axes: Axes, name: str, values: np.ndarray) -> None:
    known = values[np.isfinite(values)]
    missing = len(values) - len(known)
    note = f"not in {missing} of {len(values)}" if missing else ""
    if len(known):
        low, high = float(known.min()), float(known.max())
        margin = 0.5 * max(abs(low) * 1e-6, 1e-12) if np.isclose(low, high, 1e-9) else 0.0
        bins = np.linspace(low - margin, high + margin, min(_BINS, max(len(known), 2)) + 1)
        axes.hist(known, bins=bins.tolist(), color=style.ACCENT, alpha=0.5)
        axes.axvline(float(known.mean()), color=style.INK, lw=1.2)
    axes.locator_params(axis="both", nbins=4)
    _finish(axes, name, note)


def _finish(axes: Axes, title: str, note: str) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(length=2.5, pad=2, labelsize=7)
    axes.grid(axis="x", color=style.TRACK, lw=0.4)
    axes.set_axisbelow(True)
    text = axes.set_title(title, loc="left", size=9.0, weight="bold", color=style.INK)
    text.set_parse_math(False)
    axes.annotate(
        note, (1, 1), (0, 3), "axes fraction", "offset points", color=style.MUTED, ha="right"
    )


_LINE, _GRID = (3.4, 2.2), (5.2, 4.2)  # [inch] width and height of a panel
_DARK = 0.6  # of a grid's colours: white letters above it


@typed()
@dataclass(frozen=True, slots=True)
class Relation:
    """An outcome over one parameter, or two."""

    over: tuple[str, ...]  #: the parameters
    outcome: str  #: what depends on them
    is_rate: bool  #: it is a share of the runs, 0 to 1
    labels: tuple[tuple[str, ...], ...]  #: the bins of each parameter, in words
    stats: Float[np.ndarray, "*bins 4"]
    """Mean, both ends of its 95 % interval, and number of runs, in each bin."""
    places: Float[np.ndarray, " k"]  #: of one parameter: its mean in each bin
    dots: Float[np.ndarray, "n 2"]  #: of one parameter and a number: both, of every run


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
    target = checked_output(path, style.PLOT_SUFFIXES)
    return style.save_figure(relation_figure(relations, title=title), target)


def relation_figure(relations: Sequence[Relation], *, title: str) -> Figure:
    """The same as a matplotlib figure; raises ConfigError if there is nothing to draw."""
    drawn = relations[:MOST_PANELS]
    if not drawn:
        raise ConfigError("there is nothing to plot: no outcome over a parameter")
    size = _LINE if len(drawn[0].over) == 1 else _GRID
    columns = sum(item.outcome == drawn[0].outcome for item in drawn)
    columns = columns if columns > 1 else min(len(drawn), 2)
    rows = -(-len(drawn) // columns)
    with matplotlib.rc_context(style.STYLE):
        figure = Figure(figsize=(columns * size[0], rows * size[1] + 0.4), layout="constrained")
        head = figure.suptitle(title, x=0.01, ha="left", size=13, weight="bold", color=style.INK)
        head.set_parse_math(False)
        for axes, item in zip(np.ravel(figure.subplots(rows, columns)), drawn, strict=False):
            draw = _draw_line if len(item.over) == 1 else _draw_grid
            draw(axes, item)
            words = "rate" if item.is_rate else "mean"
            text = f"{item.outcome}: {words}, 95 %"
            axes.set_title(text, loc="left", size=9.0, color=style.INK).set_parse_math(False)
            axes.set_xlabel(item.over[0]).set_parse_math(False)
        for axes in figure.axes[len(drawn) :]:
            axes.remove()
    return figure


def _draw_line(axes: Axes, item: Relation) -> None:
    mean, low, high, count = item.stats.T
    axes.plot(*item.dots.T, ".", color=style.ACCENT, ms=3, alpha=0.3)
    known = count > 0
    axes.vlines(item.places[known], low[known], high[known], color=style.INK, lw=1.4)
    axes.plot(item.places[known], mean[known], "o-", color=style.INK, ms=4, lw=0.8)
    for x, y, n in zip(item.places[known], mean[known], count[known], strict=True):
        axes.annotate(
            f"{n:.0f}", (x, y), (4, -9), textcoords="offset points", color=style.MUTED, size=6
        )
    if item.is_rate:
        axes.set_ylim(-0.03, 1.03)
    axes.locator_params(axis="x", nbins=6)
    axes.grid(color=style.TRACK, lw=0.4)
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
        color = "white" if (mean[i, j] - ends[0]) / span > _DARK else style.INK
        interval = f"{low[i, j]:{form}} to {high[i, j]:{form}}"
        words = f"{mean[i, j]:{form}}\n{interval}\nn = {count[i, j]:.0f}"
        axes.text(i, j, words, ha="center", va="center", color=color, size=6)
    for axis, names in ((axes.xaxis, item.labels[0]), (axes.yaxis, item.labels[1])):
        axis.set_ticks(range(len(names)), names, size=6)
    axes.tick_params(axis="x", rotation=30)
