"""The bench's vocabulary: rows with their bars, families of rows, and what one trial gave."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from benchmarks.trials import Trial


class Direction(Enum):
    """On which side of its bar a value is good."""

    AT_MOST = "<="
    AT_LEAST = ">="

    def meets(self, value: float, bar: float) -> bool:
        """Whether ``value`` is on the good side; a nan never is."""
        return value <= bar if self is Direction.AT_MOST else value >= bar

    def worst(self, values: Mapping[int, float]) -> int:
        """The key of the worst value; ``values`` must not be empty."""
        pick = max if self is Direction.AT_MOST else min
        return pick(values, key=lambda key: values[key])


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the report: a quantity of which every trial gives one value.

    Attributes:
        name: unique among all rows.
        item: what the robot does; rows of one item stand together.
        quantity: what is measured.
        unit: of the value; empty for a ratio or a count.
        bar: what the mean over the seeds must reach; ``None`` for a row that only informs.
        direction: on which side of the bar is good.
    """

    name: str
    item: str
    quantity: str
    unit: str
    bar: float | None
    direction: Direction = Direction.AT_MOST


@dataclass(frozen=True, slots=True)
class Measurement:
    """What one trial of a family gave.

    Attributes:
        values: by row name. A row without a value counts as a fall.
        failures: by row name, why the robot did not do it although there may be a value.
        reason: why rows without a value have none; empty if all have one.
    """

    values: Mapping[str, float]
    failures: Mapping[str, str] = field(default_factory=dict)
    reason: str = ""

    def failure(self, row: str) -> str | None:
        """Why this trial counts as failed for ``row``, or None."""
        if row in self.failures:
            return self.failures[row]
        return None if row in self.values else self.reason or "no value was measured"


@dataclass(frozen=True, slots=True)
class Family:
    """Rows that are measured together, in one trial.

    Attributes:
        name: what ``--rows`` takes.
        rows: in the order of the report.
        measure: runs one trial; must be a function of a module, so that a process can import it.
        seed_factor: how many times the usual number of seeds it runs.
    """

    name: str
    rows: tuple[Row, ...]
    measure: Callable[[Trial], Measurement]
    seed_factor: int = 1
