"""``python -m benchmarks feasibility``: does the feasibility check foresee what physics does?

An exam: motions drawn over the whole language, easy ones, impossible ones and ones at the border of
what physics does, are checked, and played on the whole-body controller in MuJoCo whatever the check
says. Families of motions lie in one half each: thresholds of the check may be set on the train half
only, and of the test half no single motion is shown.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

from benchmarks.command import (
    IDEAL,
    RESULTS,
    add_options,
    measure_all,
    on_sensors,
    positive,
    publish,
)
from benchmarks.study import Measurement, Metric, Study
from benchmarks.validation_set.causes import CAUSES, examples, render_causes
from benchmarks.validation_set.drawing import TEST
from benchmarks.validation_set.physics import BORDER, BORDERS, play
from benchmarks.validation_set.questions import (
    Question,
    draw_name,
    draws,
    dynamic_questions,
    questions,
)
from benchmarks.validation_set.scores import HALVES, Case, noticed, render, scores, wrong_ones
from benchmarks.validation_set.stored import (
    BORDERS_FILE,
    borders_version,
    digest,
    read_borders,
    read_outcomes,
    write_borders,
    write_outcomes,
)
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.motion_failures import FELL, LENIENT, STOPS, STRICT, MotionFailures, failures_of
from controller.sweeps.trials import Trial
from go2_wbc.errors import CommandError
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker

EXAM, DYNAMIC = "exam", "dynamic"
THRESHOLD = 0.95
"""Least precision and recall of refusals and of passes, test half, strict outcome."""
BORDER_PRECISION, BORDER_RECALL = 0.85, 0.90
"""The same of refusals among the motions at the border."""
LEAST_DYNAMIC = 100
"""Dynamic motions of the test half that are judged, at least."""
EXAMPLES = """
python -m benchmarks feasibility              the exam: ten minutes, 2 cores;
                                              twenty where nothing is stored
python -m benchmarks feasibility --motions 60
python -m benchmarks feasibility --rows causes
python -m benchmarks feasibility --rows dynamic --half test
python -m benchmarks feasibility --wrong      also what is wrong, train half
python -m benchmarks feasibility --remake     play all, store the outcomes
python -m benchmarks feasibility --sensors imu
                                              play all on its own sensors
python -m benchmarks feasibility --borders    bisect missing borders, with
                                              --remake all: half an hour
"""
CAUSES_ROW = "causes"
REFUSED = Metric("feasibility.refused", "verdict", "refused by the check", "", None)
OUTCOMES = {
    name: Metric(f"feasibility.{name}", "physics", f"went wrong, {name}", "", None)
    for name in (STRICT, STOPS, LENIENT, FELL)
}
PLAN = "plan"
"""The note that names motion and plan."""
METRICS = (REFUSED, *OUTCOMES.values())
_BETWEEN = "; "


def register(subparsers: Subparsers) -> None:
    """Add the options of ``feasibility``."""
    parser = add_parser(
        subparsers,
        "feasibility",
        "Does the feasibility check foresee what physics does? Motions over the whole\n"
        "language, easy, impossible and at the border, are checked and played in MuJoCo.\n"
        "Exit code 0 if precision and recall meet their thresholds, 1 if not.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "--rows", choices=(EXAM, DYNAMIC, CAUSES_ROW), default=EXAM, help="default %(default)s"
    )
    parser.add_argument("--half", choices=HALVES, help="only the families of this half")
    parser.add_argument("--motions", metavar="N", type=positive, help="only the first N")
    parser.add_argument("--wrong", action="store_true", help="list what is wrong, train half")
    parser.add_argument(
        "--remake", action="store_true", help="ask physics again, and store what it says"
    )
    parser.add_argument(
        "--borders", action="store_true", help="bisect where physics changes its mind"
    )
    add_options(parser, "sensors", "jobs", *RESULTS)


def run(args: argparse.Namespace) -> int:
    """Bisect borders, or hold the exam and report it.

    Raises:
        CommandError: if outcomes on the robot's own sensors are to be stored.
    """
    if args.remake and args.sensors != IDEAL:
        raise CommandError(
            f"--remake stores outcomes on the true state: leave out --sensors {args.sensors}, "
            "or --remake, which plays every motion anyway"
        )
    if args.borders:
        return _bisect(args)
    if args.rows == CAUSES_ROW:
        cases = _measured(args, on_sensors(CAUSE_STUDY, args.sensors), examples())
        wrong = sum(bool(case.refusal) is not bool(case.outcome.strict) for case in cases)
        publish(args, {"wrong": wrong, "cases": _plain(cases)}, render_causes(cases))
        return ExitCode.OK if not wrong else ExitCode.FAILED
    asked = _QUESTIONS[args.rows]()
    is_played = args.remake or args.sensors != IDEAL
    chosen = on_sensors((REMADE if is_played else STORED)[args.rows], args.sensors)
    scenario = replace(chosen, name=f"{chosen.name} {borders_version()}")
    if not is_played and (why := read_outcomes()[1]):
        print(f"{why}: physics is asked again", file=sys.stderr)
    cases = _measured(args, scenario, asked)
    judge = judged if args.rows == EXAM else judged_dynamic
    is_ok, verdict = judge(cases, len(_seeds(args, asked)))
    table = [render(cases), noticed(cases), *(wrong_ones(cases) if args.wrong else []), verdict]
    values = {"passed": is_ok, "scores": {n: s.as_dict() for n, s in scores(cases).items()}}
    if args.wrong:
        values["wrong"] = wrong_ones(cases)
    publish(args, values, "\n".join(table))
    return ExitCode.OK if is_ok else ExitCode.FAILED


@cache
def exam() -> list[Question]:
    """All motions of the exam, in their order."""
    return questions(read_borders())


@cache
def dynamic() -> list[Question]:
    """Dynamic motions only, those of the exam and more."""
    return dynamic_questions(read_borders())


@cache
def _known() -> dict[str, MotionFailures]:
    return read_outcomes()[0]


@cache
def _checker() -> FeasibilityChecker:
    """Made once for all trials of a process."""
    return FeasibilityChecker(RobotModel())


def ask(trial: Trial, *, of: str, is_played: bool) -> Measurement:
    """Check a motion and see what physics does; reasons are kept as notes.

    Args:
        trial: its seed is the number of the motion.
        of: the exam, its dynamic motions and more, or the known causes.
        is_played: whether physics is asked although an outcome is stored.
    """
    question = _QUESTIONS[of]()[trial.seed]
    checker = _checker()
    plan = question.plan(checker.model)
    report, name = checker.check(plan), f"{question.name} {digest(plan)}"
    outcome = None if is_played else _known().get(name)
    if outcome is None:
        played = play(plan, checker.model, question.draw, trial.sensors)
        outcome = failures_of(played, plan)
    reasons = {REFUSED.name: tuple(dict.fromkeys(found.check for found in report.failures))}
    reasons |= {metric.name: outcome.by(kind) for kind, metric in OUTCOMES.items()}
    values = {metric: float(bool(reason)) for metric, reason in reasons.items()}
    values[REFUSED.name] = float(not report.ok)
    texts = {metric: _BETWEEN.join(reason) for metric, reason in reasons.items() if reason}
    return Measurement(values, notes={**texts, PLAN: name})


_QUESTIONS = {EXAM: lambda: exam(), DYNAMIC: lambda: dynamic(), CAUSES: examples}
STORED = {of: Study(of, METRICS, partial(ask, of=of, is_played=False)) for of in (EXAM, DYNAMIC)}
REMADE = {
    of: Study(f"{of}, played", METRICS, partial(ask, of=of, is_played=True))
    for of in (EXAM, DYNAMIC)
}
CAUSE_STUDY = Study("causes", METRICS, partial(ask, of=CAUSES, is_played=True))


def _measured(args: argparse.Namespace, scenario: Study, asked: Sequence[Question]) -> list[Case]:
    """The cases of the motions asked for; outcomes are stored if that is asked for."""
    found = measure_all(args, [(scenario, seed) for seed in _seeds(args, asked)])[scenario.name]
    lost = {seed: one.reason for seed, one in found.items() if not one.values}
    for seed, reason in sorted(lost.items()):
        print(f"{asked[seed].name}: no result, {reason}", file=sys.stderr)
    answered = {seed: one for seed, one in sorted(found.items()) if one.values}
    cases = {seed: _case(asked[seed], one) for seed, one in answered.items()}
    if args.remake and args.rows != CAUSES_ROW:
        names = {seed: one.notes[PLAN] for seed, one in answered.items()}
        new = {names[seed]: case.outcome for seed, case in cases.items()}
        write_outcomes({**_known(), **new})
    return list(cases.values())


def _seeds(args: argparse.Namespace, asked: Sequence[Question]) -> list[int]:
    """Numbers of the motions that are asked for."""
    seeds = [n for n, one in enumerate(asked) if args.half in (None, one.family.half)]
    return seeds[: args.motions]


def _case(question: Question, one: Measurement) -> Case:
    def reasons(metric: Metric) -> tuple[str, ...]:
        return tuple(filter(None, one.notes.get(metric.name, "").split(_BETWEEN)))

    family = question.family
    refusal = reasons(REFUSED) or (("refused",) if one.values[REFUSED.name] else ())
    outcome = MotionFailures(*(reasons(metric) for metric in OUTCOMES.values()))
    half = CAUSES if question.stratum == CAUSES else family.half
    is_dynamic = family.is_dynamic
    return Case(question.name, family.name, half, question.stratum, is_dynamic, refusal, outcome)


def judged(cases: Sequence[Case], asked: int) -> tuple[bool, str]:
    """Whether the test half meets the thresholds and no motion was lost, in words."""
    found = scores(cases)
    whole, border = found[f"{TEST} {STRICT}"], found[f"{TEST} border"]
    lost = asked - len(cases)
    is_ok = whole.least >= THRESHOLD and not lost
    is_ok &= border.refused_right.value >= BORDER_PRECISION
    is_ok &= border.wrong_refused.value >= BORDER_RECALL
    said = f"{len(cases)} motions, {lost} without a result. Test half: all four shares "
    said += f">= {THRESHOLD}, at the border {BORDER_PRECISION} and {BORDER_RECALL}: "
    return is_ok, said + ("ok." if is_ok else "NO.")


def judged_dynamic(cases: Sequence[Case], asked: int) -> tuple[bool, str]:
    """Whether enough dynamic motions of the test half meet the threshold, in words."""
    whole, lost = scores(cases)[f"{TEST} {STRICT}"], asked - len(cases)
    is_ok = whole.least >= THRESHOLD and whole.n >= LEAST_DYNAMIC and not lost
    said = f"{len(cases)} dynamic motions, {lost} without a result, {whole.n} of the test half: "
    said += f"all four shares >= {THRESHOLD} on {LEAST_DYNAMIC} or more: "
    return is_ok, said + ("ok." if is_ok else "NO.")


def _bisect(args: argparse.Namespace) -> int:
    """Find the borders that are not stored, or all of them, and store them."""
    kept = {} if args.remake or not BORDERS_FILE.exists() else read_borders()
    names = [draw_name(*draw) for draw in draws()]
    wanted = [seed for seed, name in enumerate(names) if name not in kept][: args.motions]
    found = measure_all(args, [(BORDERS, seed) for seed in wanted]) if wanted else {}
    for seed, one in found.get(BORDERS.name, {}).items():
        if one.values:
            kept[names[seed]] = one.values.get(BORDER.name)
    write_borders({name: kept[name] for name in names if name in kept})
    none = sum(value is None for value in kept.values())
    text = f"{len(kept)} of {len(names)} borders, {none} beyond the bounds of their family"
    publish(args, {"borders": len(kept), "draws": len(names), "none": none}, text)
    return ExitCode.OK if len(kept) == len(names) else ExitCode.FAILED


def _plain(cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Cases for JSON."""
    rows: list[Mapping[str, Any]] = [
        {"name": c.name, "refused": c.refusal, "wrong": c.outcome.strict} for c in cases
    ]
    return [dict(row) for row in rows]
