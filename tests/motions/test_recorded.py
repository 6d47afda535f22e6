"""Motions of every kind, right and wrong, are compiled and judged as they were when recorded."""

from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from go2_wbc.errors import Go2WbcError
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions import (
    CompiledPlan,
    FeasibilityChecker,
    Timeline,
    load_motion,
    load_plan,
    motion_names,
    suggest,
)
from motions.feasibility.check import CheckedMotion
from motions.plan.compiled_plan import placed
from tests.held.make import PLANS, STORED, timeline
from tests.motions.mutations import MUTATORS
from tests.recorded import assert_as_recorded

FILE = Path(__file__).with_name("recorded.json")
HARD = World(0.35, 0.2, 3.0, (0.05, -0.03, 0.1), 1.1, 0.1, 1.5, 0.3)
LONGEST = 8.0  #: [s] of a motion of the library that is compared: checking takes its time
DRAWN_FROM = [
    "beckon",
    "bow",
    "cross_step",
    "curtsy",
    "figure_eight",
    "hula",
    "knock",
    "lift_leg",
    "look_around",
    "moonwalk",
    "nod",
    "nose_circle",
    "point",
    "push_ups",
    "salute",
    "shake_head",
    "shake_paw",
    "sneeze",
    "sniff",
    "stamp",
    "stretch",
    "tilt_head",
    "twist",
    "wave",
    "wiggle",
    "wiggle_hips",
]
"""Motions that are changed at random: what is drawn does not change when the library grows."""
SUGGESTED = "together tilt_head"
INSTANTS = 23  #: at which a plan is looked at
ARRANGED = {
    "mirror": lambda line: line.mirror(),
    "scale": lambda line: line.scale(1.7),
    "slower": lambda line: line.scale_time(1.4),
    "shifts": lambda line: line.scale_shifts(0.6),
    "repeat": lambda line: line.repeat(2),
    "then": lambda line: line.then(Timeline().body(yaw=0.1, over=0.5).home(over=0.5)),
    "together": lambda line: line.together(Timeline().body(z=-0.02, over=0.4).home(over=0.3)),
    "loop": lambda line: line.loop(line.end + 3.0),
    "reverse": lambda line: line.reverse(),
}


def written() -> Iterator[tuple[str, Timeline]]:
    """Every call of the language with values of its own."""
    line = Timeline(name="calls", shift_time=0.7, balance=True)
    yield "trunk", line.body(x=0.02, y=-0.01, z=0.015, roll=0.1, pitch=-0.07, over=0.9, ease="in")
    yield "pose", line.pose("bow", over=0.8).hold(0.3, name="low").home(over=0.9)
    points = [{"x": 0.01, "roll": 0.05}, {"x": -0.02, "roll": 0.1}, {"x": 0.0, "roll": 0.0}]
    yield "body path", line.body_path(points, over=1.5, times=[0.4, 0.9, 1.5])
    yield "look", line.look_at(0.6, 0.4, 0.1, over=0.7).look_at(1.0, -0.3, 0.6, over=0.9)
    up = line.foot("FR", x=0.08, y=-0.03, z=0.12, over=0.6)
    yield "foot", up.foot("FR", x=0.1, z=0.15, frame="body", over=0.5).down("FR", over=0.4)
    yield (
        "joints",
        up.leg("FR", hip=-0.1, thigh=0.6, calf=-1.4, over=0.5)
        .joint("FR", "thigh", 0.3, over=0.3)
        .home(over=0.8),
    )
    yield (
        "joints hind",
        line.unweight("RL", over=0.9)
        .leg("RL", hip=0.15, thigh=1.2, calf=-2.0, over=0.4)
        .hold(0.25, name="up", foot="RL")
        .down("RL", over=0.5, ease="in")
        .home(over=0.5),
    )
    yield "also", line.body(pitch=0.1, over=0.6).also().foot("FL", z=0.1, over=0.8).home(over=1.0)
    yield "two feet", line.foot("FL", z=0.05, over=0.4).foot("RR", z=0.05, over=0.4)
    yield (
        "steps",
        line.step("FL", 0.06, 0.02, over=0.5, height=0.07)
        .step("RR", -0.03, -0.02, yaw=0.1, over=0.6)
        .home(over=0.7),
    )
    yield "walk", line.walk(0.3, 0.05, 0.4).body(z=-0.02, over=0.4)
    yield (
        "walk long",
        line.walk(0.4, over=5.0, gait="trot").turn(-0.8, gait="trot").side_step(-0.12),
    )
    yield "trot by beat", line.bpm(96.0, shift_time=2.0).walk(x=0.2, gait="trot").home(over=2)
    yield "path", line.path([(0.2, 0.05), (0.4, -0.1), (0.5, 0.2)], gait="trot")
    yield "path turned", line.path([(0.15, 0.0, 0.5), (0.1, 0.2, 1.0)], 6.0, gait="trot")
    yield "heights", line.foot("FL", z=0.12, over=0.5).home(over=0.6).shift_height(-0.03)
    beats = line.on_beats([0.5, 1.1, 1.6, 2.4], shift_time=1.0)
    yield "beats", beats.body(roll=0.08, over=1).body(roll=-0.08, over=1).home(over=2)
    yield "sit", line.posture("sit", over=1.2).body(pitch=0.1, over=0.5).posture("stand", over=1.3)
    yield "lie", replace(line, exit=timeline().exit).posture("lie", over=0.9).hold(0.2)
    yield "unbalanced", replace(up, balance=False).home(over=0.5)


def motions() -> dict[str, Timeline]:
    """Of the library, arranged, with faults, and written here; none that has to be solved."""
    rng, found = np.random.default_rng(7), dict[str, Timeline]()
    library = {name: load_motion(name) for name in motion_names()}
    library = {name: line for name, line in library.items() if not line.is_dynamic}
    library = {name: line for name, line in library.items() if line.end < LONGEST}
    found |= {f"library {name}": line for name, line in library.items()}
    found |= {f"calls {name}": line for name, line in written()}
    for what, change in [*ARRANGED.items(), *ARRANGED.items()]:
        name = str(rng.choice(DRAWN_FROM))
        found[f"{what} {name}"] = change(library[name])
    for what, mutate in MUTATORS.items():
        for name in rng.permutation(DRAWN_FROM)[:12]:
            try:
                found[f"{what}: {name}"] = mutate(library[str(name)], rng)
            except Go2WbcError:
                continue
    return found


MOTIONS = motions()


@pytest.fixture(scope="module")
def hard(model: RobotModel) -> FeasibilityChecker:
    """For a world in which less can be done."""
    return FeasibilityChecker(model, world=HARD)


def told_of(checked: CheckedMotion) -> dict[str, Any]:
    """The plan, the report, and each of its series."""
    plan, report = checked.plan, checked.report
    assert isinstance(plan, CompiledPlan)
    times = np.linspace(0.0, plan.duration, INSTANTS)
    found: dict[str, Any] = {
        "curves": [plan.curves(times, order) for order in range(3)],
        "stance": [plan.contacts.at(float(t)).stance for t in times],
        "ends": [plan.duration, *(report.end_pose or ())],
        "report": f"{report.table()}\n{report.summary()}\n{report!r}",
        "findings": "\n".join(map(str, [*report.failures, *report.warnings])),
    }
    for one in report.series:
        found[one.check] = [one.values, one.limits, one.margins]
    return found


@pytest.mark.parametrize("name", MOTIONS)
def test_a_motion_is_compiled_and_judged_as_recorded(
    name: str, checker: FeasibilityChecker, hard: FeasibilityChecker
) -> None:
    judge = checker if name.startswith("library") else hard
    assert_as_recorded(FILE, name, told_of(judge.evaluate(MOTIONS[name])))


@pytest.mark.parametrize("kind", PLANS)
@pytest.mark.parametrize("world", [World(), HARD], ids=["usual", "hard"])
def test_a_stored_plan_is_judged_and_shown_as_recorded(
    kind: str, world: World, model: RobotModel
) -> None:
    checked = FeasibilityChecker(model, world=world).evaluate(load_plan(STORED / f"{kind}.plan"))
    recording = checked.recording()
    arrays = {name: getattr(recording, name) for name in ("q", "tau", "stance", "support_margin")}
    forces = {f"forces {f.name}": getattr(checked.forces, f.name) for f in fields(checked.forces)}
    plan = checked.plan
    assert isinstance(plan, CompiledPlan)
    for index, span in enumerate(plan.dynamic):
        moved = placed(span.trajectory, Anchor(np.array([0.4, -0.3, 0.05]), 0.7))
        for name in ("q", "v", "forces", "gains", "p_feet"):
            arrays[f"placed {index} {name}"] = getattr(moved, name)
    case = f"stored {kind}, {'usual' if world == World() else 'hard'}"
    assert_as_recorded(FILE, case, {**told_of(checked), **arrays, **forces})


def test_changes_are_suggested_as_recorded(hard: FeasibilityChecker) -> None:
    told = map(str, suggest(MOTIONS[SUGGESTED], checker=hard))
    assert_as_recorded(FILE, "suggested", {SUGGESTED: "\n".join(told)})
