"""``python -m benchmarks feasibility``: does the feasibility check foresee what physics does?

Each seed gives one motion. It is checked, then played on the whole-body controller in MuJoCo,
whatever the check said, on the least friction that the check counts on.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from benchmarks.generated_motions import GeneratedMotion, generated_motion, near_limit_motion
from benchmarks.scenario import Measurement, Metric, Scenario
from benchmarks.session import add_options, measure_all, positive, publish
from benchmarks.trials import Trial, TrialRobot
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.motion_measurement import MotionMeasurement, measure_motion
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker

FRICTION = 0.5
"""Friction coefficient of the floor: the least of the trials' conditions."""
SLIP = 0.010
"""Distance [m] that a standing foot may slide."""
OFF_PLAN = 0.05
"""Distance [m] that trunk or a raised foot may be off what was written."""
SATURATED = 0.010
"""Time [s] for which a motor may give all it has."""
TOUCHED = 0.010
"""Time [s] for which links may touch each other, or the ground, that must not."""
THRESHOLD = 0.95
"""Least precision and recall."""
MOTIONS, NEAR = 160, 64
EXAMPLES = """
python -m benchmarks feasibility              eight minutes on two cores
python -m benchmarks feasibility --motions 40 --near 0
python -m benchmarks feasibility --json --out feasibility.json
"""
REFUSED = Metric("feasibility.refused", "verdict", "refused by the check", "", None)
FAILED = Metric("feasibility.failed", "physics", "went wrong in MuJoCo", "", None)
METRICS = (REFUSED, FAILED)


def register(subparsers: Subparsers) -> None:
    """Add the options of ``feasibility``."""
    parser = add_parser(
        subparsers,
        "feasibility",
        "Does the feasibility check foresee what physics does? Generated motions, good\n"
        "and broken ones, are checked and played in MuJoCo. Exit code 0 if precision\n"
        "and recall meet their thresholds, 1 if not.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "--motions", metavar="N", type=positive, default=MOTIONS, help="default %(default)s"
    )
    parser.add_argument(
        "--near",
        metavar="N",
        type=int,
        default=NEAR,
        help="motions close to a limit, without threshold; default %(default)s",
    )
    add_options(parser, has_jobs=True)


def run(args: argparse.Namespace) -> int:
    """Check and play the motions; report how often the check was right."""
    tasks = [(CLEAR_MOTIONS, seed) for seed in range(args.motions)]
    results = measure_all(args, [*tasks, *((NEAR_LIMITS, seed) for seed in range(args.near))])
    matrix = ConfusionMatrix.of(results.get(CLEAR_MOTIONS.name, {}), generated_motion)
    near = ConfusionMatrix.of(results.get(NEAR_LIMITS.name, {}), near_limit_motion)
    publish(args, {**matrix.as_dict(), "near_limits": near.as_dict()}, render(matrix, near))
    return ExitCode.OK if matrix.ok else ExitCode.FAILED


Make = Callable[[int], GeneratedMotion]
"""Generates the motion of a seed."""


def check_and_play(make: Make, trial: Trial) -> Measurement:
    """One motion; the reasons of the check and of physics are kept as the metrics' failures."""
    model = RobotModel()
    plan = make(trial.seed).plan(model)
    report = FeasibilityChecker(model).check(plan)
    plant = MujocoPlant(
        friction=FRICTION, mass_scale=trial.mass_scale, seed=trial.seed, initial_yaw=trial.yaw
    )
    with TrialRobot(plant) as robot:
        robot.require(robot.go2.stand())
        wrong = what_went_wrong(measure_motion(robot.go2, robot.truth, plan, model), plan)
    checks = dict.fromkeys(finding.check for finding in report.failures)
    values = {REFUSED.name: float(not report.ok), FAILED.name: float(bool(wrong))}
    reasons = {REFUSED.name: ", ".join(checks), FAILED.name: "; ".join(wrong)}
    return Measurement(values, {name: reason for name, reason in reasons.items() if reason})


CLEAR_MOTIONS = Scenario("feasibility", METRICS, partial(check_and_play, generated_motion))
NEAR_LIMITS = Scenario("near limits", METRICS, partial(check_and_play, near_limit_motion))


def what_went_wrong(run: MotionMeasurement, plan: MotionPlan) -> list[str]:
    """What went wrong while a motion was played, in words; empty if nothing did."""
    misses = [problem.miss for problem in getattr(plan, "problems", ())]
    missed = max((miss for miss in misses if miss > 0.0), default=0.0) - run.feet_off
    off = max(run.tracking, run.ends_off, run.feet_off, missed)
    found = {
        "fell": run.fall is not None,
        f"slipped {1000 * run.slip:.0f} mm": run.slip > SLIP,
        f"saturated for {1000 * run.saturated:.0f} ms": run.saturated > SATURATED,
        f"a joint {-run.joint_distance:.3f} rad beyond its limit": run.joint_distance < 0.0,
        f"a joint at {100 * run.speed:.0f} % of its speed": run.speed > 1.0,
        f"{100 * off:.0f} cm off what was written": off > OFF_PLAN,
        f"touched itself or the ground for {1000 * run.touched:.0f} ms": run.touched > TOUCHED,
    }
    return [what for what, is_so in found.items() if is_so]


@dataclass(frozen=True, slots=True)
class Case:
    """One motion: whether the check refused it, whether physics failed it, and why."""

    seed: int
    kind: str
    is_refused: bool
    has_failed: bool
    refusal: str
    harm: str


@dataclass(frozen=True, slots=True)
class ConfusionMatrix:
    """All motions, by what the check said and what physics did.

    Attributes:
        cases: motions with a result.
        lost: by seed, why a motion has none.
    """

    cases: tuple[Case, ...]
    lost: dict[int, str]

    @staticmethod
    def of(measured: dict[int, Measurement], make: Make) -> ConfusionMatrix:
        """The matrix of the measurements of the motions that ``make`` generates, by seed."""
        cases: list[Case] = []
        lost: dict[int, str] = {}
        for seed, one in sorted(measured.items()):
            if not one.values:
                lost[seed] = one.reason
                continue
            refused, failed = (one.values[metric.name] > 0.0 for metric in METRICS)
            reasons = (one.failures.get(metric.name, "") for metric in METRICS)
            cases.append(Case(seed, make(seed).kind, refused, failed, *reasons))
        return ConfusionMatrix(tuple(cases), lost)

    @property
    def counts(self) -> Counter[tuple[bool, bool]]:
        """Number of motions, by whether they were refused and whether they failed."""
        return Counter((case.is_refused, case.has_failed) for case in self.cases)

    @property
    def precision(self) -> float:
        """Share of the refused motions that really go wrong."""
        return self._share_of_right((True, False))

    @property
    def recall(self) -> float:
        """Share of the motions that go wrong that are refused."""
        return self._share_of_right((False, True))

    def _share_of_right(self, mistake: tuple[bool, bool]) -> float:
        right, wrong = self.counts[True, True], self.counts[mistake]
        return right / (right + wrong) if right + wrong else 1.0

    @property
    def ok(self) -> bool:
        """Whether both reach the threshold and no run was lost."""
        return not self.lost and min(self.precision, self.recall) >= THRESHOLD

    @property
    def wrong(self) -> list[Case]:
        """Motions on which the check and physics do not agree."""
        return [case for case in self.cases if case.is_refused is not case.has_failed]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        counts = self.counts
        return {
            "passed": self.ok,
            "precision": self.precision,
            "recall": self.recall,
            "threshold": THRESHOLD,
            "matrix": {
                "refused_failed": counts[True, True],
                "refused_done": counts[True, False],
                "accepted_failed": counts[False, True],
                "accepted_done": counts[False, False],
            },
            "cases": [asdict(case) for case in self.cases],
            "lost": {str(seed): reason for seed, reason in self.lost.items()},
        }


def render(clear: ConfusionMatrix, near: ConfusionMatrix) -> str:
    """Matrix, what came of each kind, and where the check was wrong; at most 80 columns wide."""
    lines = ["Clear motions, good and broken", *_tables(clear), ""]
    if near.cases:
        lines += ["Motions from easy to impossible, many close to a limit", *_tables(near), ""]
        shares = f"precision {near.precision:.3f}, recall {near.recall:.3f}"
        lines.append(f"{len(near.cases)} motions close to a limit: {shares}; no threshold.")
    lines.append(
        f"{len(clear.cases)} clear motions: precision {clear.precision:.3f}, recall "
        f"{clear.recall:.3f}; threshold {THRESHOLD}: {'ok' if clear.ok else 'NO'}."
    )
    return "\n".join(lines)


def _tables(matrix: ConfusionMatrix) -> list[str]:
    lines = [f"{'':<26}{'went wrong':>14}{'was done':>12}", "-" * 80]
    for what, refused in (("the check refuses it", True), ("the check lets it pass", False)):
        failed, done = matrix.counts[refused, True], matrix.counts[refused, False]
        lines.append(f"{what:<26}{failed:>14}{done:>12}")
    lines += ["-" * 80, f"{'kind':<16}{'n':>3}{'refused':>9}{'wrong':>7}  most often, in physics"]
    kinds = dict.fromkeys(case.kind for case in matrix.cases)
    lines += [_kind_line(kind, matrix) for kind in kinds]
    lines.append("-" * 80)
    for case in matrix.wrong:
        said = f"refused ({case.refusal})" if case.is_refused else "let pass"
        lines += [f"seed {case.seed}, {case.kind}: {said}; {case.harm or 'was done'}"[:80]]
    lines += [f"seed {seed}: no result, {reason}"[:80] for seed, reason in matrix.lost.items()]
    return lines


def _kind_line(kind: str, matrix: ConfusionMatrix) -> str:
    cases = [case for case in matrix.cases if case.kind == kind]
    refused, failed = sum(c.is_refused for c in cases), sum(c.has_failed for c in cases)
    parts = (part for case in cases for part in case.harm.split("; ") if part)
    harm = Counter(re.sub(r"[\d.]+", "...", part) for part in parts)
    common = harm.most_common(1)[0][0] if harm else ""
    return f"{kind:<16}{len(cases):>3}{refused:>9}{failed:>7}  {common}".rstrip()
