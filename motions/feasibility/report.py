"""What a feasibility check found: margins, failures, warnings and a chance, as values and tables.

The chance that a motion is done: every margin as a chance, multiplied. A limit that is met by much
is no risk, one that is broken by much is no chance; between them the chance rises along a logistic
curve. Margins reach from a hair's breadth to a hundred times the limit, so the curve is over
``x_i = asinh(m_i / u_i)``, which is as the margin near 0 and as its logarithm far off. With
``c_i``, where check ``i`` holds in half of the cases, and ``w_i`` > 0, the width of the rise:

    P = s(b) (e + (1 - e) prod_i s((x_i - c_i) / w_i)),    s(x) = 1 / (1 + exp(-x))

So a wider margin never lowers the chance, causes that have nothing to do with each other multiply,
and the least factor says what to mend. ``s(b)`` stands for what no margin tells, and ``e``, the
leak, for motions that are done although a limit of the check is broken by much: without it the
product says 0 where 8 % are done. The numbers are in ``probability.json``, fitted by ``python -m
benchmarks probability`` to simulated runs; the form is that of leaky noisy-AND gates (Pearl,
Probabilistic Reasoning in Intelligent Systems, 1988, ch. 4.3) with logistic inputs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.brief import brief, counted, cut, inline_html
from go2_wbc.errors import MotionInfeasible
from go2_wbc.world import World
from motions.feasibility.goal_errors import Departure

FILE = Path(__file__).with_name("probability.json")


@dataclass(frozen=True, slots=True)
class Rise:
    """The curve of one check."""

    unit: float
    """Margin, in its own unit, up to which the curve is over the margin itself; above 0."""
    centre: float  #: ``asinh(margin / unit)`` with an even chance
    width: float  #: of the rise, above 0

    def chance(self, margin: float) -> float:
        """The chance that a margin stands for."""
        if math.isinf(margin):
            return float(margin > 0.0)
        return logistic((math.asinh(margin / self.unit) - self.centre) / self.width)


@dataclass(frozen=True, slots=True)
class ProbabilityModel:
    """What turns margins into a chance."""

    rises: Mapping[str, Rise]  #: by the names of the checks
    rest: float  #: ``b``, the log odds that all goes well that no margin tells of
    leak: float = 0.0  #: ``e``, 0 to 1: how much of that is left where a margin says no

    @staticmethod
    def of(values: Mapping[str, Any]) -> ProbabilityModel:
        """From what ``as_dict`` gives."""
        rises = {name: Rise(**numbers) for name, numbers in values["rises"].items()}
        return ProbabilityModel(rises, values["rest"], values["leak"])

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        rises = {name: asdict(rise) for name, rise in self.rises.items()}
        return {"rest": self.rest, "leak": self.leak, "rises": rises}

    def chances(self, margins: Mapping[str, float]) -> dict[str, float]:
        """The chance of every check, by its least margin.

        A check that the fit has seen only far from its limit is a yes or no; nan, where nothing was
        checked, is no risk.
        """
        return {name: self._chance(name, margin) for name, margin in margins.items()}

    def _chance(self, name: str, margin: float) -> float:
        rise = self.rises.get(name)
        if math.isnan(margin):
            return 1.0
        return float(margin >= 0.0) if rise is None else rise.chance(margin)

    def probability(self, margins: Mapping[str, float]) -> float:
        """The chance that a motion with these least margins is done, 0 to 1.

        The leak is for checks with a curve: one that the fit has not seen at its limit is trusted.
        """
        chances = self.chances(margins)
        unseen = math.prod(chance for name, chance in chances.items() if name not in self.rises)
        seen = math.prod(chance for name, chance in chances.items() if name in self.rises)
        return logistic(self.rest) * unseen * (self.leak + (1.0 - self.leak) * seen)


@cache
def fitted() -> ProbabilityModel:
    """The model that comes with the package."""
    return ProbabilityModel.of(json.loads(FILE.read_text(encoding="utf-8")))


def logistic(x: float) -> float:
    """``1 / (1 + exp(-x))``, without overflow."""
    return 0.5 * (1.0 + math.tanh(0.5 * x))


NOISE = 1e-6  #: A value below this is nothing but rounding, and is shown as 0
SURE = 0.99  #: A chance above this, or below 1 - this, is not told more exactly
SUMS = ("slip",)
"""Checks whose values add up: what was too much stays so, but is wrong only while it grows."""
GROWTH = 5e-5
"""By how much [m] at least from one sample to the next: less is the creep of any movement."""
STAYS = 1e-3  #: m, rad; a motion that ends nearer than this to where it starts does not go anywhere


@dataclass(frozen=True, slots=True)
class Finding:
    """The worst instant of one subject under one check; a negative ``margin`` breaks the limit.

    Attributes:
        check, time, subject: which limit, when [s] it is worst, and joint, foot or body part.
        value, limit, margin, unit: the numbers, and their unit.
        note: what else there is to say.
    """

    check: str
    time: float
    subject: str
    value: float
    limit: float
    margin: float
    unit: str
    note: str = ""

    def __str__(self) -> str:
        line = f"{self.check}: {self.subject} at {self.time:.2f} s"
        if np.isfinite(self.value):
            value = self.value if abs(self.value) >= NOISE else 0.0
            line += f" is {value:.3g} {self.unit}, limit {self.limit:.3g}"
        return f"{line} ({self.note})" if self.note else line


Least = tuple[Float[np.ndarray, " n"], Int[np.ndarray, " n"]]


@dataclass(frozen=True, slots=True)
class Series:
    """One check over the whole motion."""

    check: str  #: which limit
    unit: str  #: of values, limits and margins
    subjects: tuple[str, ...]  #: what is looked at, one per column
    times: Float[np.ndarray, " n"]  #: (n,) [s]
    values: Float[np.ndarray, "n k"]  #: (n, k)
    limits: Float[np.ndarray, "n k"]  #: (n, k)
    margins: Float[np.ndarray, "n k"]  #: (n, k); nan says that there was nothing to check
    tight: float = 0.0  #: margin below which a warning is due
    note: str = ""  #: what else to say of a finding
    _least: Least | None = field(default=None, init=False, repr=False, compare=False)

    __repr__ = brief

    @property
    def is_broken(self) -> bool:
        """Whether any margin is negative."""
        return bool((self.least[0] < 0.0).any())

    @property
    def least(self) -> Least:
        """Least margin at each instant, inf where nothing is checked; of which subject it is."""
        known = self._least
        if known is None:
            columns = np.ascontiguousarray(self.margins.T)
            least, whose = np.fmin.reduce(columns, axis=0), np.zeros(len(self.times), dtype=int)
            least[np.isnan(least)] = np.inf
            for column in range(1, len(columns))[::-1]:
                whose[columns[column] == least] = column
            whose[columns[0] == least] = 0
            known = least, whose
            object.__setattr__(self, "_least", known)
        return known

    def knowing(self, least: Least) -> Series:
        """Itself; ``least`` is known already."""
        object.__setattr__(self, "_least", least)
        return self

    @property
    def broken_at(self) -> Float[np.ndarray, " k"]:
        """Instants [s] at which a limit is broken; nan, nothing to check, breaks none."""
        is_below = self.margins < 0.0
        if self.check in SUMS:
            before = np.vstack([np.full((1, self.margins.shape[1]), np.inf), self.margins[:-1]])
            is_below &= ~(self.margins >= before - GROWTH)
        return self.times[is_below.any(axis=1)]

    def worst(self, column: int, begin: int = 0) -> float:
        """The greatest value of a subject where it was checked, from row ``begin`` on, or 0."""
        is_checked = ~np.isnan(self.margins[:, column])
        is_checked[:begin] = False
        return float(self.values[is_checked, column].max(initial=0.0))

    def downgraded(self) -> Series:
        """The same with 0 for negative margins: broken for so short that it does no harm."""
        least, whose = self.least
        other = replace(self, margins=np.maximum(self.margins, 0.0))
        return other.knowing((np.maximum(least, 0.0), whose))

    def findings(self) -> list[Finding]:
        """The worst instant of every subject that was checked."""
        is_checked = ~np.isnan(self.margins)
        rows = np.where(is_checked, self.margins, np.inf).argmin(axis=0).tolist()
        columns = np.flatnonzero(is_checked.any(axis=0)).tolist()
        return [self._finding(rows[column], column) for column in columns]

    def worst_finding(self) -> Finding | None:
        """Of all subjects, of several the first; None if nothing was checked."""
        least = self.least[0]
        smallest = least.min(initial=np.inf)
        rows = np.flatnonzero(least == smallest)
        own = self.margins[rows] == smallest
        if not own.any():
            return None
        column = int(own.any(axis=0).argmax())
        return self._finding(int(rows[own[:, column].argmax()]), column)

    def _finding(self, row: int, column: int) -> Finding:
        tables = (self.values, self.limits, self.margins)
        value, limit, margin = (float(table[row, column]) for table in tables)
        at = (float(self.times[row]), self.subjects[column], value, limit, margin)
        return Finding(self.check, *at, self.unit, self.note)

    def least_margins(self) -> Float[np.ndarray, " n"]:
        """The smallest margin over the subjects at every instant; nan where nothing is checked."""
        least = self.least[0]
        return np.where(np.isinf(least), np.nan, least)


@dataclass(frozen=True, slots=True)
class FeasibilityReport:
    """Whether the robot can do a motion, and by how much.

    Attributes:
        motion, duration: its name, and its length [s].
        series: every check over the whole motion, causes before what follows from them: what no
            joint angles can do, then what the joints and the ground forbid, then balance, then
            speed, then the forces.
        failures: broken limits in the order of ``series``, so the first is the one to mend first;
            of one check the earliest first.
        warnings: limits that are met by little.
        margins: worst finding of every check.
        world: in which it holds.
        end_pose: where the motion ends: x, y [m] and yaw [rad] of the frame of the feet, seen from
            its start; None of a plan that does not say.
        departures: how far the parts that are the nearest to what was written are from it.
    """

    motion: str
    duration: float
    series: tuple[Series, ...]
    failures: tuple[Finding, ...]
    warnings: tuple[Finding, ...]
    margins: Mapping[str, Finding]
    world: World
    end_pose: tuple[float, float, float] | None = None
    departures: tuple[Departure, ...] = ()

    _repr_html_ = inline_html

    def __repr__(self) -> str:
        verdict = "ok" if self.ok else f"not ok: {self.failures[0]}"
        chance = f"{self.duration:.1f} s, chance {_percent(self.probability)}"
        return cut(f"FeasibilityReport({self.motion!r}, {chance}, {verdict})")

    @staticmethod
    def of(
        motion: str,
        duration: float,
        series: Sequence[Series],
        end_pose: tuple[float, float, float] | None = None,
        *,
        departures: tuple[Departure, ...] = (),
        world: World | None = None,
    ) -> FeasibilityReport:
        """Draw the conclusions from ``series``, which has causes before their consequences."""
        failures, warnings, margins = [], [], {}
        for item in series:
            worst = item.worst_finding()
            if worst is None:
                continue
            margins[item.check] = worst
            found = item.findings() if worst.margin < max(item.tight, 0.0) else []
            broken = [finding for finding in found if not finding.margin >= 0.0]
            failures += sorted(broken, key=lambda finding: finding.time)
            warnings += [finding for finding in found if 0.0 <= finding.margin < item.tight]
        return FeasibilityReport(
            motion=motion,
            duration=duration,
            series=tuple(series),
            failures=tuple(failures),
            warnings=tuple(warnings),
            margins=margins,
            world=world or World(),
            end_pose=end_pose,
            departures=departures,
        )

    @property
    def ok(self) -> bool:
        """Whether no limit is broken."""
        return not self.failures

    @property
    def probability(self) -> float:
        """Chance, 0 to 1, that the motion is done in ``world``; see ``feasibility.probability``."""
        margins = {check: finding.margin for check, finding in self.margins.items()}
        return fitted().probability(margins)

    def raise_if_infeasible(self) -> None:
        """Do nothing if it is feasible.

        Raises:
            MotionInfeasible: if it is not; carries the failures.
        """
        if self.failures:
            raise MotionInfeasible(self.motion, self.failures)

    def table(self) -> str:
        """The worst finding of every check in the order of ``series``, at most 80 columns wide."""
        head = f"{'check':<16}{'worst':<17}{'at':>8}{'value':>10}{'limit':>9}{'margin':>10}"
        lines = [head, "-" * 80]
        for check, finding in self.margins.items():
            mark = "x" if finding.margin < 0.0 else "!" if finding in self.warnings else "ok"
            line = f"{check:<16}{finding.subject:<17.16}{finding.time:>6.2f} s"
            if np.isfinite(finding.value):
                value = 0.0 if abs(finding.value) < NOISE else finding.value
                line += f"{value:>10.3g}{finding.limit:>9.3g}{finding.margin:>10.3g}"
                lines.append(f"{line} {mark:<2} {finding.unit}".rstrip())
            else:
                lines.append(f"{line}{'-':>10}{'-':>9}{'-':>10} {mark}")
        verdict = (
            "can do it" if self.ok else f"cannot do it: {counted(len(self.failures), 'limit')}"
        )
        tight = f", {counted(len(self.warnings), 'tight margin')}" if self.warnings else ""
        lines += ["-" * 80, f"{self.motion}, {self.duration:.1f} s: the robot {verdict}{tight}."]
        if self.world != World():
            lines += wrap(f"That holds for {self.world}.", 80)
        if self.world.is_late_or_noisy:
            lines.append("Delay and sensors are simulated only: no limit here counts with them.")
        lines.append(f"Chance that it is done so: {_percent(self.probability)}.")
        if self.end_pose is not None and max(map(abs, self.end_pose)) > STAYS:
            x, y, yaw = self.end_pose
            lines.append(
                f"It ends at x {x:.3f} m, y {y:.3f} m, turned by {np.degrees(yaw):.1f} deg."
            )
        return "\n".join([*lines, *map(str, self.departures)])

    def summary(self) -> str:
        """One line: the verdict, and what to mend first, or what is closest to its limit."""
        if not self.ok:
            first, *more = self.failures
            rest = f"; {counted(len(more), 'more limit')}" if more else ""
            return f"no   {self.motion:<15} {first}{rest}"
        tight = min(self.margins.values(), key=lambda f: f.margin / max(abs(f.limit), 1e-9))
        return (
            f"ok   {self.motion:<15} {self.duration:>5.1f} s   closest: {tight.check}, "
            f"{tight.subject} at {tight.time:.1f} s"
        )

    def as_dict(self) -> dict[str, Any]:
        """Everything but the series, for JSON."""
        return {
            "motion": self.motion,
            "duration": self.duration,
            "ok": self.ok,
            "end_pose": self.end_pose,
            "world": asdict(self.world),
            "probability": self.probability,
            "failures": [asdict(finding) for finding in self.failures],
            "warnings": [asdict(finding) for finding in self.warnings],
            "departures": [asdict(one) for one in self.departures],
            "margins": {check: asdict(finding) for check, finding in self.margins.items()},
        }


def _percent(chance: float) -> str:
    """Rounded to 1 %; nothing is certain."""
    if chance > SURE:
        return f"over {100.0 * SURE:.0f} %"
    return f"{100.0 * chance:.0f} %" if chance >= 1.0 - SURE else "under 1 %"
