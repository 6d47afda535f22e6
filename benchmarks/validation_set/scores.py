"""Verdict and outcome of every motion, how often the one foretold the other, and the table."""

from __future__ import annotations

import math
import re
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from benchmarks.validation_set.drawing import TEST, TRAIN
from benchmarks.validation_set.questions import STRATA
from controller.motion_failures import (
    FELL,
    LENIENT,
    NOT_DONE,
    STOPS,
    STRICT,
    UNPLANNED,
    MotionFailures,
)

_ROW = "{name:<17}{n:>4}{done:>5}" + "".join(f"{{shares[{k}]:>13}}" for k in range(4))
_HEADS = ("refused", "wrong:", "passed", "done:")
_MORE = ("are wrong", "refused", "are done", "passed")
HALVES = (TRAIN, TEST)
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
    outcome: MotionFailures

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
        """The score on ``cases`` by a definition of ``controller.motion_failures``."""
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


def chosen(cases: Sequence[Case], *conditions: Callable[[Case], bool]) -> list[Case]:
    """The cases for which all conditions hold."""
    return [case for case in cases if all(condition(case) for condition in conditions)]


def scores(cases: Sequence[Case]) -> dict[str, Score]:
    """By name, all rows of the table: halves, strata, dynamic motions, definitions."""
    found: dict[str, Score] = {}
    for half in HALVES:
        own = chosen(cases, lambda case, half=half: case.half == half)
        found[f"{half} strict"] = Score.of(own)
        for stratum in STRATA:
            part = chosen(own, lambda case, stratum=stratum: case.stratum == stratum)
            found[f"{half} {stratum}"] = Score.of(part)
        dynamic = chosen(own, lambda case: case.is_dynamic)
        found[f"{half} dynamic"] = Score.of(dynamic)
        found[f"{half} solved"] = Score.of(chosen(dynamic, lambda case: case.has_plan))
        for definition in (STOPS, LENIENT, FELL):
            found[f"{half} {definition}"] = Score.of(own, definition)
    return found


def render(cases: Sequence[Case]) -> str:
    """The table of all scores, and why motions went wrong; of single motions nothing."""
    lines = [
        _ROW.format(name="", n="", done="", shares=_HEADS).rstrip(),
        _ROW.format(name="", n="n", done="done", shares=_MORE),
        "-" * 80,
    ]
    for name, score in scores(cases).items():
        shares = [str(share) for share in score.shares]
        lines.append(_ROW.format(name=name, n=score.n, done=score.done_passed.n, shares=shares))
        if name.endswith(FELL):
            lines.append("-" * 80)
    return "\n".join([*lines, *_causes(cases)])


def _causes(cases: Sequence[Case]) -> list[str]:
    """How often each thing went wrong, in all motions; several may in one."""
    kinds = Counter(re.sub(r"[\d.]+ ", "", why) for c in cases for why in c.outcome.by(STRICT))
    counts = ", ".join(f"{kind} {n}" for kind, n in kinds.most_common())
    return textwrap.wrap(f"What went wrong, strictly: {counts or 'nothing'}.", 80)


def noticed(cases: Sequence[Case]) -> str:
    """How many of the motions that were played and went wrong ``play`` says so of."""
    wrong = [case.outcome.strict for case in cases if case.outcome.strict and case.has_plan]
    told = sum(NOT_DONE in reasons for reasons in wrong)
    return f"Of {len(wrong)} motions that were played and went wrong, `play` says so of {told}."


def wrong_ones(cases: Sequence[Case]) -> list[str]:
    """The motions of the train half on which the check was wrong; those of the other are secret."""
    lines: list[str] = []
    for case in chosen(cases, lambda case: case.half == TRAIN):
        refused, failed = bool(case.refusal), bool(case.outcome.strict)
        if refused is not failed:
            said = f"refused ({', '.join(case.refusal)})" if refused else "passed"
            happened = ", ".join(case.outcome.strict) or "done"
            lines.append(f"{case.name} ({case.stratum}): {said}; {happened}")
    return lines
