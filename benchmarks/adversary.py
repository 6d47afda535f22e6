"""``python -m benchmarks adversary``: who looks for motions that pass and fail, finds how many?

A search, not a sample: from a random motion of a family, numbers are changed, and what makes the
motion worse in physics, at a chance that is still stated high, is kept and changed further, as
(1+1) evolution strategies do with the one-fifth rule (Rechenberg 1973). A change that the check
refuses is halved, which leads along the border of what it passes. The search knows of the check its
verdict and its chance, and of physics what was played; limits, margins and equations it does not.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from benchmarks.adversary_motions import COUNT, FAMILIES, Numbers
from benchmarks.command import add_sweep, positive, publish, run_sweep
from benchmarks.validation_set.physics import play
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.motion_failures import failures_of, shares_of
from controller.motion_measurement import MotionMeasurement
from controller.sweeps.rows import Row
from controller.sweeps.summary import rate_interval
from controller.sweeps.trials import TrialFailed
from go2_wbc.errors import MotionError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker

PLAYS, PLAYS_OF_A_SEARCH = 500, 20
STATED, NOT_DONE = 0.95, 0.02
"""Chance from which on a pass counts, and the greatest share of those plays that is not done."""
FIRST = 9000
"""First seed that judges: whoever mends the check looks at lower ones only."""
MOST_CHECKS, HALVINGS = 60, 3
"""Changes that are tried for one play, and how often one that is refused is halved."""
CHANGED, WIDEST, NARROWEST = 0.3, 0.3, 0.03
"""Share of the numbers that change at once; their standard deviation, at first and at least."""
WIDER, CLOSER = 1.5, 0.9
"""Factors of that after a change for the worse, and after another: even at one in five."""
FALL, FAILED = 10.0, 2.0
"""What a fall counts, and at least what ``play`` calls not done; 1 is just not as written."""
COUNTED = ("plays", "wrong", "fell")
EXAMPLES = """
python -m benchmarks adversary             4 x 500 plays: half an hour,
                                           2 cores
python -m benchmarks adversary --plays 40 --families trots static
python -m benchmarks adversary --first 0   seeds to mend the check by
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``adversary``."""
    parser = add_parser(
        subparsers,
        "adversary",
        "Searches for motions that the check passes at a high chance and that fail in\n"
        "MuJoCo. Goes on where it was interrupted. Exit code 0 if none fell and 2 % at\n"
        "most of each family were not done, else 1.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "--plays", metavar="N", type=positive, default=PLAYS,
        help="in each family, default %(default)s",
    )  # fmt: skip
    parser.add_argument(
        "--families", metavar="NAME", nargs="+", choices=FAMILIES, default=list(FAMILIES),
        help=f"{', '.join(FAMILIES)}; default all",
    )  # fmt: skip
    parser.add_argument(
        "--first", metavar="SEED", type=int, default=FIRST, help="default %(default)s"
    )
    add_sweep(parser, jobs=2)


def run(args: argparse.Namespace) -> int:
    """Search with what is not kept yet, count the finds."""
    rows: list[Row] = []
    searches, lost = -(-args.plays // PLAYS_OF_A_SEARCH), dict[int, str]()
    for name in args.families:
        first = list(FAMILIES).index(name) * SEEDS + args.first
        result = run_sweep(args, search, searches, first_seed=first)
        rows += result.rows
        lost |= result.failures
    counts = counted(rows)
    is_ok = is_met(counts) and not lost
    publish(args, {"passed": is_ok, "families": counts, "lost": lost}, render(rows))
    return ExitCode.OK if is_ok else ExitCode.FAILED


SEEDS = 1_000_000  # Of a family; then those of the next begin


@dataclass(slots=True)
class Attempt:
    """A motion that was passed, and what came of it.

    Attributes:
        numbers: that it was written by.
        chance: that was stated.
        harm: what went wrong, in words; empty if it was done.
        worst: the greatest share of what is allowed.
    """

    numbers: Float[np.ndarray, " k"]
    chance: float
    harm: tuple[str, ...] = ()
    worst: float = 0.0

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
            goal = self.rng.random(COUNT)
            if best is None:
                halvings, start = 0, goal
            else:
                halvings, start = HALVINGS, best.numbers
                step = self.width * self.rng.standard_normal(COUNT)
                goal = np.clip(start + step * (goal < CHANGED), 0.0, 1.0)
            for k in range(halvings + 1):
                numbers = start + (goal - start) / 2**k
                if (found := passed(self.family, numbers)) is not None:
                    return Attempt(numbers, found[0]), found[1]
        return None


def search(seed: int) -> dict[str, object]:
    """The row of a search: how many were played and went wrong, and those that did."""
    number, start = divmod(seed, SEEDS)
    family = list(FAMILIES)[number]
    one = Search(family, np.random.default_rng([start, number]))
    while len(one.played) < PLAYS_OF_A_SEARCH and one.go_on():
        pass
    wrong = [attempt for attempt in one.played if attempt.harm]
    told = [(a.chance, "; ".join(a.harm), np.round(a.numbers, 5).tolist()) for a in wrong]
    return {
        "family": family,
        "plays": len(one.played),
        "wrong": len(wrong),
        "fell": sum("fell" in attempt.harm for attempt in wrong),
        "worst": max((attempt.worst for attempt in one.played), default=0.0),
        "finds": json.dumps(told),
    }


def passed(
    family: str, numbers: Sequence[float] | Float[np.ndarray, " k"], least: float = STATED
) -> tuple[float, MotionPlan] | None:
    """Chance and plan of a motion that the check passes at a chance of ``least`` or more."""
    try:
        line = FAMILIES[family](Numbers(np.asarray(numbers).tolist()))
        plan = checker().plan(line, check=False)
        report = checker().check(plan)
    except MotionError:
        return None
    return (report.probability, plan) if report.ok and report.probability >= least else None


def outcome(plan: MotionPlan, seed: int = 0) -> tuple[tuple[str, ...], float]:
    """What went wrong with a plan that was played, and the greatest share of what is allowed."""
    try:
        run = play(plan, checker().model, seed)
    except TrialFailed as error:
        return (str(error),), FAILED
    return failures_of(run, plan).strict, _worst(run, plan)


def _worst(run: MotionMeasurement, plan: MotionPlan) -> float:
    share = max(share for share, _ in shares_of(run, plan).values())
    return FALL if run.fall else share if run.said else max(share, FAILED)


@lru_cache(maxsize=1)
def checker() -> FeasibilityChecker:
    """Made once in each process."""
    return FeasibilityChecker(RobotModel())


Counts = dict[str, dict[str, int]]
"""By family: searches, plays, and of these what was wrong, and fell."""


def counted(rows: Sequence[Row]) -> Counts:
    """What came of the searches."""
    counts: Counts = {}
    for row in rows:
        own = counts.setdefault(str(row["family"]), dict.fromkeys(("searches", *COUNTED), 0))
        own["searches"] += 1
        for name in COUNTED:
            own[name] += int(row[name])
    return counts


def is_met(counts: Counts) -> bool:
    """Whether no family has a fall, or too much that is not done."""
    return bool(counts) and all(
        not own["fell"] and own["wrong"] <= NOT_DONE * own["plays"] for own in counts.values()
    )


def render(rows: Sequence[Row]) -> str:
    """A line for every family, and the first find of every search, at most 80 columns wide."""
    lines = [f"{'family':<12}{'searches':>9}{'played':>8}{'fell':>7}{'not done':>10}", "-" * 80]
    counts = counted(rows)
    for family, own in counts.items():
        low, high = rate_interval(own["wrong"], max(own["plays"], 1))
        told = f"{own['searches']:>9}{own['plays']:>8}{own['fell']:>7}{own['wrong']:>10}"
        lines.append(f"{family:<12}{told}   {low:.3f}-{high:.3f}")
    lines.append("-" * 80)
    for row in rows:
        finds = json.loads(str(row["finds"]))
        lines += [f"seed {row['seed']} {p:.3f} {harm:.60}" for p, harm, _ in finds[:1]]
    bar = f"bar 0 fell, {NOT_DONE:.0%} not done: {'ok' if is_met(counts) else 'NO'}"
    return "\n".join([*lines, f"passed at a chance of {STATED} or more; {bar}"])
