"""Verdict and outcome of every motion of the exam, and how often the one foretold the other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from controller.motion_outcome import STRICT, UNPLANNED, Outcome

Z = 1.96
"""Quantile of the normal distribution for intervals of 95 %."""


@dataclass(frozen=True, slots=True)
class Case:
    """One motion.

    Attributes:
        name: unique.
        family: its structure.
        half: train or test.
        stratum: how its amplitude was chosen.
        is_dynamic: whether it is solved.
        refusal: checks that refuse it; it passed if there is none.
        outcome: what went wrong in physics.
    """

    name: str
    family: str
    half: str
    stratum: str
    is_dynamic: bool
    refusal: tuple[str, ...]
    outcome: Outcome

    @property
    def has_plan(self) -> bool:
        """Whether there was anything to play."""
        return UNPLANNED not in self.outcome.strict


@dataclass(frozen=True, slots=True)
class Share:
    """``right`` of ``n``, with the interval of Wilson (1927, J. Am. Stat. Assoc.) at 95 %."""

    right: int
    n: int

    @property
    def value(self) -> float:
        """The share; 1 of nothing."""
        return self.right / self.n if self.n else 1.0

    @property
    def interval(self) -> tuple[float, float]:
        """Between which values the true share is; all of them if there is nothing."""
        n = self.n
        if not n:
            return 0.0, 1.0
        p, z2 = self.right / n, Z * Z
        middle = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = Z / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        return max(0.0, middle - half), min(1.0, middle + half)

    def __str__(self) -> str:
        if not self.n:
            return "-"
        low, high = (_short(bound, 2) for bound in self.interval)
        return f"{_short(self.value, 3)} {low}-{high}"

    def as_dict(self) -> dict[str, float | list[float]]:
        """Plain values, for JSON."""
        return {"right": self.right, "n": self.n, "value": self.value, "95%": [*self.interval]}


def _short(share: float, digits: int) -> str:
    """``.953``; a share that rounds to 1 is as long as others."""
    text = f"{share:.{digits}f}"
    return text[:-1] if text.startswith("1") else text.removeprefix("0")


@dataclass(frozen=True, slots=True)
class Score:
    """How well verdicts foretell one definition of the outcome.

    A refusal is a prediction that the motion goes wrong, a pass that it is done. Each can be
    judged by how often it is right (precision), and by how much it finds (recall).

    Attributes:
        n: motions.
        refused_right: of the refused motions, those that go wrong: precision of refusals.
        wrong_refused: of the motions that go wrong, those refused: recall of refusals.
        passed_right: of the passed motions, those that are done: precision of passes.
        done_passed: of the motions that are done, those passed: recall of passes.
    """

    n: int
    refused_right: Share
    wrong_refused: Share
    passed_right: Share
    done_passed: Share

    @staticmethod
    def of(cases: Iterable[Case], definition: str = STRICT) -> Score:
        """The score on ``cases`` by a definition of ``controller.motion_outcome``."""
        pairs = [(bool(case.refusal), bool(case.outcome.by(definition))) for case in cases]
        both, neither = pairs.count((True, True)), pairs.count((False, False))
        refused, failed = sum(r for r, _ in pairs), sum(f for _, f in pairs)
        return Score(
            len(pairs),
            Share(both, refused),
            Share(both, failed),
            Share(neither, len(pairs) - refused),
            Share(neither, len(pairs) - failed),
        )

    @property
    def shares(self) -> tuple[Share, Share, Share, Share]:
        """All four, in the order of the table."""
        return self.refused_right, self.wrong_refused, self.passed_right, self.done_passed

    @property
    def least(self) -> float:
        """The lowest of the four."""
        return min(share.value for share in self.shares)

    def as_dict(self) -> dict[str, object]:
        """Plain values, for JSON."""
        names = ("refused_right", "wrong_refused", "passed_right", "done_passed")
        shares = {name: getattr(self, name).as_dict() for name in names}
        return {"n": self.n, **shares}


Choose = Callable[[Case], bool]


def chosen(cases: Sequence[Case], *conditions: Choose) -> list[Case]:
    """The cases for which all conditions hold."""
    return [case for case in cases if all(condition(case) for condition in conditions)]
