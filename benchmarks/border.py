"""``python -m benchmarks border``: verdict and chance on motions of another generator.

Motions are those of the adversary's families, which no limit and no fit has seen: each as it is
drawn, and two beside the size at which physics changes its mind, which is bisected by playing. The
border is where a verdict is hard, and where a search leads.
"""

import json
import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from benchmarks.adversary import FIRST, outcome
from benchmarks.adversary_motions import COUNT, FAMILIES, Numbers
from benchmarks.command import FOLDER, Jobs, Output, RowsFile, positive, run_sweep
from benchmarks.probability_fit import Bins, calibration
from benchmarks.robots import checker
from benchmarks.validation_set.physics import bisected
from controller.sweeps.sweep_file import Row
from controller.sweeps.trials import TrialFailed
from go2_wbc.errors import MotionError
from go2_wbc.motion_plan import MotionPlan

MOTIONS = 120
RANDOM, BESIDE = "random", "border"
SMALLEST, LARGEST, STEP, NEAR = 0.15, 2.5, 1.5, 1.1
"""Sizes between which a border is looked for, ratio of those that are tried, and at the end."""
BELOW, ABOVE = (0.8, 0.95), (1.05, 1.25)  #: Sizes of the two motions beside a border, over its own
ERROR = "calibration error"
BARS = {ERROR: 0.05, "random": 0.95, "border": 0.85, "refused": 0.7}
"""Greatest error; least shares of passes that are done, and of refusals at the border that fail."""
NAMES = {
    RANDOM: "random motions that pass are done",
    BESIDE: "border motions that pass are done",
    "refused": "border motions that are refused go wrong",
    ERROR: "expected calibration error, all",
}


def run(
    *,
    motions: Annotated[int, "N", "default %(default)s", positive] = MOTIONS,
    first: Annotated[int, "SEED", "default %(default)s"] = FIRST,
    rows: RowsFile = FOLDER / "border.sqlite",
    jobs: Jobs = 2,
    output: Output,
) -> int:
    """Verdict and chance on motions of another generator than the exam's.

    As they are drawn, and beside the size at which physics changes its mind. Goes on where it was
    interrupted. Exit code 0 if every bar is met, else 1.

    Examples:
    python -m benchmarks border             120 motions: 20 minutes, 2 cores
    python -m benchmarks border --motions 12
    python -m benchmarks border --first 0   seeds to mend the check by
    """
    result = run_sweep(asked, motions, rows, jobs, first)
    shares, bins = measured(result.rows)
    is_ok = are_met(shares) and not result.failures
    values = {"passed": is_ok, "shares": shares, "bins": bins, "lost": result.failures}
    return output.publish(values, render(shares, bins))


def asked(seed: int) -> dict[str, object]:
    """The row of a seed: what was said of its motions, and what became of them (JSON)."""
    rng = np.random.default_rng([seed, 7])
    family, numbers = list(FAMILIES)[seed % len(FAMILIES)], rng.random(COUNT).tolist()
    sizes = [(RANDOM, 1.0)]
    if (size := border_of(family, numbers)) is not None:
        sizes += [(BESIDE, size * rng.uniform(*share)) for share in (BELOW, ABOVE)]
    found: list[tuple[str, bool, float, bool]] = []  # kind, passed, chance, done
    for kind, factor in sizes:
        if (plan := _plan(family, numbers, factor)) is None:
            found.append((kind, False, 0.0, False))
        else:
            report = checker().check(plan)
            found.append((kind, report.ok, report.probability, not outcome(plan)[0]))
    return {"family": family, "border": size or 0.0, "motions": json.dumps(found)}


def border_of(family: str, numbers: Sequence[float]) -> float | None:
    """The size at which physics changes its mind, if there is one; the check is not asked."""

    def is_done(size: float) -> bool:
        plan = _plan(family, numbers, size)
        return plan is not None and not outcome(plan)[0]

    try:
        return bisected(is_done, SMALLEST, LARGEST, STEP, NEAR)
    except TrialFailed:
        return None


def _plan(family: str, numbers: Sequence[float], size: float) -> MotionPlan | None:
    """The plan of a motion; none if it cannot be written."""
    try:
        return checker().plan(FAMILIES[family](Numbers(numbers, size)), check=False)
    except MotionError:
        return None


Shares = dict[str, tuple[float, int]]
"""By the names of ``BARS``: what was measured, and of how many motions."""


def measured(rows: Sequence[Row]) -> tuple[Shares, Bins]:
    """Every share, and the bins of the calibration."""
    said = [(str(row["seed"]), *one) for row in rows for one in json.loads(str(row["motions"]))]
    seeds, kinds, passed, chances, done = (np.array(column) for column in zip(*said, strict=True))
    found = {kind: done[(kinds == kind) & passed] for kind in (RANDOM, BESIDE)}
    found["refused"] = ~done[(kinds == BESIDE) & ~passed]
    shares = {k: (float(v.mean()) if len(v) else math.nan, len(v)) for k, v in found.items()}
    error = calibration(chances, done, seeds.tolist())
    return {**shares, ERROR: (error.error, len(said))}, error.bins


def are_met(shares: Shares) -> bool:
    """Whether all bars are."""
    return all(x <= BARS[k] if k == ERROR else x >= BARS[k] for k, (x, _) in shares.items())


def render(shares: Shares, bins: Bins) -> str:
    """The shares and the reliability, at most 80 columns wide."""
    lines = [f"{'':<44}{'share':>8}{'bar':>7}{'n':>7}", "-" * 80]
    lines += [f"{NAMES[k]:<44}{x:>8.3f}{BARS[k]:>7.2f}{n:>7}" for k, (x, n) in shares.items()]
    lines += [f"stated {chance:.2f}, done {share:.2f} of {count}" for chance, share, count in bins]
    return "\n".join([*lines, "-" * 80, "every bar met: " + ("ok" if are_met(shares) else "NO")])
