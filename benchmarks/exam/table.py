"""The report of the exam, at most 80 columns wide."""

from __future__ import annotations

import re
import textwrap
from collections import Counter
from collections.abc import Sequence

from benchmarks.exam.cases import Case, Score, chosen
from benchmarks.exam.drawing import TEST, TRAIN
from benchmarks.exam.questions import STRATA
from controller.motion_outcome import FELL, LENIENT, NOT_DONE, STOPS, STRICT

_ROW = "{name:<17}{n:>4}{done:>5}" + "".join(f"{{shares[{k}]:>13}}" for k in range(4))
_HEADS = ("refused", "wrong:", "passed", "done:")
_MORE = ("are wrong", "refused", "are done", "passed")
HALVES = (TRAIN, TEST)


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
