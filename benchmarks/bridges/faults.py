"""What a bench and a test share of faults: something breaks on purpose, the robot must not fall."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.rows import Measurement, Row
from benchmarks.trials import Failed
from go2_wbc.errors import Go2WbcError

TILT_BAR: Final = 30.0
"""Tilt [deg] that a fault may cause at most: a robot that goes limp sinks, it does not tip over."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that breaks.

    Attributes:
        name: unique; the row is called after it.
        what: what happens, in a few words.
        run: makes it happen to real processes and makes sure of what must follow; returns the
            largest tilt [deg] of the robot meanwhile, or raises ``Failed``.
    """

    name: str
    what: str
    run: Callable[[], float]


def rows_of(faults: Sequence[Fault], item: str) -> tuple[Row, ...]:
    """A row of the bench for each fault."""
    return tuple(Row(fault.name, item, fault.what, "deg", TILT_BAR) for fault in faults)


def run_all(faults: Sequence[Fault]) -> Measurement:
    """Every fault in turn; one that went wrong does not keep the others from being tried."""
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    for fault in faults:
        try:
            values[fault.name] = fault.run()
        except (Failed, Go2WbcError) as error:
            failures[fault.name] = str(error)
    return Measurement(values, failures)


def require(is_so: bool, why_not: str) -> None:
    """Raise ``Failed`` with ``why_not`` unless it is so."""
    if not is_so:
        raise Failed(why_not)
