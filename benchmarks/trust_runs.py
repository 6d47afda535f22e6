"""A motion that the check may pass, in a random world that the check is told: does it fall there?

A function of a seed for ``controller.sweep``. Motions are those of the exam, of all strata and both
halves, and every fourth one of the library; seeds count the worlds of the first motion, then those
of the second, and so on. Nothing may be tuned on these seeds: their motions and worlds judge.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from benchmarks.probability_runs import exam, model, played, world_of
from controller.motion_outcome import FELL
from go2_wbc.reference import MotionPlan, Posture
from motions import FeasibilityChecker, compile_motion, motion_names

WORLDS = 5
"""Worlds of each motion."""
FIRST_WORLD = 10_000_000
"""Added to seeds, so that the worlds are not those that probabilities are fitted or judged in."""
EVERY = 4
"""One motion of so many is of the library."""
LIBRARY = "library"
_STREAM = 13


def passed_play(seed: int) -> dict[str, object]:
    """The row of a seed: which motion and world, whether the check passes it, whether it fell.

    What the check refuses is not played.
    """
    name, stratum, plan = _asked(seed // WORLDS)
    world = world_of(FIRST_WORLD + seed)
    is_passed = FeasibilityChecker(model(), world=world).check(plan).ok
    harm = played(plan, world, FIRST_WORLD + seed) if is_passed else ()
    return {
        "motion": name,
        "stratum": stratum,
        "friction": world.friction,
        "payload": world.payload,
        "passed": is_passed,
        "done": is_passed and not harm,
        "fell": FELL in harm,
        "harm": "; ".join(harm),
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
    names = [
        name
        for name in motion_names()
        if compile_motion(name, model()).entry in (Posture.STAND, Posture.SIT)
    ]
    return [names[k] for k in np.random.default_rng(_STREAM).permutation(len(names))]


@lru_cache(maxsize=1)
def _order(count: int) -> list[int]:
    return np.random.default_rng(_STREAM).permutation(count).tolist()
