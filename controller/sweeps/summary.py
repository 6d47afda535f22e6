"""What the rows of a sweep say: rates, means and percentiles, with their intervals."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from controller.sweeps.sweep_file import Columns, Row

CONFIDENCE = 0.95  #: How sure an interval is to hold the true rate or mean
PERCENTILES = (5.0, 50.0, 95.0)


@dataclass(frozen=True, slots=True)
class Rate:
    """A truth value over all rows."""

    name: str  #: of the column
    n: int  #: how many rows have it
    count: int  #: in how many it is true
    low: float  #: 95 % interval of the true rate (Clopper and Pearson, 1934)
    high: float  #: its other end

    @property
    def rate(self) -> float:
        """Share of the rows in which it is true."""
        return self.count / self.n


@dataclass(frozen=True, slots=True)
class Spread:
    """A number over all rows."""

    name: str  #: of the column
    n: int  #: how many rows have a number that is finite; the rest counts for it only
    mean: float  #: of these
    low: float  #: 95 % interval of the true mean (Student's t); nan for fewer than two rows
    high: float  #: its other end
    least: float  #: of all
    most: float  #: of all
    percentiles: tuple[float, ...]  #: the 5th, the 50th and the 95th


@dataclass(frozen=True, slots=True)
class Words:
    """A text over all rows."""

    name: str  #: of the column
    n: int  #: how many rows have one that is not empty
    kinds: int  #: how many different ones there are
    commonest: tuple[str, int] | None  #: the most frequent one, and its number


@dataclass(frozen=True, slots=True)
class Summary:
    """All columns, each by its kind, over ``n`` rows."""

    n: int
    rates: tuple[Rate, ...]
    spreads: tuple[Spread, ...]
    words: tuple[Words, ...]

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON; what is not finite is None."""
        return {
            "n": self.n,
            "rates": [{**asdict(item), "rate": item.rate} for item in self.rates],
            "spreads": [
                {name: finite(value) for name, value in asdict(item).items()}
                for item in self.spreads
            ],
            "words": [asdict(item) for item in self.words],
        }


def summarise(rows: Sequence[Row], columns: Columns) -> Summary:
    """What ``rows`` say."""
    given = {name: [row[name] for row in rows] for name in columns}
    kinds = {kind: [name for name in columns if columns[name] == kind] for kind in columns.values()}
    numbers = [name for name in columns if columns[name] in ("float", "int")]
    return Summary(
        n=len(rows),
        rates=tuple(_rate(name, given[name]) for name in kinds.get("bool", ()) if rows),
        spreads=tuple(_spread(name, np.array(given[name], dtype=float)) for name in numbers),
        words=tuple(_words(name, given[name]) for name in kinds.get("str", ())),
    )


def rate_interval(count: int, n: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Interval of a rate that was seen ``count`` times in ``n`` (Clopper and Pearson, 1934)."""
    from scipy.stats import beta

    tail = 0.5 * (1.0 - confidence)
    low = 0.0 if count == 0 else float(beta.ppf(tail, count, n - count + 1))
    high = 1.0 if count == n else float(beta.ppf(1.0 - tail, count + 1, n - count))
    return low, high


def mean_interval(values: np.ndarray) -> tuple[float, float]:
    """95 % interval of the true mean (Student's t); nan for fewer than two values."""
    from scipy.stats import t

    mean, half = float(values.mean()), math.nan
    if len(values) > 1:
        quantile = float(t.ppf(0.5 + 0.5 * CONFIDENCE, len(values) - 1))
        half = quantile * float(values.std(ddof=1)) / math.sqrt(len(values))
    return mean - half, mean + half


def _rate(name: str, values: list) -> Rate:
    count = sum(values)
    return Rate(name, len(values), count, *rate_interval(count, len(values)))


@np.errstate(over="ignore", invalid="ignore")  # the mean of the largest floats is infinite
def _spread(name: str, values: np.ndarray) -> Spread:
    known = np.sort(values[np.isfinite(values)])  # the order of the rows must not change a bit
    if not len(known):
        nan = math.nan
        return Spread(name, 0, nan, nan, nan, nan, nan, (nan,) * len(PERCENTILES))
    low, high = mean_interval(known)
    return Spread(
        name=name,
        n=len(known),
        mean=float(known.mean()),
        low=low,
        high=high,
        least=float(known[0]),
        most=float(known[-1]),
        percentiles=tuple(np.percentile(known, PERCENTILES).tolist()),
    )


def _words(name: str, values: list) -> Words:
    counts = Counter(value for value in values if value)
    commonest = counts.most_common(1)
    return Words(name, counts.total(), len(counts), commonest[0] if commonest else None)


def finite(value: object) -> object:
    """``value`` for JSON; None where it is not finite."""
    if isinstance(value, tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
