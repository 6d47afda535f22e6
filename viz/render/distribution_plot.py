"""How values are spread over many runs: a histogram for each number, a bar for each rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output
from viz.style import ACCENT, INK, MUTED, PLOT_SUFFIXES, STYLE, TRACK, save_figure

RateWithInterval = tuple[float, float, float]
"""A share of the runs, and the lower and upper end of its interval; 0 to 1."""
MOST_PANELS = 60
"""Numbers that are drawn; the rest would not be legible."""
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
    target = checked_output(path, PLOT_SUFFIXES)
    return save_figure(distribution_figure(numbers, rates, title=title), target)


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
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        grid = figure.add_gridspec(rows, columns, wspace=0.3, hspace=0.75)
        grid.update(left=0.8 / width, right=1 - 0.25 / width)
        grid.update(bottom=_FOOT / height, top=1 - _HEAD / height)
        figure.text(
            0.15 / width, 1 - 0.35 / height, title, size=13, weight="bold", color=INK,
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
    axes.barh(places, share, height=0.6, color=ACCENT, alpha=0.5)
    axes.hlines(places, low, high, color=INK, lw=1.2)
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
        axes.hist(known, bins=bins.tolist(), color=ACCENT, alpha=0.5)
        axes.axvline(float(known.mean()), color=INK, lw=1.2)
    axes.locator_params(axis="both", nbins=4)
    _finish(axes, name, note)


def _finish(axes: Axes, title: str, note: str) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(length=2.5, pad=2, labelsize=7)
    axes.grid(axis="x", color=TRACK, lw=0.4)
    axes.set_axisbelow(True)
    text = axes.set_title(title, loc="left", size=9.0, weight="bold", color=INK)
    text.set_parse_math(False)
    axes.annotate(note, (1, 1), (0, 3), "axes fraction", "offset points", color=MUTED, ha="right")
