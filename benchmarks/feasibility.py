"""Does the feasibility check foresee what physics does? Motions by the dozen, checked and played.

Each seed gives one motion. It is checked, then played on the whole-body controller in MuJoCo,
whatever the check said, on the least friction that the check counts on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from benchmarks.generated_motions import GeneratedMotion, generated_motion, near_specimen
from benchmarks.motion_runs import MotionRun, run_motion
from benchmarks.rows import Family, Measurement, Row
from benchmarks.runner import Results
from benchmarks.trials import Subject, Trial
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, FeasibilityReport
from motions.compiler import OutOfReach

FRICTION = 0.5
"""Friction coefficient of the floor: the least of the bench's conditions."""
SLIP = 0.010
"""Distance [m] that a standing foot may slide."""
OFF_PLAN = 0.05
"""Distance [m] that trunk or a raised foot may be off what was written."""
SATURATED = 0.010
"""Time [s] for which a motor may give all it has."""
TOUCHED = 0.010
"""Time [s] for which links may touch each other, or the ground, that must not."""
BAR = 0.95
"""Least precision and recall."""

_REFUSED = Row("feasibility.refused", "verdict", "refused by the check", "", None)
_FAILED = Row("feasibility.failed", "physics", "went wrong in MuJoCo", "", None)


def measure(trial: Trial) -> Measurement:
    """Check and play one clear motion, good or broken."""
    return _judged(generated_motion(trial.seed), trial)


def measure_near(trial: Trial) -> Measurement:
    """Check and play one motion that may be close to a limit."""
    return _judged(near_specimen(trial.seed), trial)


def _judged(made: GeneratedMotion, trial: Trial) -> Measurement:
    """The reasons of the check and of physics are kept as the rows' failures."""
    model = RobotModel()
    plan = made.plan(model)
    report = FeasibilityChecker(model).check(plan)
    plant = MujocoPlant(
        friction=FRICTION, mass_scale=trial.mass_scale, seed=trial.seed, initial_yaw=trial.yaw
    )
    with Subject(plant) as robot:
        robot.require(robot.go2.stand())
        harm = harms(run_motion(robot, plan, model), plan)
    values = {_REFUSED.name: float(not report.ok), _FAILED.name: float(bool(harm))}
    reasons = {_REFUSED.name: _refusal(report), _FAILED.name: "; ".join(harm)}
    return Measurement(values, {name: reason for name, reason in reasons.items() if reason})


FAMILY = Family("feasibility", (_REFUSED, _FAILED), measure)
NEAR_FAMILY = Family("near limits", (_REFUSED, _FAILED), measure_near)


def harms(run: MotionRun, plan: MotionPlan) -> list[str]:
    """What went wrong while a motion was played, in words; empty if nothing did."""
    unreached = [p for p in getattr(plan, "problems", ()) if isinstance(p, OutOfReach)]
    missed = max((p.miss for p in unreached), default=0.0) - run.feet_off
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


def _refusal(report: FeasibilityReport) -> str:
    checks = dict.fromkeys(finding.check for finding in report.failures)
    return ", ".join(checks)


@dataclass(frozen=True, slots=True)
class Case:
    """One motion: what the check said, and what came of it.

    Attributes:
        seed: which motion.
        kind: of what making.
        is_refused: by the check.
        has_failed: in physics.
        refusal, harm: why, in words.
    """

    seed: int
    kind: str
    is_refused: bool
    has_failed: bool
    refusal: str
    harm: str

    @property
    def is_right(self) -> bool:
        """Whether the check said what came to pass."""
        return self.is_refused is self.has_failed


@dataclass(frozen=True, slots=True)
class Verdicts:
    """All motions, as a confusion matrix."""

    cases: tuple[Case, ...]
    lost: dict[int, str]

    def count(self, *, is_refused: bool, has_failed: bool) -> int:
        """How many motions were so judged and so ended."""
        pairs = [(case.is_refused, case.has_failed) for case in self.cases]
        return pairs.count((is_refused, has_failed))

    @property
    def precision(self) -> float:
        """Share of the refused motions that really go wrong."""
        right = self.count(is_refused=True, has_failed=True)
        return _share(right, right + self.count(is_refused=True, has_failed=False))

    @property
    def recall(self) -> float:
        """Share of the motions that go wrong that are refused."""
        right = self.count(is_refused=True, has_failed=True)
        return _share(right, right + self.count(is_refused=False, has_failed=True))

    @property
    def ok(self) -> bool:
        """Whether both reach the bar and no run was lost."""
        return not self.lost and min(self.precision, self.recall) >= BAR

    @property
    def misses(self) -> list[Case]:
        """Motions on which the check and physics do not agree."""
        return [case for case in self.cases if not case.is_right]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "passed": self.ok,
            "precision": self.precision,
            "recall": self.recall,
            "bar": BAR,
            "matrix": {
                f"{verdict}_{outcome}": self.count(is_refused=refused, has_failed=failed)
                for verdict, refused in (("refused", True), ("accepted", False))
                for outcome, failed in (("failed", True), ("done", False))
            },
            "cases": [
                {name: getattr(case, name) for name in Case.__slots__} for case in self.cases
            ],
            "lost": {str(seed): reason for seed, reason in self.lost.items()},
        }


def verdicts_of(results: Results, family: Family = FAMILY) -> Verdicts:
    """The matrix of what ``run_families`` measured of a family."""
    make = near_specimen if family.name == NEAR_FAMILY.name else generated_motion
    cases, lost = [], {}
    for seed, measured in sorted(results[family.name].items()):
        if not measured.values:
            lost[seed] = measured.reason
            continue
        cases.append(
            Case(
                seed,
                make(seed).kind,
                bool(measured.values[_REFUSED.name]),
                bool(measured.values[_FAILED.name]),
                measured.failures.get(_REFUSED.name, ""),
                measured.failures.get(_FAILED.name, ""),
            )
        )
    return Verdicts(tuple(cases), lost)


def render(verdicts: Verdicts, near: Verdicts) -> str:
    """Matrix, what came of each kind, and the misses; at most 80 columns wide."""
    lines = ["Clear motions, good and broken", *_tables(verdicts), ""]
    if near.cases:
        lines += ["Motions from easy to impossible, many close to a limit", *_tables(near), ""]
        shares = f"precision {near.precision:.3f}, recall {near.recall:.3f}"
        lines.append(f"{len(near.cases)} motions close to a limit: {shares}; no bar.")
    lines.append(
        f"{len(verdicts.cases)} clear motions: precision {verdicts.precision:.3f}, recall "
        f"{verdicts.recall:.3f}; the bar is {BAR} for both: {'ok' if verdicts.ok else 'NO'}."
    )
    return "\n".join(lines)


def _tables(verdicts: Verdicts) -> list[str]:
    lines = [f"{'':<26}{'went wrong':>14}{'was done':>12}", "-" * 80]
    for what, refused in (("the check refuses it", True), ("the check lets it pass", False)):
        counts = [verdicts.count(is_refused=refused, has_failed=failed) for failed in (True, False)]
        lines.append(f"{what:<26}{counts[0]:>14}{counts[1]:>12}")
    lines += ["-" * 80, f"{'kind':<16}{'n':>3}{'refused':>9}{'wrong':>7}  most often, in physics"]
    kinds = dict.fromkeys(case.kind for case in verdicts.cases)
    lines += [_kind_line(kind, verdicts) for kind in kinds]
    lines.append("-" * 80)
    for case in verdicts.misses:
        said = f"refused ({case.refusal})" if case.is_refused else "let pass"
        lines += [f"seed {case.seed}, {case.kind}: {said}; {case.harm or 'was done'}"[:80]]
    lines += [f"seed {seed}: no result, {reason}"[:80] for seed, reason in verdicts.lost.items()]
    return lines


def _kind_line(kind: str, verdicts: Verdicts) -> str:
    cases = [case for case in verdicts.cases if case.kind == kind]
    refused, failed = sum(c.is_refused for c in cases), sum(c.has_failed for c in cases)
    harm = [_without_numbers(part) for case in cases for part in case.harm.split("; ") if part]
    common = max(dict.fromkeys(harm), key=harm.count) if harm else ""
    return f"{kind:<16}{len(cases):>3}{refused:>9}{failed:>7}  {common}".rstrip()


def _without_numbers(text: str) -> str:
    return " ".join("..." if word.replace(".", "").isdigit() else word for word in text.split())


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 1.0
