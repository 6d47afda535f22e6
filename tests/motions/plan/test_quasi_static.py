"""What compiling costs: the robot is loaded once, and the work grows as the motion does.

Work is counted, not timed: samples evaluated, poses solved, robots loaded.
"""

from collections import Counter
from collections.abc import Callable
from importlib import import_module

import numpy as np
import pytest

from go2_wbc.curves import Ease
from go2_wbc.robot import inverse_kinematics
from go2_wbc.robot.model import RobotModel
from motions import (
    CheckedMotion,
    CompiledPlan,
    FeasibilityChecker,
    Timeline,
    compile_motion,
    compile_timeline,
    find_motion,
    load_motion,
)
from motions.feasibility import bodies, tracking
from motions.language.keys import Mark
from motions.plan import balance, tracks

CHECK = import_module("motions.feasibility.check")  # the package has a function of that name
SPARE = 1.25
"""What the work may grow beyond the motion: a track costs nothing until its first key, which is a
larger part of a short motion. Work that grows with the square would be at 5 and 10."""


def long_motion(seconds: float) -> Timeline:
    """Trunk, feet and balance in turn, over and over for about that long."""
    unit = Timeline().body(pitch=0.1, z=-0.02, over=0.5).body(roll=0.05, over=0.5)
    for foot in ("FR", "FL"):
        unit = unit.foot(foot, z=0.06, over=0.5).down(foot, over=0.5)
    unit = unit.home(over=1.0)
    return unit.repeat(round(seconds / unit.end))


def counted(
    monkeypatch: pytest.MonkeyPatch,
    counts: Counter[str],
    module: object,
    name: str,
    size: Callable[..., int],
) -> None:
    """Add ``size(*arguments)`` to ``counts[name]`` whenever ``module.name`` is called."""
    function = getattr(module, name)

    def call(*arguments: object) -> object:
        counts[name] += size(*arguments)
        return function(*arguments)

    monkeypatch.setattr(module, name, call)


def test_the_robot_is_loaded_once_for_all_poses_of_a_model(monkeypatch: pytest.MonkeyPatch) -> None:
    counts: Counter[str] = Counter()
    counted(monkeypatch, counts, inverse_kinematics, "load_placo_robot", lambda *_: 1)
    counted(monkeypatch, counts, balance, "solve_pose", lambda *_: 1)
    model, other = RobotModel(), RobotModel()
    for name in ("high_five", "wave", "lift_leg"):
        compile_timeline(load_motion(name), model)
    assert counts["solve_pose"] > 20
    assert counts["load_placo_robot"] == 1
    compile_timeline(load_motion("lift_leg"), other)
    assert counts["load_placo_robot"] == 2  # another model, perhaps of another thread


def test_a_pose_does_not_depend_on_what_was_solved_before() -> None:
    model, fresh = RobotModel(), RobotModel()
    for name in ("high_five", "wave", "high_five"):
        used = compile_timeline(load_motion(name), model)
    np.testing.assert_array_equal(
        used.curves.c, compile_timeline(load_motion("high_five"), fresh).curves.c
    )


def test_a_model_that_is_gone_takes_its_placo_robot_with_it() -> None:
    model = RobotModel()
    compile_timeline(load_motion("lift_leg"), model)
    kept = len(inverse_kinematics._ROBOTS)
    del model
    assert len(inverse_kinematics._ROBOTS) == kept - 1


def test_the_work_of_compiling_grows_as_the_motion_does(
    monkeypatch: pytest.MonkeyPatch, checker: FeasibilityChecker
) -> None:
    work: dict[int, Counter[str]] = {}
    durations: dict[int, float] = {}
    for seconds in (10, 60, 120):
        counts = work[seconds] = Counter()
        with monkeypatch.context() as patch:
            counted(patch, counts, tracks, "leg_angles", lambda _, places: len(places))
            counted(patch, counts, tracks, "eased", lambda *arguments: len(arguments[-1]))
            counted(patch, counts, balance, "solve_pose", lambda *_: 1)
            line = long_motion(seconds)
            plan = compile_timeline(line, checker.model)
        durations[seconds] = plan.duration
        assert plan.problems == ()
    assert work[10]["solve_pose"] > 5
    for seconds in (60, 120):
        growth = durations[seconds] / durations[10]
        for what in ("leg_angles", "eased", "solve_pose"):
            assert work[seconds][what] <= SPARE * growth * work[10][what], (seconds, what)


def test_the_work_of_checking_grows_as_the_motion_does(
    monkeypatch: pytest.MonkeyPatch, checker: FeasibilityChecker
) -> None:
    work: dict[int, Counter[str]] = {}
    samples: dict[int, int] = {}
    for seconds in (10, 40):
        plan = compile_timeline(long_motion(seconds), checker.model)
        counts = work[seconds] = Counter()
        with monkeypatch.context() as patch:
            counted(patch, counts, CompiledPlan, "at", lambda *_: 1)
            counted(patch, counts, checker.model, "inverse_dynamics", lambda *_: 1)
            counted(patch, counts, checker.model, "snapshot", lambda *_: 1)
            counted(patch, counts, checker.model, "center_of_mass", lambda *_: 1)
            counted(patch, counts, bodies.pin, "computeDistance", lambda *_: 1)
            samples[seconds] = len(checker.evaluate(plan).path.times)
        assert counts["inverse_dynamics"] == samples[seconds]
        # Nothing else is asked for one instant after the other; the moments of inertia twice, and
        # the inertia by which friction delays the trunk now and then.
        assert counts["at"] == counts["center_of_mass"] == 0
        assert counts["snapshot"] <= samples[seconds] / tracking.EVERY + 4
    growth = samples[40] / samples[10]
    assert work[40]["computeDistance"] <= SPARE * growth * work[10]["computeDistance"]


def test_moves_in_turn_lead_from_goal_to_goal() -> None:
    times = np.linspace(0.0, 4.0, 401)
    moves = [
        (Mark(1.0, 2.0, Ease.LINEAR, "there"), np.array([1.0, -2.0])),
        (Mark(2.5, 3.0, Ease.LINEAR, "on"), np.array([0.0, 4.0])),
    ]
    path = tracks.followed(times, np.array([0.0, 1.0]), moves)
    for t, expected in ((0.5, (0, 1)), (1.5, (0.5, -0.5)), (2.2, (1, -2)), (2.75, (0.5, 1))):
        assert path[round(100 * t)] == pytest.approx(expected)
    assert path[-1] == pytest.approx((0.0, 4.0))
    assert (tracks.followed(times, np.array([7.0]), []) == 7.0).all()


@pytest.mark.parametrize(
    "stands_for",
    [
        lambda _: "nod",
        lambda _: find_motion("nod"),
        lambda _: load_motion("nod"),
        lambda model: compile_timeline(load_motion("nod"), model),
    ],
)
def test_whatever_stands_for_a_motion_is_compiled_to_the_same_plan(
    checker: FeasibilityChecker, stands_for: Callable[[RobotModel], object]
) -> None:
    motion = stands_for(checker.model)
    plan = compile_motion(motion, checker.model)
    assert plan.name == "nod"
    assert plan.duration == load_motion("nod").end
    assert compile_motion(plan, checker.model) is plan


def test_a_checked_motion_is_neither_compiled_nor_checked_again(
    monkeypatch: pytest.MonkeyPatch, checker: FeasibilityChecker
) -> None:
    counts: Counter[str] = Counter()
    counted(monkeypatch, counts, CHECK, "trajectory_of", lambda *_: 1)
    checked = checker.evaluate("nod")
    assert isinstance(checked, CheckedMotion)
    assert checker.evaluate(checked) is checked
    assert checker.check(checked) is checked.report
    assert checker.plan(checked) is checked.plan
    assert compile_motion(checked, checker.model) is checked.plan
    assert counts["trajectory_of"] == 1
    checker.plan(checked.plan, check=False)
    assert counts["trajectory_of"] == 1
    checker.plan(checked.plan)
    assert counts["trajectory_of"] == 2
