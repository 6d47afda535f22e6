"""Verdict and outcome of every motion, how often the one foretold the other, and the table."""

from __future__ import annotations

import re
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from scipy.stats import binomtest

from benchmarks.validation_set.drawing import TEST, TRAIN
from benchmarks.validation_set.physics import LENIENT, STOPS, STRICT, Failures
from benchmarks.validation_set.questions import STRATA
from controller.motion_measurement import FELL, NOT_DONE, UNPLANNED

_ROW = "{name:<17}{n:>4}{done:>5}" + "".join(f"{{shares[{k}]:>13}}" for k in range(4))
_HEADS = ("refused", "wrong:", "passed", "done:")
_MORE = ("are wrong", "refused", "are done", "passed")
HALVES = (TRAIN, TEST)


@dataclass(frozen=True, slots=True)
class Case:
    """One motion."""

    name: str  #: unique
    half: str  #: train or test
    stratum: str  #: how its amplitude was chosen
    is_dynamic: bool  #: whether it is solved
    refusal: tuple[str, ...]  #: checks that refuse it; it passed if there is none
    outcome: Failures  #: what went wrong in physics

    @property
    def has_plan(self) -> bool:
        """Whether there was anything to play."""
        return UNPLANNED not in self.outcome[STRICT]

    @property
    def is_wrong(self) -> bool:
        """Whether the check foretold something else than happened, strictly."""
        return bool(self.refusal) is not bool(self.outcome[STRICT])


class Share(NamedTuple):
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
        if not self.n:
            return 0.0, 1.0
        return tuple(binomtest(self.right, self.n).proportion_ci(0.95, method="wilson"))

    def __str__(self) -> str:
        """``.953 .94-.96``; a share that rounds to 1 is as long as others."""
        if not self.n:
            return "-"
        texts = [f"{self.value:.3f}", *(f"{bound:.2f}" for bound in self.interval)]
        short = [text[:-1] if text.startswith("1") else text.removeprefix("0") for text in texts]
        return "{} {}-{}".format(*short)

    def as_dict(self) -> dict[str, float | list[float]]:
        """Plain values, for JSON."""
        return {"right": self.right, "n": self.n, "value": self.value, "95%": [*self.interval]}


class Score(NamedTuple):
    """How well verdicts foretell one definition of the outcome.

    A refusal is a prediction that the motion goes wrong, a pass that it is done. Each can be
    judged by how often it is right (precision), and by how much it finds (recall).
    """

    refused_right: Share  #: of the refused motions, those that go wrong: precision of refusals
    wrong_refused: Share  #: of the motions that go wrong, those refused: recall of refusals
    passed_right: Share  #: of the passed motions, those that are done: precision of passes
    done_passed: Share  #: of the motions that are done, those passed: recall of passes

    @staticmethod
    def of(cases: Iterable[Case], definition: str = STRICT) -> Score:
        """The score on ``cases`` by a definition of ``controller.motion_measurement``."""
        pairs = [(bool(case.refusal), bool(case.outcome[definition])) for case in cases]
        counts = []
        for answer in (True, False):
            right = pairs.count((answer, answer))
            counts += [Share(right, [pair[k] for pair in pairs].count(answer)) for k in (0, 1)]
        return Score(*counts)

    @property
    def n(self) -> int:
        """Motions."""
        return self.refused_right.n + self.passed_right.n

    @property
    def least(self) -> float:
        """The lowest of the four shares."""
        return min(share.value for share in self)

    def as_dict(self) -> dict[str, object]:
        """Plain values, for JSON."""
        return {"n": self.n, **{name: share.as_dict() for name, share in self._asdict().items()}}


def scores(cases: Sequence[Case]) -> dict[str, Score]:
    """By name, all rows of the table: halves, strata, dynamic motions, definitions."""
    kinds: dict[str, Callable[[Case], bool]] = {
        "strict": lambda case: True,
        **{s: lambda case, s=s: case.stratum == s for s in STRATA},
        "dynamic": lambda case: case.is_dynamic,
        "solved": lambda case: case.is_dynamic and case.has_plan,
    }
    found: dict[str, Score] = {}
    for half in HALVES:
        own = [case for case in cases if case.half == half]
        found |= {f"{half} {name}": Score.of(filter(is_it, own)) for name, is_it in kinds.items()}
        found |= {f"{half} {by}": Score.of(own, by) for by in (STOPS, LENIENT, FELL)}
    return found


def render(cases: Sequence[Case]) -> str:
    """The table of all scores, and why motions went wrong; of single motions nothing."""
    lines = [
        _ROW.format(name="", n="", done="", shares=_HEADS).rstrip(),
        _ROW.format(name="", n="n", done="done", shares=_MORE),
        "-" * 80,
    ]
    for name, score in scores(cases).items():
        shares = [str(share) for share in score]
        lines.append(_ROW.format(name=name, n=score.n, done=score.done_passed.n, shares=shares))
        if name.endswith(FELL):
            lines.append("-" * 80)
    kinds = Counter(re.sub(r"[\d.]+ ", "", why) for c in cases for why in c.outcome[STRICT])
    counts = ", ".join(f"{kind} {n}" for kind, n in kinds.most_common())
    lines += textwrap.wrap(f"What went wrong, strictly: {counts or 'nothing'}.", 80)
    wrong = [case.outcome[STRICT] for case in cases if case.outcome[STRICT] and case.has_plan]
    told = sum(NOT_DONE in reasons for reasons in wrong)
    said = f"Of {len(wrong)} motions that were played and went wrong, `play` says so of {told}."
    return "\n".join([*lines, said])


def wrong_ones(cases: Sequence[Case]) -> list[str]:
    """The motions of the train half on which the check was wrong; those of the other are secret."""
    return [
        f"{case.name} ({case.stratum}): "
        + (f"refused ({', '.join(case.refusal)})" if case.refusal else "passed")
        + f"; {', '.join(case.outcome[STRICT]) or 'done'}"
        for case in cases
        if case.half == TRAIN and case.is_wrong
    ]
