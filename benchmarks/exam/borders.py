"""At which amplitude does physics change its mind? Bisected by playing; the check is not asked."""

from __future__ import annotations

import math

from benchmarks.exam.outcome import play
from benchmarks.exam.questions import Question, draws
from benchmarks.scenario import Measurement, Metric, Scenario
from benchmarks.trials import Trial
from controller.motion_outcome import outcome_of
from go2_wbc.robot.model import RobotModel

NEAR, NEAR_SOLVED = 1.05, 1.10
"""Ratio of amplitudes, one done and one failed, at which the search ends."""
BORDER = Metric("feasibility.border", "border", "amplitude at which physics fails", "", None)
PLAYS = Metric("feasibility.plays", "border", "motions played to find it", "", None)


def is_done(question: Question) -> bool:
    """Whether physics does a motion, by the strict definition."""
    model = RobotModel()
    plan = question.plan(model)
    return not outcome_of(play(plan, model, question.draw), plan).strict


def measure_border(trial: Trial) -> Measurement:
    """The border of draw number ``trial.seed``, or why there is none."""
    family, number = draws()[trial.seed]
    low, high, plays = family.low, family.high, 2
    if not is_done(Question(family, number, low)):
        return Measurement({PLAYS.name: 1.0}, reason="already the lowest amplitude fails")
    if is_done(Question(family, number, high)):
        return Measurement({PLAYS.name: 2.0}, reason="even the highest amplitude is done")
    near = NEAR_SOLVED if family.is_dynamic else NEAR
    while high / low > near:
        middle, plays = math.sqrt(low * high), plays + 1
        if is_done(Question(family, number, middle)):
            low = middle
        else:
            high = middle
    return Measurement({BORDER.name: math.sqrt(low * high), PLAYS.name: float(plays)})


BORDERS = Scenario("borders", (BORDER, PLAYS), measure_border)
