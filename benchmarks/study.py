"""A study: rows with their bars, and a trial that gives their values for a seed; and running them.

A row is its name, what is measured, and its bar: ``("time", "time", "<= 3 s")``. A bar without a
number only informs: ``"mm"``, or ``">= mm"`` where more is better. Names begin with the study's.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.errors import CommandError, Go2WbcError, unknown_name

IDEAL, IMU = "ideal", "imu"
"""The state that the controller is given: the true one, or what its own sensors tell."""
SENSED = "sensed-"  # What names on the robot's own sensors begin with
BAR = re.compile(r"(<=|>=)? ?(-?\d[-\d.e]*(?= |$))? ?(.*)")  # Side, threshold and unit
Rows = Sequence[tuple[str, str, str]]  #: Name, quantity and bar
_Told = TypeVar("_Told", float, str)


@dataclass(frozen=True, slots=True)
class Metric:
    """One row of the report: a quantity of which every trial gives one value."""

    name: str  #: unique among all metrics
    item: str  #: what the robot does; metrics of one item stand together
    quantity: str  #: what is measured
    unit: str  #: of the value; empty for a ratio or a count
    threshold: float | None
    """What the mean over the seeds must reach; ``None`` for one that only informs."""
    direction: str = "<="  #: on which side of the threshold is good, that or ">="

    @staticmethod
    def of(name: str, item: str, quantity: str, bar: str) -> Metric:
        """The metric of a row."""
        match = BAR.fullmatch(bar)
        side, number, unit = match.groups() if match else (None, None, bar)
        threshold = None if number is None else float(number)
        return Metric(name, item, quantity, unit, threshold, side or "<=")


@dataclass(slots=True)
class TrialResult:
    """What one trial of a study gave; it fills this as it goes."""

    values: dict[str, float] = field(default_factory=dict)
    """By row. One without a value counts as failed."""
    failures: dict[str, str] = field(default_factory=dict)
    """By row, why the robot did not do it although there may be a value."""
    reason: str = ""  #: why rows without a value have none; empty if all have one
    notes: dict[str, str] = field(default_factory=dict)
    """What else is worth keeping, by name; is on disk only."""

    def failure(self, metric: str) -> str | None:
        """Why this trial counts as failed for ``metric``, or None."""
        if metric in self.failures:
            return self.failures[metric]
        return None if metric in self.values else self.reason or "no value was measured"

    def worsen(self, name: str, value: float) -> None:
        """Keep the larger of ``value`` and what is there."""
        self.values[name] = max(value, self.values.get(name, value))

    def named(self, prefix: str) -> TrialResult:
        """The same with names that begin with ``prefix``."""

        def named(found: Mapping[str, _Told]) -> dict[str, _Told]:
            return {joined(prefix, name): value for name, value in found.items()}

        values = {name: float(value) for name, value in named(self.values).items()}
        return TrialResult(values, named(self.failures), self.reason, named(self.notes))


def joined(prefix: str, name: str) -> str:
    """The name of a row among all: either part may be empty."""
    return f"{prefix}.{name}" if prefix and name else prefix or name


@dataclass(frozen=True, slots=True)
class Study:
    """Rows that are measured together, in one trial."""

    name: str  #: what the command line takes
    table: Mapping[str, Rows]  #: by item, in the order of the report
    measure: Callable[[Trial, TrialResult], None]
    """Runs one trial; must be a function of a module, so that a process can import it. A robot that
    fails ends it: what was found until then counts, the rest has failed."""
    prefix: str | None = None  #: of the rows' names; None for the study's own name
    done: str | None = None
    """The row, if any, that is 1 where a trial comes to its end, and 0, and failed, where it does
    not."""
    seed_factor: int = 1  #: how many times the usual number of seeds it runs
    group: str = ""  #: what the command line takes for all studies of the same kind; may be empty
    sensors: str | None = IDEAL  #: of the robot; None if it has no choice

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """The rows, by their full names."""
        return tuple(
            Metric.of(joined(self._prefix, name), item, quantity, bar)
            for item, rows in self.table.items()
            for name, quantity, bar in rows
        )

    @property
    def _prefix(self) -> str:
        return self.name if self.prefix is None else self.prefix

    def sensed(self, group: str) -> Study:
        """The study on the robot's own sensors; its name and those of its rows say so."""
        table = {f"sensors: {item}": rows for item, rows in self.table.items()}
        prefix = f"{SENSED}{self._prefix}"
        name = f"{SENSED}{self.name}"
        return replace(self, name=name, table=table, prefix=prefix, group=group, sensors=IMU)

    def on(self, sensors: str) -> Study:
        """The study with a plant of these ``sensors``; kept on disk under a name of its own."""
        if sensors == IDEAL:
            return self
        return replace(self, name=f"{self.name}, {sensors}", prefix=self._prefix, sensors=sensors)

    def run(self, seed: int) -> TrialResult:
        """One trial; an error of this project is a failed one, any other is a bug and is raised."""
        found = TrialResult()
        try:
            self.measure(Trial(seed, sensors=self.sensors or IDEAL), found)
            if self.done is not None:
                found.values.setdefault(self.done, 1.0)
        except (TrialFailed, Go2WbcError) as error:
            found.reason = str(error)
            if not isinstance(error, TrialFailed):
                found.reason = f"{type(error).__name__}: {found.reason.splitlines()[0]}"
            if self.done is not None:
                found.values.setdefault(self.done, 0.0)
                found.failures[self.done] = found.reason
        return found.named(self._prefix)


Results = dict[str, dict[int, TrialResult]]  #: What every trial gave, by study and seed


def chosen_studies(studies: Sequence[Study], names: Sequence[str]) -> tuple[Study, ...]:
    """The studies that are named, by themselves or by their group; all if there is no name.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    valid = dict.fromkeys(name for s in studies for name in (s.group, s.name) if name)
    for name in names:
        if name not in valid:
            raise CommandError(unknown_name("scenario", name, valid))
    return tuple(s for s in studies if not names or s.name in names or s.group in names)
