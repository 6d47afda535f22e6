"""``python -m benchmarks evidence``: fills tables of the documentation from the results.

What was not measured stays as it is.

``evidence.json`` says, by the mark above a table, which metrics are its rows, what each is called,
how a value is printed, and what the closest peer reaches. A row has one metric with mean and worst,
or two: on the true state and on the robot's own sensors.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from benchmarks.figures import SpeedLine, SpeedPanel, speed_figure
from controller.cli.common import ExitCode, plot_file
from go2_wbc.errors import ConfigError
from viz.style import ACCENT, MUTED, TIGHT, save_figure

MARK, END = "<!-- evidence:", "<!-- evidence:end -->"
"""What stands above a table, with its name, and below it."""
TABLES = Path(__file__).with_suffix(".json")
SPEEDS = ("0.5", "1.0", "1.5", "2.0", "2.5", "3.0", "3.5")  #: Of the trot [m/s], in the figure
STATES = (("true state", ACCENT), ("own sensors", TIGHT))
PEER = {0.5: 7.0, 0.8: 9.5, 1.0: 12.0}
"""Mean error [%] of go2-convex-mpc over its speed [m/s], on the true state (measured 2026-11)."""
PANELS = (
    ("mean", "error of the mean speed, %", True),
    ("mae", "mean absolute error, m/s", False),
    ("saturated", "ticks with a motor at all it has, %", False),
)
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
        cells = [self.what, *(self._pair(rows) if len(self.metrics) > 1 else self._one(rows))]
        return f"| {' | '.join([*cells, self.peer])} |"

    def _one(self, rows: Mapping[str, Row]) -> list[str]:
        (metric,) = self.metrics
        found = rows.get(metric)
        if found is None or found["mean"] is None or found["worst"] is None:
            raise ConfigError(f"the results have no value for {metric}")
        return [str(found["n"]), *(self.shown.format(found[key]) for key in ("mean", "worst"))]

    def _pair(self, rows: Mapping[str, Row]) -> list[str]:
        return [self.bar, *(self._cell(rows, name) if name else "-" for name in self.metrics)]

    def _cell(self, rows: Mapping[str, Row], name: str) -> str:
        found = rows.get(name)
        if found is None or (found["mean"] is None and not found["falls"]):
            raise ConfigError(f"the results have no value for {name}")
        if found["mean"] is None:
            who = "all" if found["falls"] == found["n"] else found["falls"]
            return f"{who} fell (n {found['n']})"
        values = (found[key] for key in ("mean", "sd", "worst"))
        numbers = "; ".join("-" if value is None else self.shown.format(value) for value in values)
        fell = f", {found['falls']} fell" if found["falls"] else ""
        return f"{numbers} (n {found['n']}{fell})"


@dataclass(frozen=True, slots=True)
class Table:
    """A table of the documentation: the titles of its columns, and its lines."""

    head: tuple[str, ...]
    lines: tuple[Line, ...]

    @property
    def metrics(self) -> set[str]:
        """All that it shows."""
        return {name for line in self.lines for name in line.metrics if name}

    def text(self, rows: Mapping[str, Row], before: str = "") -> str:
        """The table as Markdown, from the results by metric.

        A line of which nothing was measured stays as it was ``before``.

        Raises:
            ConfigError: if a metric is missing or has no value.
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
    python -m benchmarks evidence docs/evidence.md locomotion.json balance.json
    python -m benchmarks evidence docs/explanation/speed.md speed.json
    python -m benchmarks evidence docs/evidence.md behaviour.json more.json
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
    panels = [
        SpeedPanel(title, _lines(rows, metric), is_logarithmic)
        for metric, title, is_logarithmic in PANELS
    ]
    if not any(panel.lines for panel in panels):
        raise ConfigError("the results have no speeds to draw: run `benchmarks locomotion` first")
    return save_figure(speed_figure(panels), path)


def _lines(rows: Mapping[str, Row], metric: str) -> list[SpeedLine]:
    lines = []
    for state, (label, color) in enumerate(STATES):
        found = {
            float(speed): row
            for speed in SPEEDS
            if (row := rows.get(f"{names_of(speed)[state]}.{metric}")) and row["mean"] is not None
        }
        if found:
            means = np.array([row["mean"] for row in found.values()], float)
            worst = np.array([row["worst"] for row in found.values()], float)  # None is nan
            lines.append(SpeedLine(label, color, np.array([*found]), means, worst))
    if metric == "mean" and lines:
        speeds, errors = np.array([*PEER]), np.array([*PEER.values()])
        lines.append(SpeedLine("closest peer, true state", MUTED, speeds, errors, errors))
    return lines
