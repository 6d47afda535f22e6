"""``certify``: how often a motion is done in randomised simulated runs, with its interval.

The interval of the rate is that of Clopper and Pearson (Biometrika, 1934): it contains the true
rate with at least the stated confidence, whatever the rate is. If runs may end early, they end at
the first number of runs, in the order of their seeds, at which the interval is as narrow as asked:
so the result depends on the seeds only. An interval that is tested repeatedly has a little less
than the stated confidence; for the exact confidence, do all runs.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from controller.sweeps.run import Progress, SweepResult, read_sweep, sweep
from controller.sweeps.summary import CONFIDENCE, finite, rate_interval
from controller.sweeps.sweep_file import SEED, Row
from controller.sweeps.targets import digest, identity, motion_target
from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import CommandError
from go2_wbc.world import World

if TYPE_CHECKING:
    from go2_wbc.motion_plan import MotionPlan
    from viz.content import CertifiedRate, ReplayContent

RUNS = 200
WORST = 5  #: How many of the worst runs are named
FEWEST = 20  #: Runs before which nothing ends early
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_HOLDS_FOR = ("version", "code", "plan", "libraries", "python")
"""What a page names of a certificate's ``about``, besides its world."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """How often a motion was done.

    Attributes:
        motion, n, done: its name, runs that were looked at, and in which it was done.
        interval: of 95 % of the true rate.
        worst: the worst runs, the worst first: their rows in ``path``.
        about: what the certificate holds for: versions, and digests of code and plan.
        path: the file with all rows; each can be replayed.
        why: why runs failed, in words: the commonest reason; empty if none did.
    """

    motion: str
    n: int
    done: int
    interval: tuple[float, float]
    worst: tuple[Row, ...]
    about: Mapping[str, str]
    path: Path
    why: str = ""

    __repr__ = brief

    @property
    def rate(self) -> float:
        """Share of the runs in which it was done."""
        return self.done / self.n

    def meets(self, least: float) -> bool:
        """Whether the rate is at least ``least``, with 95 % confidence."""
        return self.interval[0] >= least

    def table(self) -> str:
        """Rate, interval, the worst runs and what it holds for, at most 80 columns wide."""
        from controller.sweeps.motion_study import world_of  # imports the robot

        low, high = (100.0 * bound for bound in self.interval)
        lines = [
            f"{self.motion:.50}: done in {self.done} of {self.n} runs, {100.0 * self.rate:.1f} %",
            f"95 % interval of the rate: {low:.1f} to {high:.1f} %",
            *([f"{self.why:.80}"] if self.why else []),
            "",
            f"{'seed':>6}  {'friction':>8} {'mass':>6}  worst runs",
            "-" * 80,
        ]
        for row in self.worst:
            world = f"{row['friction']:>8.2f} {row['mass_scale']:>6.2f}"
            lines.append(f"{row[SEED]:>6}  {world}  {told(row):.54}")
        lines.append("-" * 80)
        about = {**self.about, "world": str(world_of(self.about["world"]))}
        lines += [line for item in about.items() for line in wrap(": ".join(item), 80)]
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON; what was not measured is None."""
        return {
            "motion": self.motion,
            "n": self.n,
            "done": self.done,
            "rate": self.rate,
            "interval": list(self.interval),
            "confidence": CONFIDENCE,
            "why": self.why,
            "worst": [{name: finite(value) for name, value in row.items()} for row in self.worst],
            "about": dict(self.about),
            "file": str(self.path),
        }


@typed(error=CommandError)
def certify(
    motion: object,
    n: int = RUNS,
    *,
    world: World | None = None,
    width: float | None = None,
    first_seed: int = 0,
    workers: int | None = None,
    engine: str = "local",
    address: str | None = None,
    out: Path | str | None = None,
    fresh: bool = False,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> Certificate:
    """Play ``motion`` in ``n`` random worlds, unchecked, and count how often it is done.

    Runs that are kept in ``out`` and depend on the same code, libraries and plan are not repeated.

    Args:
        motion: as ``GO2Controller.play`` takes it.
        n: runs; each has its own heading and start.
        world: where; each run is in a sample of it. By default ``DOUBTFUL``: a
            slippery floor, and what is usually not known of floor and robot.
        width: ends early once the interval of the rate is no wider, 0 to 1; None: all runs.
        first_seed, workers, engine, address, out, fresh, on_progress: see ``sweep``.

    Raises:
        CommandError: for an argument that is not valid, or what stands for no motion.
        SweepError: if a run breaks off, or the disk refuses. What is finished is kept.
    """
    if width is not None and not (isinstance(width, int | float) and 0.0 < width <= 1.0):
        raise CommandError(f"width must be a share between 0 and 1, got {width!r}")
    target = motion_target(motion, world=world)
    result = sweep(
        target,
        n,
        first_seed=first_seed,
        workers=workers,
        engine=engine,
        address=address,
        out=out,
        fresh=fresh,
        is_enough=None if width is None else _narrow(width),
        on_progress=on_progress,
    )
    return _certificate(result)


def read_certificate(path: Path | str) -> Certificate:
    """The certificate of all rows that the file of ``certify``, or a motion's sweep, holds.

    Raises:
        ConfigError: if there is no such file, or it is something else.
        CommandError: if its rows are not those of a motion, or there are none.
    """
    result = read_sweep(path)
    if result.about.get("kind") != "motion":
        raise CommandError(f"{path} is a sweep of {result.name}: only motions are certified")
    if not result.rows:
        raise CommandError(f"{path} has no finished run yet: `go2-wbc certify` makes them")
    return _certificate(result)


def _certificate(result: SweepResult) -> Certificate:
    rows = result.rows
    done = sum(bool(row["done"]) for row in rows)
    return Certificate(
        motion=result.name,
        n=len(rows),
        done=done,
        interval=rate_interval(done, len(rows)),
        worst=tuple(sorted(rows, key=_goodness)[:WORST]),
        about=result.about,
        path=result.path,
        why=_why(rows),
    )


def _why(rows: Sequence[Row]) -> str:
    """The commonest reason of runs that failed, in how many of them, and where it was worst."""
    failed = [str(row["harm"]).split("; ") for row in rows if not row["done"]]
    kinds = Counter(_NUMBER.sub("", one) for harms in failed for one in harms)
    if not kinds:
        return ""
    (kind, count), *_ = kinds.most_common(1)
    same = [one for harms in failed for one in harms if _NUMBER.sub("", one) == kind]
    worst = max(same, key=lambda one: [float(number) for number in _NUMBER.findall(one)])
    share = "" if count == len(failed) else f", {count} of them"
    return f"{len(failed)} of {len(rows)} runs failed{share}: {worst}"


def _narrow(width: float) -> Callable[[Sequence[Row]], bool]:
    def is_enough(rows: Sequence[Row]) -> bool:
        if len(rows) < FEWEST:
            return False
        low, high = rate_interval(sum(bool(row["done"]) for row in rows), len(rows))
        return high - low <= width

    return is_enough


def _goodness(row: Row) -> tuple[bool, bool, float]:
    """Failed runs first, falls before others, then whatever is nearest to what is allowed."""
    share = float(row["closest_share"])
    return bool(row["done"]), not row["fall"], -share if math.isfinite(share) else 0.0


def told(row: Row) -> str:
    """What went wrong in a run, or what came nearest to it."""
    if not row["done"]:
        return str(row["harm"])
    return (
        f"done; closest: {row['closest']}, {100.0 * float(row['closest_share']):.0f} % of allowed"
    )


# --- on a page ------------------------------------------------------------------------------------


def with_certificate(
    content: ReplayContent, certificate: Certificate, plan: MotionPlan
) -> ReplayContent:
    """``content``, whose verdict is on ``plan``, with the certificate beside that verdict."""
    if content.verdict is None:
        return content
    certified = certified_rate(certificate, plan)
    return replace(content, verdict=replace(content.verdict, certified=certified))


def certified_rate(certificate: Certificate, plan: MotionPlan) -> CertifiedRate:
    """A certificate as ``viz`` takes it, and why it does not hold for ``plan`` as it is now."""
    from controller.sweeps.motion_study import world_of
    from viz.content import CertifiedRate, CertifiedRun

    def run(row: Row) -> CertifiedRun:
        conditions = f"friction {row['friction']:.2f}, mass {row['mass_scale']:.2f}"
        return CertifiedRun(int(row[SEED]), conditions, bool(row["done"]), told(row))

    about = certificate.about
    return CertifiedRate(
        n=certificate.n,
        done=certificate.done,
        interval=certificate.interval,
        confidence=CONFIDENCE,
        world=str(world_of(about["world"])),
        worst=tuple(map(run, certificate.worst)),
        versions={name: about[name] for name in _HOLDS_FOR if name in about},
        outdated=_outdated(about, plan),
        why=certificate.why,
    )


def _outdated(about: Mapping[str, str], plan: MotionPlan) -> str:
    """What has changed since the runs; empty if nothing has."""
    from controller.sweeps.motion_study import archive_of
    from motions import CompiledPlan

    own = digest(archive_of(plan)) if isinstance(plan, CompiledPlan) else ""
    now = {"plan": own, **identity()}
    other = [name for name in now if now[name] != about.get(name)]
    return f"Of another {', '.join(other)} than this: certify it again." if other else ""
