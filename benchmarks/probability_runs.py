"""One motion of the exam in one random world: what the check says of it there, and what happens.

A function of a seed for ``controller.sweep``: seeds count the worlds of the first motion, then
those of the second, and so on. Motions are in an order of which every beginning holds halves and
strata in the shares that they have of all, and families evenly. After them come random sentences of
the language, each in the world of the exam: a fit needs more than fifty structures.
"""

import json
from collections import Counter, defaultdict
from collections.abc import Sequence
from functools import lru_cache
from operator import itemgetter

import numpy as np

from benchmarks.robots import checker
from benchmarks.validation_set.drawing import TEST, TRAIN
from benchmarks.validation_set.physics import play, read_borders
from benchmarks.validation_set.questions import IMPOSSIBLE, Question, questions
from benchmarks.validation_set.random_timelines import RandomTimeline, random_timelines
from controller.motion_measurement import FELL, failures_of, measure_motion
from controller.sweeps.sweep_file import Row
from controller.sweeps.trials import TrialFailed, TrialRobot
from go2_wbc.errors import Go2WbcError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant import plant_in_world
from go2_wbc.world import World
from motions import FeasibilityChecker

DRAWN, SENTENCES = "drawn", 500  #: What random sentences are, besides the two halves, and how many
WORLDS = {TRAIN: 2, TEST: 5}
"""Worlds of each motion: a fit learns more from other motions than from other worlds."""
FRICTION, PAYLOAD = (0.3, 1.0), (0.0, 4.0)
"""What the worlds are drawn from; half of them have no payload [kg]."""
PLACE = ((-0.08, 0.08), (-0.04, 0.04), (0.0, 0.10))
"""Where its middle may be [m], in the frame of the base."""
MASS_UNCERTAINTY, JOINT_FRICTION_UNCERTAINTY = 0.05, 0.5  # What the check is not told
_STREAM = 12
NOT_READY = "not ready"  #: What went wrong with a robot that did not get as far as the motion


def trial(seed: int) -> dict[str, object]:
    """The row of a seed: motion, verdict, margins (JSON) and outcome by the strict definition."""
    model = checker().model
    if seed >= len(runs()):  # a sentence
        asked, judge = drawn()[seed - len(runs())], checker()
        family, half, stratum = f"sentence {asked.number}", DRAWN, DRAWN
        plan, world = judge.plan(asked.line, check=False), judge.world
        harm = failures_of(play(plan, model, asked.number), plan)
    else:
        asked, plan = _asked(runs()[seed])
        family, half, stratum = asked.family.name, asked.family.half, asked.stratum
        world = world_of(seed)
        judge, harm = FeasibilityChecker(model, world=world), played(plan, world, seed)
    report = judge.check(plan)
    return {
        "motion": asked.name,
        "family": family,
        "half": half,
        "stratum": stratum,
        "friction": world.friction,
        "payload": world.payload,
        "refused": not report.ok,
        "done": not harm,
        "fell": FELL in harm,
        "harm": "; ".join(harm),
        "margins": json.dumps({name: f.margin for name, f in report.margins.items()}),
    }


def motion_and_world(row: Row) -> str:
    """In words."""
    where = f"friction {row['friction']:.2f}, {row['payload']:.1f} kg"
    return f"{row['motion']:.40}, {where}"


def world_of(seed: int) -> World:
    """What is stated of the world of a seed."""
    rng = np.random.default_rng([_STREAM, seed])
    friction, load = rng.uniform(*FRICTION), rng.uniform(*PAYLOAD)
    x, y, z = (float(rng.uniform(*span)) for span in PLACE)
    return World(
        friction=float(friction),
        payload=float(load) if rng.random() < 0.5 else 0.0,
        payload_place=(x, y, z),
        mass_uncertainty=MASS_UNCERTAINTY,
        joint_friction_uncertainty=JOINT_FRICTION_UNCERTAINTY,
    )


def played(plan: MotionPlan, world: World, seed: int) -> tuple[str, ...]:
    """What went wrong, strictly, in a sample of ``world``; nothing if it was done."""
    with TrialRobot(plant_in_world(world, seed=seed)) as robot:
        try:
            robot.get_ready(plan.entry)
        except (TrialFailed, Go2WbcError):
            return (NOT_READY,)
        return failures_of(measure_motion(robot.go2, robot.truth, plan, checker().model), plan)


@lru_cache(maxsize=2)
def _asked(number: int) -> tuple[Question, MotionPlan]:
    question = exam()[number]
    return question, question.plan(checker().model)


@lru_cache(maxsize=1)
def exam() -> list[Question]:
    """The motions of the exam, mixed evenly, but for impossible ones that are to be solved.

    To see that one has no plan takes 20 s, and the chance of what has none is clear.
    """
    asked = questions(read_borders())
    return mixed([q for q in asked if not (q.family.is_dynamic and q.stratum == IMPOSSIBLE)])


@lru_cache(maxsize=2)
def runs(motions: int | None = None) -> list[int]:
    """The number of the exam's motion of every seed; of the first ``motions`` only, if given."""
    asked = exam()[:motions]
    return [number for number, one in enumerate(asked) for _ in range(WORLDS[one.family.half])]


def seeds(motions: int | None = None) -> int:
    """How many seeds there are; of the first ``motions`` of the exam only, if that is given."""
    return len(runs(motions)) + (len(drawn()) if motions is None else 0)


@lru_cache(maxsize=1)
def drawn() -> list[RandomTimeline]:
    """The random sentences, in the order of their seeds."""
    return random_timelines(SENTENCES)


def mixed(asked: Sequence[Question]) -> list[Question]:
    """All of them at random, every kind in equal steps; in each, no family twice before all once.

    A kind is half, stratum and whether it is solved. Of ``n`` of a kind, number ``k`` stands at
    ``(k + 1/2) / n`` of the whole.
    """
    order = np.random.default_rng(_STREAM).permutation(len(asked))
    kinds: dict[object, list[tuple[int, Question]]] = defaultdict(list)
    turns: Counter[object] = Counter()
    for one in (asked[place] for place in order):
        kind = (one.family.half, one.stratum, one.family.is_dynamic)
        kinds[kind].append((turns[kind, one.family.name], one))
        turns[kind, one.family.name] += 1
    placed = [
        ((k + 0.5) / len(found), one)
        for found in kinds.values()
        for k, (_, one) in enumerate(sorted(found, key=itemgetter(0)))
    ]
    return [one for _, one in sorted(placed, key=itemgetter(0))]
