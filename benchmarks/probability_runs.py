"""One motion of the exam in one random world: what the check says of it there, and what happens.

A function of a seed for ``controller.sweep``: seeds count the worlds of the first motion, then
those of the second, and so on.
"""

from __future__ import annotations

import json
from functools import lru_cache

import numpy as np

from benchmarks.exam.questions import IMPOSSIBLE, Question, questions
from benchmarks.exam.stored import read_borders
from controller.motion_measurement import measure_motion
from controller.motion_outcome import outcome_of
from controller.sweeps.trials import TrialFailed, TrialRobot
from go2_wbc.errors import Go2WbcError
from go2_wbc.plant.mujoco.worlds import plant_in_world
from go2_wbc.reference import MotionPlan, Posture
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions import FeasibilityChecker

WORLDS = 5
"""Worlds of each motion."""
FRICTION, PAYLOAD = (0.3, 1.0), (0.0, 4.0)
"""What the worlds are drawn from; half of them have no payload [kg]."""
PLACE = ((-0.08, 0.08), (-0.04, 0.04), (0.0, 0.10))
"""Where its middle may be [m], in the frame of the base."""
MASS_UNCERTAINTY, JOINT_FRICTION_UNCERTAINTY = 0.05, 0.5
"""What the check is not told."""
_STREAM = 12
NOT_READY = "not ready"
"""What went wrong with a robot that did not get as far as the motion."""


def trial(seed: int) -> dict[str, object]:
    """The row of a seed: motion, verdict, margins (JSON) and outcome by the strict definition."""
    question, plan = _asked(seed // WORLDS)
    world = world_of(seed)
    report = FeasibilityChecker(model(), world=world).check(plan)
    harm = played(plan, world, seed)
    return {
        "motion": question.name,
        "family": question.family.name,
        "half": question.family.half,
        "stratum": question.stratum,
        "friction": world.friction,
        "payload": world.payload,
        "refused": not report.ok,
        "done": not harm,
        "fell": "fell" in harm,
        "harm": "; ".join(harm),
        "margins": json.dumps({name: f.margin for name, f in report.margins.items()}),
    }


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
            robot.require(robot.go2.stand())
            if plan.entry is Posture.SIT:
                robot.require(robot.go2.sit())
        except (TrialFailed, Go2WbcError):
            return (NOT_READY,)
        measured = measure_motion(robot.go2, robot.truth, plan, model())
    return outcome_of(measured, plan).strict


@lru_cache(maxsize=1)
def model() -> RobotModel:
    """The robot, read once in each process."""
    return RobotModel()


@lru_cache(maxsize=2)
def _asked(number: int) -> tuple[Question, MotionPlan]:
    question = exam()[number]
    return question, question.plan(model())


@lru_cache(maxsize=1)
def exam() -> list[Question]:
    """The motions of the exam, shuffled, but for impossible ones that are to be solved.

    To see that one has no plan takes 20 s, and the chance of what has none is clear.
    """
    asked = questions(read_borders())
    found = [one for one in asked if not (one.family.is_dynamic and one.stratum == IMPOSSIBLE)]
    order = np.random.default_rng(_STREAM).permutation(len(found))
    return [found[place] for place in order]
