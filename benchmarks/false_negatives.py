"""``python -m benchmarks false_negatives``: do motions fall that the check has passed?

Motions of the exam, of all strata and both halves, and every fourth one of the library are checked
in random worlds, and played where the check passes them, until so many have been played. Seeds
count the worlds of the first motion, then those of the second, and so on. Nothing may be tuned on
them: their motions and worlds judge.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from benchmarks.command import add_sweep, positive, publish, run_sweep
from benchmarks.probability_runs import NOT_READY, exam, model, motion_and_world, played, world_of
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.motion_failures import FELL
from controller.sweeps.rows import Row
from controller.sweeps.summary import rate_interval
from go2_wbc.motion_plan import MotionPlan, Posture
from motions import FeasibilityChecker, compile_motion, load_motion, motion_names

PLAYS = 2000
MOST_ASKED = 20
"""Worlds that are asked for at most, for each play that is wanted; the check passes half."""
WORLDS = 5  # Worlds of each motion
FIRST_WORLD = 10_000_000
"""Added to seeds, so that the worlds are not those that probabilities are fitted or judged in."""
EVERY = 4  # One motion of so many is of the library
LIBRARY = "library"
_STREAM = 13
EXAMPLES = """
python -m benchmarks false_negatives      2,000 plays, an hour, 2 cores
python -m benchmarks false_negatives --plays 100
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``false_negatives``."""
    parser = add_parser(
        subparsers,
        "false_negatives",
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
        is_enough=lambda rows: len(_plays(rows)) >= args.plays,
    )
    values = judged(result.rows, args.plays)
    values["lost"] = result.failures
    is_ok = values["passed"] = bool(values["passed"]) and not result.failures
    publish(args, values, render(result.rows, values))
    return ExitCode.OK if is_ok else ExitCode.FAILED


def _plays(rows: Sequence[Row]) -> list[Row]:
    """Rows of motions that the check passed and that began."""
    return [row for row in rows if row["passed"] and row["harm"] != NOT_READY]


def judged(rows: Sequence[Row], wanted: int) -> dict[str, object]:
    """How many were played and fell, and whether that is the bar: all wanted, none fell."""
    played = _plays(rows)
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
    played = _plays(rows)
    for stratum, asked in sorted(Counter(str(row["stratum"]) for row in rows).items()):
        own = [row for row in played if row["stratum"] == stratum]
        done, fell = (sum(bool(row[name]) for row in own) for name in ("done", "fell"))
        lines.append(f"{stratum:<14}{asked:>8}{len(own):>8}{done:>8}{fell:>8}")
    fallen = [f"seed {row['seed']} fell: {motion_and_world(row)}" for row in played if row["fell"]]
    high = rate_interval(len(fallen), max(len(played), 1))[1]
    verdict = (
        f"{len(fallen)} of {len(played)} fell, at most {100.0 * high:.2f} % "
        f"(95 %, Clopper-Pearson); bar 0: {'ok' if values['passed'] else 'NO'}"
    )
    return "\n".join([*lines, "-" * 80, *fallen, verdict])


def passed_play(seed: int) -> dict[str, object]:
    """The row of a seed: which motion and world, whether the check passes it, whether it fell.

    What the check refuses is not played.
    """
    name, stratum, plan = _asked(seed // WORLDS)
    world = world_of(FIRST_WORLD + seed)
    is_passed = FeasibilityChecker(model(), world=world).check(plan).ok
    harm = played(plan, world, FIRST_WORLD + seed) if is_passed else ()
    return {
        **{"motion": name, "stratum": stratum},
        **{"friction": world.friction, "payload": world.payload, "passed": is_passed},
        **{"done": is_passed and not harm, "fell": FELL in harm, "harm": "; ".join(harm)},
    }


@lru_cache(maxsize=2)
def _asked(number: int) -> tuple[str, str, MotionPlan]:
    """Name, stratum and plan of a motion; whoever asks for more than there are begins anew."""
    turn, place = divmod(number, EVERY)
    if place == EVERY - 1:
        names = _library()
        name = names[turn % len(names)]
        return name, LIBRARY, compile_motion(name, model())
    asked = exam()
    question = asked[_order(len(asked))[(turn * (EVERY - 1) + place) % len(asked)]]
    return question.name, question.stratum, question.plan(model())


@lru_cache(maxsize=1)
def _library() -> list[str]:
    """The motions of the library that begin on four feet or sitting, shuffled."""
    begins = {name: load_motion(name).entry for name in motion_names()}
    names = [name for name, entry in begins.items() if entry in (Posture.STAND, Posture.SIT)]
    return [names[k] for k in _order(len(names))]


@lru_cache(maxsize=2)
def _order(count: int) -> list[int]:
    return np.random.default_rng(_STREAM).permutation(count).tolist()
