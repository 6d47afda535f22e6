"""What benchmarks and tests share of faults: something breaks, the robot must not fall."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from benchmarks.scenario import Measurement, Metric
from controller.sweeps.trials import TrialFailed
from go2_wbc.errors import Go2WbcError

TILT_LIMIT: Final = 30.0
"""Tilt [deg] that a fault may cause at most: a robot that goes limp sinks, it does not tip over."""
Play = Callable[[Any], None]
"""Makes something break among the processes of a scene and makes sure of what must follow."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that breaks.

    Attributes:
        name: unique; its metric is called after it.
        what: what happens, in a few words.
        play: makes it happen; raises ``TrialFailed`` if what must follow does not.
        options: of the simulator with which it is played.
    """

    name: str
    what: str
    play: Play
    options: tuple[str, ...] = ()


def fault(faults: list[Fault], name: str, what: str, *options: str) -> Callable[[Play], Play]:
    """Decorates what makes a fault happen: adds it to ``faults``."""

    def add(play: Play) -> Play:
        faults.append(Fault(name, what, play, options))
        return play

    return add


def metrics_of(faults: Sequence[Fault], item: str) -> tuple[Metric, ...]:
    """The largest tilt of the robot during each fault."""
    return tuple(Metric(fault.name, item, fault.what, "deg", TILT_LIMIT) for fault in faults)


def run_all(faults: Sequence[Fault], tilt_during: Callable[[Fault], float]) -> Measurement:
    """Every fault in turn; one that went wrong does not keep the others from being tried.

    ``tilt_during`` plays a fault and returns the largest tilt [deg] of the robot meanwhile.
    """
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    for one in faults:
        try:
            values[one.name] = tilt_during(one)
        except (TrialFailed, Go2WbcError) as error:
            failures[one.name] = str(error)
    return Measurement(values, failures)


def require(is_so: bool, why_not: str) -> None:
    """Raise ``TrialFailed`` with ``why_not`` unless it is so."""
    if not is_so:
        raise TrialFailed(why_not)
