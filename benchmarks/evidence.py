"""``python -m benchmarks evidence``: fills tables of the documentation from the results.

What was not measured stays as it is.

``evidence.json`` says, by the mark above a table, which metrics are its rows, what each is called,
how a value is printed, and what the closest peer reaches. A row has one metric with mean and worst,
or two: on the true state and on the robot's own sensors.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from controller.cli.common import ExitCode, plot_file
from go2_wbc.errors import ConfigError
from viz.style import ACCENT, INK, MUTED, STYLE, TIGHT, TRACK, save_figure

MARK, END = "<!-- evidence:", "<!-- evidence:end -->"
"""What stands above a table, with its name, and below it."""
TABLES = Path(__file__).with_suffix(".json")
SPEEDS = ("0.5", "1.0", "1.5", "2.0", "2.5", "3.0", "3.5")  #: Of the trot [m/s], in the figure
STATES = (("true state", ACCENT), ("own sensors", TIGHT))
PEER = {0.5: 7.0, 0.8: 9.5, 1.0: 12.0}
"""Mean error [%] of go2-convex-mpc over its speed [m/s], on the true state (measured 2026-11)."""
PANELS = (
    ("mean", "error of the mean speed, %", "log"),
    ("mae", "mean absolute error, m/s", "linear"),
    ("saturated", "ticks with a motor at all it has, %", "linear"),
)
FIGURE_SIZE = (9.0, 2.8)  # [inch]
Row = Mapping[str, Any]  #: A row of a benchmark's JSON


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a table."""

    metrics: tuple[str, ...]
    """Whose values it shows, one or two; empty where one of two states has none."""
    what: str  #: in words
    shown: str  #: how a value is printed
    peer: str = ""  #: a value to compare it with
    bar: str = ""  #: of a line of two metrics, what is asked for

    def text(self, rows: Mapping[str, Row]) -> str:
        """The line, from the results by metric.

        Raises:
            ConfigError: if a metric is missing or has no value.
        """
        metric, *more = self.metrics
        if more:
            cells = [self.bar, *(self._cell(rows, name) if name else "-" for name in self.metrics)]
        else:
            found = self._found(rows, metric, "mean", "worst")
            cells = [str(found["n"]), *(self.shown.format(found[key]) for key in ("mean", "worst"))]
        return f"| {' | '.join([self.what, *cells, self.peer])} |"

    @staticmethod
    def _found(rows: Mapping[str, Row], name: str, *needed: str) -> Row:
        found = rows.get(name)
        if found is None or any(found[key] is None for key in needed):
            raise ConfigError(f"the results have no value for {name}")
        return found

    def _cell(self, rows: Mapping[str, Row], name: str) -> str:
        has_fallen = bool(rows.get(name, {}).get("falls"))
        found = self._found(rows, name, *([] if has_fallen else ["mean"]))
        if found["mean"] is None:
            who = "all" if found["falls"] == found["n"] else found["falls"]
            return f"{who} failed (n {found['n']})"
        values = (found[key] for key in ("mean", "sd", "worst"))
        numbers = "; ".join("-" if value is None else self.shown.format(value) for value in values)
        failed = f", {found['falls']} failed" if found["falls"] else ""
        return f"{numbers} (n {found['n']}{failed})"


@dataclass(frozen=True, slots=True)
class Table:
    """A table of the documentation."""

    head: tuple[str, ...]  #: titles of its columns
    lines: tuple[Line, ...]

    @property
    def metrics(self) -> set[str]:
        """All that it shows."""
        return {name for line in self.lines for name in line.metrics if name}

    def text(self, rows: Mapping[str, Row], before: str = "") -> str:
        """The table as Markdown, from the results by metric; raises as a line does.

        A line of which nothing was measured stays as it was ``before``.
        """
        found = [f"| {' | '.join(self.head)} |", "|" + "---|" * len(self.head)]
        old = [*before.splitlines()[len(found) :], *("" for _ in self.lines)]
        for line, was in zip(self.lines, old, strict=False):
            stays = rows.keys().isdisjoint(line.metrics) and was.startswith(f"| {line.what} |")
            found.append(was if stays else line.text(rows))
        return "\n".join(found)


@cache
def tables() -> dict[str, Table]:
    """All tables, by the name in the mark above them."""
    read = json.loads(TABLES.read_text(encoding="utf-8"))
    return {
        name: Table(tuple(table["head"]), tuple(map(_line, table["rows"])))
        for name, table in read.items()
    }


def _line(row: list[str]) -> Line:
    if len(row) == 4:
        metric, what, shown, peer = row
        return Line((metric,), what, shown, peer)
    truth, sensors, what, bar, shown, peer = row
    return Line((truth, sensors), what, shown, peer, bar)


def run(
    page: Annotated[Path, "PAGE", "with tables to fill"],
    results: Annotated[tuple[Path, ...], "JSON", "what --out of a benchmark wrote"] = (),
    *,
    plot: Annotated[
        Path | None, "FILE", "also draw the trot's errors over its speed", plot_file
    ] = None,
) -> int:
    """Fill the tables of a page from what the benchmarks' `--out` wrote.

    Those of whose metrics there are some; of several files, the last one that has a metric.

    Examples:
    python -m benchmarks evidence docs/evidence.md behaviour.json
    python -m benchmarks evidence docs/explanation/speed.md speed.json
    python -m benchmarks evidence docs/evidence.md locomotion.json balance.json
                                  --plot docs/images/speeds.svg
    """
    rows = {}
    for file in results:
        rows |= rows_of(file)
    text = filled(page.read_text(encoding="utf-8"), rows)
    page.write_text(text, encoding="utf-8")
    if plot is not None:
        save_speeds(rows, plot)
    return ExitCode.OK


def rows_of(file: Path) -> dict[str, Row]:
    """The rows of what a benchmark's ``--out`` wrote, by their names.

    Raises:
        ConfigError: if the file is none of these.
    """
    try:
        return {row["name"]: row for row in json.loads(file.read_text(encoding="utf-8"))["rows"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{file} is not what --out of a benchmark writes: {error}") from error


def filled(text: str, rows: Mapping[str, Row]) -> str:
    """``text`` with those tables between marks replaced of which ``rows`` has any metric.

    Raises:
        ConfigError: if there is no such table, its end is missing, or one of its metrics.
    """
    marks = {f"{MARK}{name}": table for name, table in tables().items()}
    wanted = {m: t for m, t in marks.items() if m in text and not t.metrics.isdisjoint(rows)}
    if not wanted:
        raise ConfigError(f"the text has no {MARK}... {END} for these results")
    for mark, table in wanted.items():
        start = text.index("\n", text.index(mark)) + 1
        end = text.find(END, start)
        if end < 0:
            raise ConfigError(f"the text has no {END} after {mark}")
        text = f"{text[:start]}{table.text(rows, text[start:end])}\n{text[end:]}"
    return text


def names_of(speed: str) -> tuple[str, str]:
    """The studies of a speed of the trot, on the true state and on sensors."""
    return f"ahead-{speed}", f"sensed-{float(speed):g}"


def save_speeds(rows: Mapping[str, Row], path: Path) -> Path:
    """Draw mean and worst of the trot's errors over its speed, beside the closest peer's.

    Raises:
        ConfigError: if none of the results is of a speed.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=FIGURE_SIZE, layout="constrained")
        for axes, (metric, title, scale) in zip(figure.subplots(1, 3), PANELS, strict=True):
            for label, color, points in _lines(rows, metric):
                speeds, means, worst = np.array(points, float).T  # None is nan
                axes.vlines(speeds, means, worst, color=color, lw=1.2, alpha=0.6)
                axes.plot(speeds, means, "o-", color=color, ms=3, lw=1.2, label=label)
            axes.set(yscale=scale, xlabel="speed told, m/s")
            axes.set_ylim(bottom=0.0 if scale == "linear" else None)
            axes.set_xlim(left=0.0)
            axes.grid(color=TRACK, lw=0.5)
            axes.spines[["top", "right"]].set_visible(False)
            axes.set_title(title, loc="left", size=8.0, color=INK)
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    if not labels:
        raise ConfigError("the results have no speeds to draw: run `benchmarks locomotion` first")
    return save_figure(figure, path)


def _lines(rows: Mapping[str, Row], metric: str) -> Iterator[tuple[str, str, list]]:
    """Label, colour and points of each line: speed, mean, worst."""
    has_any = False
    for state, (label, color) in enumerate(STATES):
        found = [(speed, rows.get(f"{names_of(speed)[state]}.{metric}")) for speed in SPEEDS]
        known = [(speed, row) for speed, row in found if row and row["mean"] is not None]
        if known:
            has_any = True
            yield label, color, [(speed, row["mean"], row["worst"]) for speed, row in known]
    if metric == "mean" and has_any:
        points = [(speed, error, error) for speed, error in PEER.items()]
        yield "closest peer, true state", MUTED, points
