"""``python -m benchmarks trust``: do motions fall that the check has passed in their world?

Motions of the exam, of all strata, and of the library are checked in random worlds, and played
where the check passes them, until so many have been played.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence

from benchmarks.command import add_sweep, positive, publish, run_sweep
from benchmarks.probability_runs import NOT_READY
from benchmarks.trust_runs import passed_play
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.sweeps.rows import Row
from controller.sweeps.summary import rate_interval

PLAYS = 2000
MOST_ASKED = 20
"""Worlds that are asked for at most, for each play that is wanted; the check passes half."""
EXAMPLES = """
python -m benchmarks trust                2,000 plays, about an hour, 2 cores
python -m benchmarks trust --plays 100
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``trust``."""
    parser = add_parser(
        subparsers,
        "trust",
        "Do motions fall that the check has passed? Motions of the exam and the library\n"
        "are checked in random worlds (friction 0.3 to 1, up to 4 kg) and played where\n"
        "they pass. Goes on where it was interrupted. Exit code 0 if none fell, else 1.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "--plays", metavar="N", type=positive, default=PLAYS, help="default %(default)s"
    )
    add_sweep(parser, jobs=2)


def run(args: argparse.Namespace) -> int:
    """Play what is not kept yet, count the falls."""
    result = run_sweep(
        args,
        passed_play,
        MOST_ASKED * args.plays,
        is_enough=lambda rows: len(_played(rows)) >= args.plays,
    )
    values = judged(result.rows, args.plays)
    values["lost"] = result.failures
    is_ok = values["passed"] = bool(values["passed"]) and not result.failures
    publish(args, values, render(result.rows, values))
    return ExitCode.OK if is_ok else ExitCode.FAILED


def _played(rows: Sequence[Row]) -> list[Row]:
    """Rows of motions that the check passed and that began."""
    return [row for row in rows if row["passed"] and row["harm"] != NOT_READY]


def judged(rows: Sequence[Row], wanted: int) -> dict[str, object]:
    """How many were played and fell, and whether that is the bar: all wanted, none fell."""
    played = _played(rows)
    fallen = [row for row in played if row["fell"]]
    return {
        "passed": len(played) >= wanted and not fallen,
        "asked": len(rows),
        "played": len(played),
        "done": sum(bool(row["done"]) for row in played),
        "fell": [row["seed"] for row in fallen],
        "not_ready": sum(row["harm"] == NOT_READY for row in rows),
    }


def render(rows: Sequence[Row], values: dict[str, object]) -> str:
    """Plays and falls by stratum, at most 80 columns wide."""
    lines = [f"{'motions':<14}{'asked':>8}{'played':>8}{'done':>8}{'fell':>8}", "-" * 80]
    played = _played(rows)
    for stratum, asked in sorted(Counter(str(row["stratum"]) for row in rows).items()):
        own = [row for row in played if row["stratum"] == stratum]
        done, fell = (sum(bool(row[name]) for row in own) for name in ("done", "fell"))
        lines.append(f"{stratum:<14}{asked:>8}{len(own):>8}{done:>8}{fell:>8}")
    lines.append("-" * 80)
    for row in played:
        if row["fell"]:
            where = f"friction {row['friction']:.2f}, {row['payload']:.1f} kg"
            lines.append(f"seed {row['seed']} fell: {row['motion']:.40}, {where}")
    fell = sum(bool(row["fell"]) for row in played)
    high = rate_interval(fell, max(len(played), 1))[1]
    lines.append(
        f"{fell} of {len(played)} fell, at most {100.0 * high:.2f} % (95 %, Clopper-Pearson); "
        f"bar 0: {'ok' if values['passed'] else 'NO'}"
    )
    return "\n".join(lines)
