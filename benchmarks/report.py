"""Means, deviations, worst seeds and verdicts, as a table of at most 80 columns and as JSON."""

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from statistics import fmean, stdev

from benchmarks.study import Metric, Results, Study, TrialResult
from controller.sweeps.summary import finite

WIDTH = 80
_LINE = " {quantity:<26}{threshold:>12}{n:>4}{mean:>8}{sd:>8}{worst:>8}{seed:>5}{falls:>5}{verdict}"
_COLUMN = 8  #: Width of a number's column in it
_NOTES = 3  #: Failed seeds of a metric whose reasons are printed; JSON has all


@dataclass(frozen=True, slots=True)
class MetricResult:
    """A metric over all its seeds."""

    metric: Metric  #: which
    n: int  #: number of seeds that were run
    mean: float | None  #: over the seeds that gave a value; None if none did
    sd: float | None
    """Standard deviation over these seeds (of the sample: n - 1); None if there are not two."""
    worst: float | None
    """The worst value; None if a seed gave none, since nothing is worse than that."""
    worst_seed: int | None  #: the seed of ``worst``, or the first that gave no value
    values: Mapping[int, float]  #: by seed
    failures: Mapping[int, str]  #: by seed, why the robot fell or did not do what it was asked

    @property
    def falls(self) -> int:
        """How many seeds failed: the robot fell or did not do what it was asked."""
        return len(self.failures)

    @property
    def passed(self) -> bool | None:
        """Whether the mean meets the threshold and no seed failed; None without a threshold."""
        if self.metric.threshold is None:
            return None
        if self.mean is None or self.falls or not self.n:
            return False
        off = self.mean - self.metric.threshold
        return off <= 0.0 if self.metric.direction == "<=" else off >= 0.0

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON; what is not finite or was not measured is None."""
        names = ("n", "mean", "sd", "worst", "worst_seed", "falls", "passed")
        return {
            **asdict(self.metric),
            **{name: finite(getattr(self, name)) for name in names},
            "values": {str(seed): finite(value) for seed, value in self.values.items()},
            "failures": {str(seed): reason for seed, reason in self.failures.items()},
        }


@dataclass(frozen=True, slots=True)
class Report:
    """All metrics, each a row of the table."""

    rows: tuple[MetricResult, ...]

    @property
    def ok(self) -> bool:
        """Whether every metric with a threshold passed; False without any metric."""
        return bool(self.rows) and all(row.passed is not False for row in self.rows)

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return {"passed": self.ok, "rows": [row.as_dict() for row in self.rows]}


def summarise(scenarios: Sequence[Study], results: Results) -> Report:
    """The report of ``results``."""
    pairs = [
        (metric, results.get(study.name, {})) for study in scenarios for metric in study.metrics
    ]
    return Report(tuple(summarise_metric(*pair) for pair in pairs))


def summarise_metric(metric: Metric, trials: Mapping[int, TrialResult]) -> MetricResult:
    """One metric over the trials of its scenario, given by seed."""
    name = metric.name
    ordered = dict(sorted(trials.items()))
    found = {s: trial.values[name] for s, trial in ordered.items() if name in trial.values}
    failures = {s: why for s, trial in ordered.items() if (why := trial.failure(name)) is not None}
    failures |= {s: f"{v} was measured" for s, v in found.items() if math.isnan(v)}
    values = {s: v for s, v in found.items() if not math.isnan(v)}
    missing = [s for s in ordered if s not in values]
    pick, numbers = max if metric.direction == "<=" else min, list(values.values())
    worst = pick(values, key=values.__getitem__, default=None)
    return MetricResult(
        metric=metric,
        n=len(ordered),
        mean=fmean(numbers) if numbers else None,
        sd=stdev(numbers) if len(numbers) > 1 and all(map(math.isfinite, numbers)) else None,
        worst=None if missing or worst is None else values[worst],
        worst_seed=missing[0] if missing else worst,
        values=values,
        failures=failures,
    )


def render(report: Report) -> str:
    """The table, with the reasons of failed seeds below, and the verdict."""
    titles = {name: name for name in ("threshold", "n", "mean", "sd", "worst", "seed")}
    head = _LINE.format(quantity="", **titles, falls="fell", verdict="")
    lines = [head.rstrip(), "-" * WIDTH]
    for item, group in groupby(report.rows, key=lambda result: result.metric.item):
        lines.append(item)
        for result in group:
            lines.append(_line(result))
            lines += _notes(result)
    judged = [row for row in report.rows if row.passed is not None]
    passed = sum(bool(row.passed) for row in judged)
    lines += ["-" * WIDTH, f"{passed} of {len(judged)} rows pass. The threshold is for the"]
    lines += ["mean, and no seed may fall or fail to do what it was asked (column fell)."]
    return "\n".join(lines)


def threshold_text(metric: Metric) -> str:
    """The threshold with its unit, as ``<= 1 %``; a dash for a metric that only informs."""
    if metric.threshold is None:
        return f"- {metric.unit}".rstrip()
    return f"{metric.direction} {metric.threshold:g} {metric.unit}".rstrip()


def _line(result: MetricResult) -> str:
    return _LINE.format(
        quantity=result.metric.quantity,
        threshold=threshold_text(result.metric),
        n=result.n,
        mean=_number(result.mean),
        sd=_number(result.sd),
        worst=_number(result.worst) if result.worst is not None or not result.falls else "fell",
        seed="-" if result.worst_seed is None else result.worst_seed,
        falls=result.falls,
        verdict={True: " ok", False: " NO", None: ""}[result.passed],
    ).rstrip()


def _notes(result: MetricResult) -> Iterator[str]:
    for seed in list(result.failures)[:_NOTES]:
        text = f"seed {seed}: {result.failures[seed]}"
        yield from textwrap.wrap(
            text, WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 6, max_lines=3
        )
    if result.falls > _NOTES:
        yield f"    and {result.falls - _NOTES} more"


def _number(value: float | None) -> str:
    """Three digits, or as many as leave a space before the number."""
    if value is None:
        return "-"
    texts = [f"{value:.{digits}g}" for digits in (3, 2, 1)]
    return next((text for text in texts if len(text) < _COLUMN), texts[-1])
