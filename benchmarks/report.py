"""Means, worst seeds and verdicts of the rows, as a table of at most 80 columns and as JSON."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import fmean

from benchmarks.rows import Family, Measurement, Row
from benchmarks.runner import Results

WIDTH = 80
_LINE = "  {quantity:<28}{bar:>13}{n:>4}{mean:>9}{worst:>9}{seed:>5}{falls:>5} {verdict}"
_NOTES = 3
"""Failed seeds of a row whose reasons are printed; JSON has all."""


@dataclass(frozen=True, slots=True)
class RowResult:
    """A row over all its seeds.

    Attributes:
        row: the row.
        n: number of seeds that were run.
        mean: over the seeds that gave a value; None if none did.
        worst: the worst value; None if a seed gave none, since nothing is worse than that.
        worst_seed: the seed of ``worst``, or the first that gave no value.
        values: by seed.
        failures: by seed, why the robot fell or did not do what it was asked.
    """

    row: Row
    n: int
    mean: float | None
    worst: float | None
    worst_seed: int | None
    values: Mapping[int, float]
    failures: Mapping[int, str]

    @property
    def falls(self) -> int:
        """How many seeds failed: the robot fell or did not do what it was asked."""
        return len(self.failures)

    @property
    def passed(self) -> bool | None:
        """Whether the mean meets the bar and no seed failed; None for a row without a bar."""
        if self.row.bar is None:
            return None
        if self.mean is None or self.falls or not self.n:
            return False
        return self.row.direction.meets(self.mean, self.row.bar)

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON; what is not finite or was not measured is None."""
        row = self.row
        return {
            "name": row.name,
            "item": row.item,
            "quantity": row.quantity,
            "unit": row.unit,
            "bar": row.bar,
            "direction": row.direction.value,
            "n": self.n,
            "mean": _finite(self.mean),
            "worst": _finite(self.worst),
            "worst_seed": self.worst_seed,
            "falls": self.falls,
            "passed": self.passed,
            "values": {str(seed): _finite(value) for seed, value in self.values.items()},
            "failures": {str(seed): reason for seed, reason in self.failures.items()},
        }


@dataclass(frozen=True, slots=True)
class BenchReport:
    """All rows."""

    rows: tuple[RowResult, ...]

    @property
    def ok(self) -> bool:
        """Whether every row with a bar passed; False without any row."""
        return bool(self.rows) and all(row.passed is not False for row in self.rows)

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return {"passed": self.ok, "rows": [row.as_dict() for row in self.rows]}


def summarise(families: Sequence[Family], results: Results) -> BenchReport:
    """The report of ``results``."""
    return BenchReport(
        tuple(
            summarise_row(row, results[family.name]) for family in families for row in family.rows
        )
    )


def summarise_row(row: Row, trials: Mapping[int, Measurement]) -> RowResult:
    """One row over the trials of its family, given by seed."""
    seeds = sorted(trials)
    values = {s: trials[s].values[row.name] for s in seeds if row.name in trials[s].values}
    reasons = {s: trials[s].failure(row.name) for s in seeds}
    failures = {s: reason for s, reason in reasons.items() if reason is not None}
    failures |= {s: f"{v} was measured" for s, v in values.items() if math.isnan(v)}
    values = {s: v for s, v in values.items() if not math.isnan(v)}
    missing = [s for s in seeds if s not in values]
    worst = row.direction.worst(values) if values else None
    return RowResult(
        row=row,
        n=len(seeds),
        mean=fmean(values.values()) if values else None,
        worst=None if missing or worst is None else values[worst],
        worst_seed=missing[0] if missing else worst,
        values=values,
        failures=failures,
    )


def render(report: BenchReport) -> str:
    """The table, with the reasons of failed seeds below, and the verdict."""
    titles = {"quantity": "", "bar": "bar", "n": "n", "mean": "mean", "worst": "worst"}
    head = _LINE.format(**titles, seed="seed", falls="fell", verdict="")
    lines = [head.rstrip(), "-" * WIDTH]
    for item, group in groupby(report.rows, key=lambda result: result.row.item):
        lines.append(item)
        for result in group:
            lines.append(_line(result))
            lines += _notes(result)
    judged = [row for row in report.rows if row.passed is not None]
    passed = sum(bool(row.passed) for row in judged)
    lines += ["-" * WIDTH, f"{passed} of {len(judged)} rows pass. The bar is for the mean, and no"]
    lines += ["seed may fall or fail to do what it was asked (column fell)."]
    return "\n".join(lines)


def bar_text(row: Row) -> str:
    """The bar with its unit, as ``<= 1 %``; a dash for a row that only informs."""
    if row.bar is None:
        return f"- {row.unit}".rstrip()
    return f"{row.direction.value} {row.bar:g} {row.unit}".rstrip()


def _line(result: RowResult) -> str:
    verdict = {True: "ok", False: "NO", None: ""}[result.passed]
    return _LINE.format(
        quantity=result.row.quantity,
        bar=bar_text(result.row),
        n=result.n,
        mean=_number(result.mean),
        worst=_number(result.worst) if result.worst is not None or not result.falls else "fell",
        seed="-" if result.worst_seed is None else result.worst_seed,
        falls=result.falls,
        verdict=verdict,
    ).rstrip()


def _notes(result: RowResult) -> Iterator[str]:
    for seed in list(result.failures)[:_NOTES]:
        text = f"seed {seed}: {result.failures[seed]}"
        yield from textwrap.wrap(
            text, WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 6, max_lines=3
        )
    if result.falls > _NOTES:
        yield f"    and {result.falls - _NOTES} more"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
