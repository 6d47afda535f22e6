"""``python -m benchmarks feasibility``: does the feasibility check foresee what physics does?

An exam: motions drawn over the whole language, easy ones, impossible ones and ones at the border of
what physics does, are checked, and played on the whole-body controller in MuJoCo whatever the check
says. Families of motions lie in one half each: thresholds of the check may be set on the train half
only, and of the test half no single motion is shown.
"""

import sys
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Annotated

from benchmarks.command import Jobs, Output, Resume, Sensors, measure_all, positive
from benchmarks.robots import checker
from benchmarks.study import IDEAL, Results, Study, TrialResult
from benchmarks.validation_set import questions as exam
from benchmarks.validation_set.drawing import TEST
from benchmarks.validation_set.physics import (
    BORDER,
    BORDERS_FILE,
    LENIENT,
    STOPS,
    STRICT,
    borders_of,
    borders_version,
    play,
    read_borders,
    verdicts_of,
    write_borders,
)
from benchmarks.validation_set.questions import Question, draw_name, draws
from benchmarks.validation_set.scores import HALVES, Case, render, scores, wrong_ones
from controller.motion_measurement import FELL
from controller.sweeps.trials import Trial

EXAM, DYNAMIC, REFUSED = "exam", "dynamic", "refused"
THRESHOLD = 0.95  #: Least precision and recall of refusals and of passes, test half, strict outcome
BORDER_PRECISION, BORDER_RECALL = 0.85, 0.90
"""The same of refusals among the motions at the border."""
LEAST_DYNAMIC = 100  #: Dynamic motions of the test half that are judged, at least
OUTCOMES = (STRICT, STOPS, LENIENT, FELL)
_BETWEEN = "; "


def run(
    *,
    rows: Annotated[str, "default %(default)s", (EXAM, DYNAMIC)] = EXAM,
    half: Annotated[str | None, "only the families of this half", HALVES] = None,
    motions: Annotated[int | None, "N", "only the first N", positive] = None,
    wrong: Annotated[bool, "list what is wrong, train half"] = False,
    borders: Annotated[bool, "bisect, and store them"] = False,
    remake: Annotated[bool, "all borders, stored or not"] = False,
    sensors: Sensors = IDEAL,
    jobs: Jobs = 2,
    resume: Resume = False,
    output: Output,
) -> int:
    """Does the feasibility check foresee what physics does?

    Motions over the whole language, easy, impossible and at the border, are checked and played in
    MuJoCo. Exit code 0 if precision and recall meet their thresholds, 1 if not.

    Examples:
    python -m benchmarks feasibility              the exam: 20 minutes, 2 cores
    python -m benchmarks feasibility --motions 60
    python -m benchmarks feasibility --rows dynamic --half test
    python -m benchmarks feasibility --wrong      also what is wrong, train half
    python -m benchmarks feasibility --sensors imu
                                                  on its own sensors
    python -m benchmarks feasibility --borders    bisect missing borders, with
                                                  --remake all: half an hour
    """
    measure = partial(measure_all, "feasibility", jobs=jobs, resume=resume)
    if borders:
        return _bisect(measure, motions, output, remake=remake)
    if remake:
        print("--remake is for --borders: every motion is played, none is stored", file=sys.stderr)
    asked, study = asked_of(rows, half)[:motions], study_of(rows, half).on(sensors)
    found = measure([study], len(asked))[study.name]
    for seed, one in found.items():
        if not one.values:
            print(f"{asked[seed].name}: no result, {one.reason}", file=sys.stderr)
    cases = [case_of(asked[seed], one) for seed, one in found.items() if one.values]
    is_ok, verdict = judged(cases, len(asked), rows)
    values = {"passed": is_ok, "scores": {n: s.as_dict() for n, s in scores(cases).items()}}
    more = {"wrong": wrong_ones(cases)} if wrong else {}
    text = "\n".join([render(cases), *more.get("wrong", ()), verdict])
    return output.publish(values | more, text)


@cache
def asked_of(rows: str, half: str | None = None) -> list[Question]:
    """All motions of the exam, or of a half; or dynamic ones only, those of the exam and more."""
    asked = (exam.questions if rows == EXAM else exam.dynamic_questions)(read_borders())
    return [one for one in asked if half in (None, one.family.half)]


def ask(trial: Trial, found: TrialResult, of: str, half: str | None) -> None:
    """Check the motion of that number and see what physics does; reasons are kept as notes."""
    question, model = asked_of(of, half)[trial.seed], checker().model
    plan = question.plan(model)
    report = checker().check(plan)
    outcome = verdicts_of(play(plan, model, question.draw, trial.sensors), plan)
    refusal = tuple(dict.fromkeys(finding.check for finding in report.failures))
    reasons = {REFUSED: refusal, **outcome}
    found.values = {row: float(bool(reason)) for row, reason in reasons.items()}
    found.values[REFUSED] = float(not report.ok)
    found.notes = {row: _BETWEEN.join(reason) for row, reason in reasons.items()}


def study_of(of: str, half: str | None = None) -> Study:
    """The trials of these motions, with borders as they are now."""
    return Study(
        " ".join(filter(None, (of, half, borders_version()))),
        {
            "verdict": ((REFUSED, "refused by the check", ""),),
            "physics": [(kind, f"went wrong, {kind}", "") for kind in OUTCOMES],
        },
        partial(ask, of=of, half=half),
        prefix="",
    )


def case_of(question: Question, one: TrialResult) -> Case:
    """What a trial found of a motion."""

    def reasons(row: str) -> tuple[str, ...]:
        return tuple(filter(None, one.notes[row].split(_BETWEEN)))

    family = question.family
    refusal = reasons(REFUSED) or (("refused",) if one.values[REFUSED] else ())
    outcome = {kind: reasons(kind) for kind in OUTCOMES}
    return Case(question.name, family.half, question.stratum, family.is_dynamic, refusal, outcome)


def judged(cases: Sequence[Case], asked: int, rows: str = EXAM) -> tuple[bool, str]:
    """Whether the test half meets the thresholds and no motion was lost, in words."""
    found, lost = scores(cases), asked - len(cases)
    whole, border = found[f"{TEST} {STRICT}"], found[f"{TEST} border"]
    said = f"{len(cases)} motions, {lost} without a result. Test half: all four shares "
    if rows == EXAM:
        is_ok = border.refused_right.value >= BORDER_PRECISION
        is_ok &= border.wrong_refused.value >= BORDER_RECALL
        said += f">= {THRESHOLD}, at the border {BORDER_PRECISION} and {BORDER_RECALL}: "
    else:
        is_ok = whole.n >= LEAST_DYNAMIC
        said += f">= {THRESHOLD} on {LEAST_DYNAMIC} dynamic motions or more, here {whole.n}: "
    is_ok &= whole.least >= THRESHOLD and not lost
    return is_ok, said + ("ok." if is_ok else "NO.")


def _bisect(
    measure: Callable[[Sequence[Study], int], Results],
    motions: int | None,
    output: Output,
    *,
    remake: bool,
) -> int:
    """Find the borders that are not stored, or all of them, and store them."""
    kept = {} if remake or not BORDERS_FILE.exists() else read_borders()
    names = [draw_name(*draw) for draw in draws()]
    wanted = [seed for seed, name in enumerate(names) if name not in kept][:motions]
    study = borders_of(wanted)
    found = measure([study], len(wanted))[study.name] if wanted else {}
    for number, one in found.items():
        if one.values:
            kept[names[wanted[number]]] = one.values.get(BORDER)
    write_borders({name: kept[name] for name in names if name in kept})
    none = sum(value is None for value in kept.values())
    text = f"{len(kept)} of {len(names)} borders, {none} beyond the bounds of their family"
    values = {"borders": len(kept), "draws": len(names), "none": none}
    return output.publish({"passed": len(kept) == len(names), **values}, text)
