"""How likely a motion is to be done: every margin of the check as a chance, multiplied.

A limit that is met by much is no risk, one that is broken by much is no chance; between them the
chance rises along a logistic curve. Margins reach from a hair's breadth to a hundred times the
limit, so the curve is over ``x_i = asinh(m_i / u_i)``, which is as the margin near 0 and as its
logarithm far off. With ``c_i``, where check ``i`` holds in half of the cases, and ``w_i`` > 0, the
width of the rise:

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
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("probability.json")


@dataclass(frozen=True, slots=True)
class Rise:
    """The curve of one check.

    Attributes:
        unit: margin, in its own unit, up to which the curve is over the margin itself; above 0.
        centre: ``asinh(margin / unit)`` with an even chance.
        width: of the rise; above 0.
    """

    unit: float
    centre: float
    width: float

    def chance(self, margin: float) -> float:
        """The chance that a margin stands for."""
        if math.isinf(margin):
            return float(margin > 0.0)
        return logistic((math.asinh(margin / self.unit) - self.centre) / self.width)


@dataclass(frozen=True, slots=True)
class ProbabilityModel:
    """What turns margins into a chance.

    Attributes:
        rises: by the names of the checks.
        rest: ``b``, the log odds that all goes well that no margin tells of.
        leak: ``e``, 0 to 1: how much of that is left where a margin says no.
    """

    rises: Mapping[str, Rise]
    rest: float
    leak: float = 0.0

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
