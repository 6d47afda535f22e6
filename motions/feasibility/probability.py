"""How likely a motion is to be done: every margin of the check as a chance, multiplied.

A limit that is met by much is no risk, one that is broken by much is no chance; between them the
chance rises along a logistic curve. With the margin ``m_i`` of check ``i``, the margin ``c_i`` at
which it holds in half of the cases, and the width ``w_i`` > 0 of the rise:

    P = s(b) prod_i s((m_i - c_i) / w_i),    s(x) = 1 / (1 + exp(-x))

So a wider margin never lowers the chance, causes that have nothing to do with each other multiply,
and the least factor says what to mend. ``s(b)`` stands for what no margin tells. The numbers are in
``probability.json``, fitted by ``python -m benchmarks probability`` to simulated runs; the form is
that of noisy-AND gates (Pearl, Probabilistic Reasoning in Intelligent Systems, 1988, ch. 4.3) with
logistic inputs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("probability.json")
UNSEEN_WIDTH = 1e-3
"""Width, in the margin's unit, for a check that the fit has never seen near its limit: a broken
limit is then a certain failure, a margin that is kept no risk. Own choice."""


@dataclass(frozen=True, slots=True)
class Rise:
    """The logistic curve of one check, in the unit of its margin.

    Attributes:
        centre: margin with an even chance.
        width: of the rise; above 0.
    """

    centre: float
    width: float

    def chance(self, margin: float) -> float:
        """The chance that a margin stands for; that of nan, where nothing was checked, is 1."""
        return 1.0 if math.isnan(margin) else logistic((margin - self.centre) / self.width)


@dataclass(frozen=True, slots=True)
class ProbabilityModel:
    """What turns margins into a chance.

    Attributes:
        rises: by the names of the checks.
        rest: ``b``, the log odds that all goes well that no margin tells of.
    """

    rises: Mapping[str, Rise]
    rest: float

    @staticmethod
    def of(values: Mapping[str, Any]) -> ProbabilityModel:
        """From what ``as_dict`` gives."""
        rises = {name: Rise(**numbers) for name, numbers in values["rises"].items()}
        return ProbabilityModel(rises, values["rest"])

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        rises = {
            name: {"centre": rise.centre, "width": rise.width} for name, rise in self.rises.items()
        }
        return {"rest": self.rest, "rises": rises}

    def chances(self, margins: Mapping[str, float]) -> dict[str, float]:
        """The chance of every check, by its least margin."""
        unseen = Rise(0.0, UNSEEN_WIDTH)
        return {name: self.rises.get(name, unseen).chance(m) for name, m in margins.items()}

    def probability(self, margins: Mapping[str, float]) -> float:
        """The chance that a motion with these least margins is done, 0 to 1."""
        return logistic(self.rest) * math.prod(self.chances(margins).values())


@cache
def fitted() -> ProbabilityModel:
    """The model that comes with the package."""
    return ProbabilityModel.of(json.loads(FILE.read_text(encoding="utf-8")))


def logistic(x: float) -> float:
    """``1 / (1 + exp(-x))``, without overflow."""
    return 0.5 * (1.0 + math.tanh(0.5 * x))
