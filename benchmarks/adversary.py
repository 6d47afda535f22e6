"""``python -m benchmarks adversary``: who looks for motions that pass and fail, finds how many?

A search, not a sample: from a random motion of a family, numbers are changed, and what makes the
motion worse in physics, at a chance that is still stated high, is kept and changed further, as
(1+1) evolution strategies do with the one-fifth rule (Rechenberg 1973). A change that the check
refuses is halved, which leads along the border of what it passes. The search knows of the check its
verdict and its chance, and of physics what was played; limits, margins and equations it does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from jaxtyping import Float

from benchmarks.adversary_motions import COUNT, FAMILIES, Numbers
from benchmarks.command import Benchmark
from benchmarks.robots import checker
from benchmarks.study import Study, TrialResult
from benchmarks.validation_set.physics import play
from controller.motion_measurement import failures_of, shares_of
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.errors import MotionError
from go2_wbc.motion_plan import MotionPlan

PLAYS = 20  # Of a search
STATED = 0.95  #: Chance from which on a pass counts
FIRST = 9000  #: First seed that judges: whoever mends the check looks at lower ones only
MOST_CHECKS, HALVINGS = 60, 3
"""Changes that are tried for one play, and how often one that is refused is halved."""
CHANGED, WIDEST, NARROWEST = 0.3, 0.3, 0.03
"""Share of the numbers that change at once; their standard deviation, at first and at least."""
WIDER, CLOSER = 1.5, 0.9
"""Factors of that after a change for the worse, and after another: even at one in five."""
FALL, FAILED = 10.0, 2.0
"""What a fall counts, and at least what ``play`` calls not done; 1 is just not as written."""
ROWS = (
    ("fell", "fell", "<= 0"),
    ("wrong", "not done", "<= 2 %"),
    ("plays", "plays of a search", ""),
    ("worst", "worst, of what is allowed", ""),
)


@dataclass(slots=True)
class Attempt:
    """A motion that was passed, and what came of it."""

    numbers: Float[np.ndarray, " k"]  #: that it was written by
    chance: float  #: that was stated
    harm: tuple[str, ...] = ()  #: what went wrong, in words; empty if it was done
    worst: float = 0.0  #: the greatest share of what is allowed

    @property
    def score(self) -> float:
        """What the search makes greater."""
        return self.chance * self.worst


@dataclass(slots=True)
class Search:
    """One search in a family; ``played`` is what it has come to."""

    family: str
    rng: np.random.Generator
    played: list[Attempt] = field(default_factory=list)
    width: float = WIDEST

    def go_on(self) -> bool:
        """Play one more motion; false if none was found that passes."""
        best = max(self.played, key=lambda one: one.score, default=None)
        if (found := self._next(best)) is None:
            return False
        attempt, plan = found
        attempt.harm, attempt.worst = outcome(plan)
        is_worse = best is None or attempt.score > best.score
        self.width = max(NARROWEST, min(WIDEST, self.width * (WIDER if is_worse else CLOSER)))
        self.played.append(attempt)
        return True

    def _next(self, best: Attempt | None) -> tuple[Attempt, MotionPlan] | None:
        """A motion that is passed, beside ``best`` or anywhere."""
        for _ in range(MOST_CHECKS):
            start = goal = self.rng.random(COUNT)
            if best is not None:
                step = self.width * self.rng.standard_normal(COUNT) * (goal < CHANGED)
                start, goal = best.numbers, np.clip(best.numbers + step, 0.0, 1.0)
            for k in range(1 if best is None else HALVINGS + 1):
                numbers = start + (goal - start) / 2**k
                if (found := passed(self.family, numbers)) is not None:
                    return Attempt(numbers, found[0]), found[1]
        return None


def measure(trial: Trial, found: TrialResult, family: str) -> None:
    """One search: how many of its plays went wrong."""
    number = list(FAMILIES).index(family)
    one = Search(family, np.random.default_rng([FIRST + trial.seed, number]))
    while len(one.played) < PLAYS and one.go_on():
        pass
    wrong, plays = [attempt for attempt in one.played if attempt.harm], len(one.played)
    found.values = {
        "fell": float(sum("fell" in attempt.harm for attempt in wrong)),
        "wrong": 100.0 * len(wrong) / max(plays, 1),
        "plays": float(plays),
        "worst": max((attempt.worst for attempt in one.played), default=0.0),
    }
    found.notes = {
        f"find {k}": f"{a.chance:.3f} {'; '.join(a.harm)} {np.round(a.numbers, 5).tolist()}"
        for k, a in enumerate(wrong)
    }


def passed(
    family: str, numbers: Sequence[float] | Float[np.ndarray, " k"]
) -> tuple[float, MotionPlan] | None:
    """Chance and plan of a motion that the check passes at a chance of ``STATED`` or more."""
    try:
        line = FAMILIES[family](Numbers(np.asarray(numbers).tolist()))
        plan = checker().plan(line, check=False)
        report = checker().check(plan)
    except MotionError:
        return None
    return (report.probability, plan) if report.ok and report.probability >= STATED else None


def outcome(plan: MotionPlan) -> tuple[tuple[str, ...], float]:
    """What went wrong with a plan that was played, and the greatest share of what is allowed."""
    try:
        run = play(plan, checker().model, 0)
    except TrialFailed as error:
        return (str(error),), FAILED
    share = max(share for share, _ in shares_of(run, plan).values())
    worst = FALL if run.fall else share if run.said else max(share, FAILED)
    return failures_of(run, plan), worst


STUDIES = tuple(
    Study(name, {f"{name}, passed at {STATED}": ROWS}, partial(measure, family=name), sensors=None)
    for name in FAMILIES
)
run = Benchmark(
    "adversary",
    "Searches for motions that the check passes at a high chance and that fail in\n"
    f"MuJoCo; a seed is a search of {PLAYS} plays.",
    STUDIES,
    takes="half an hour on two cores",
    examples=("--seeds 25", "--rows trots static --seeds 2"),
).run
