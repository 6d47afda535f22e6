"""The margins of a motion as one picture: a small curve for every limit, the limit as zero."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Bool

from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from viz.content import MarginCurve, Verdict
from viz.palette import ACCENT, INK, MUTED
from viz.render.sheets import PngSheet, Point, Sheet, SvgSheet

PLOT_SUFFIXES = (".svg", ".png")
_COLUMNS = 3
_WIDTH, _HEIGHT = 290.0, 118.0  # of one curve with its words
_MARGIN, _GAP, _HEAD = 24.0, 22.0, 64.0
_WORDS = 32.0  # height of the words over a curve
_TICK = 14.0  # height of the time axis under a curve
_ZERO_SHARE = 0.22  # least share of a curve's height below the limit, so that it shows
_BROKEN, _TIGHT, _FINE = "#dc2626", "#b45309", ACCENT
_PANEL, _BELOW, _FILL = "#f6f8fc", "#fdeeee", "#f3a7a7"
_GOOD = "#15803d"


def export_plot(verdict: Verdict, path: Path, *, title: str) -> Path:
    """Write the margins of every limit over time, the broken ones first.

    Args:
        verdict: what a check says.
        path: file to write, ``.svg`` or ``.png``.
        title: name of the motion.

    Returns:
        The absolute path.

    Raises:
        ConfigError: for a path that cannot be written, or a verdict without a curve.
    """
    target = checked_output(path, PLOT_SUFFIXES)
    curves = verdict.ranked()
    if not curves:
        raise ConfigError("there is no margin to plot: the check could not judge the motion")
    rows = -(-len(curves) // _COLUMNS)
    width = 2 * _MARGIN + _COLUMNS * _WIDTH + (_COLUMNS - 1) * _GAP
    height = _HEAD + rows * _HEIGHT + (rows - 1) * _GAP + _MARGIN
    kind = SvgSheet if target.suffix.lower() == ".svg" else PngSheet
    sheet = kind(width, height)
    _draw_head(sheet, verdict, title, width)
    end = max(float(curve.time[-1]) for curve in curves)
    for k, curve in enumerate(curves):
        row, column = divmod(k, _COLUMNS)
        corner = (_MARGIN + column * (_WIDTH + _GAP), _HEAD + row * (_HEIGHT + _GAP))
        _Panel(sheet, curve, corner, end).draw()
    return write_atomically(target, sheet.content())


def _draw_head(sheet: Sheet, verdict: Verdict, title: str, width: float) -> None:
    sheet.text((_MARGIN, 34), title, INK, 18, "l")
    sheet.text((width - _MARGIN, 34), verdict.text, _GOOD if verdict.ok else _BROKEN, 14, "r")
    note = "distance to every limit over time [s]; below the dashed line it is broken"
    sheet.text((_MARGIN, 52), note, MUTED, 11, "l")


class _Panel:
    """One curve with its words and axis."""

    def __init__(self, sheet: Sheet, curve: MarginCurve, corner: Point, end: float) -> None:
        self._sheet, self._curve = sheet, curve
        self._left, self._top = corner[0], corner[1] + _WORDS
        self._bottom = corner[1] + _HEIGHT - _TICK
        finite = curve.margin[np.isfinite(curve.margin)]
        high = max(float(finite.max(initial=0.0)), 1e-9)
        low = min(float(finite.min(initial=0.0)), 0.0)
        room = 0.08 * (high - low)
        self._high = high + room
        self._low = min(low - room, -_ZERO_SHARE / (1 - _ZERO_SHARE) * self._high)
        self._end = max(end, 1e-9)

    def draw(self) -> None:
        sheet, curve = self._sheet, self._curve
        is_tight = curve.least < curve.tight
        color = _BROKEN if curve.is_broken else _TIGHT if is_tight else _FINE
        right, zero = self._left + _WIDTH, self._y(0.0)
        sheet.area(_box(self._left, self._top, right, zero), _PANEL)
        sheet.area(_box(self._left, zero, right, self._bottom), _BELOW)
        sheet.text((self._left, self._top - 20), curve.name, INK, 13, "l")
        sheet.text((self._left, self._top - 6), self._least_words(), color, 11, "l")
        sheet.line([(self._left, zero), (right, zero)], _BROKEN, 1.0, dashed=True)
        for run in _runs(np.isfinite(curve.margin) & (len(curve.time) > 2)):
            self._draw_run(run, zero, color)
        if len(curve.time) <= 2:
            for time, margin in zip(curve.time, curve.margin, strict=True):
                if np.isfinite(margin):
                    sheet.dot((self._x(time), self._y(margin)), 3.0, color)
        for time, anchor in ((0.0, "l"), (self._end, "r")):
            place = (self._x(time), self._bottom + 11)
            sheet.text(place, f"{time:g}" if time == 0.0 else f"{time:.2f}", MUTED, 10, anchor)

    def _draw_run(self, run: slice, zero: float, color: str) -> None:
        time, margin = self._curve.time[run], self._curve.margin[run]
        points = [(self._x(t), self._y(m)) for t, m in zip(time, margin, strict=True)]
        if len(points) == 1:
            self._sheet.dot(points[0], 2.5, color)
            return
        if margin.min() < 0.0:
            below = [(x, max(y, zero)) for x, y in points]
            self._sheet.area([(points[0][0], zero), *below, (points[-1][0], zero)], _FILL)
        self._sheet.line(points, color, 1.4, dashed=False)

    def _least_words(self) -> str:
        curve = self._curve
        known = np.where(np.isnan(curve.margin), np.inf, curve.margin)
        row = int(known.argmin())
        subject = curve.subjects[int(curve.worst[row])].replace("_", " ")
        if not np.isfinite(curve.margin[row]):
            return f"{subject}: not possible"
        value = f"{float(curve.margin[row]):+.3g} {curve.unit}".strip()
        return f"least {value}: {subject} at {float(curve.time[row]):.2f} s"

    def _x(self, time: float) -> float:
        return self._left + _WIDTH * float(time) / self._end

    def _y(self, margin: float) -> float:
        share = (self._high - float(margin)) / (self._high - self._low)
        return self._top + (self._bottom - self._top) * share


def _box(left: float, top: float, right: float, bottom: float) -> list[Point]:
    return [(left, top), (right, top), (right, bottom), (left, bottom)]


def _runs(flags: Bool[np.ndarray, " n"]) -> list[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
