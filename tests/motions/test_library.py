"""The library is found by name, and every motion in it is feasible and well formed."""

import numpy as np
import pytest

from go2_wbc.errors import CommandError, TimelineError
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rpy_from_rotation
from motions import (
    CompiledPlan,
    FeasibilityChecker,
    Timeline,
    compile_timeline,
    find_motion,
    load_motion,
    motion_names,
)
from motions.authoring import Choice
from motions.language.keys import BODY_CHANNELS, BodyKey
from motions.plan.quasi_static import LEAST_RAMP
from tests.motions.plans import MODEL, library_plan

STEP = 1e-3  #: Time [s] beside a solved part that is left out


def test_there_are_motions_enough_and_each_says_what_it_is() -> None:
    names = motion_names()
    assert list(names) == sorted(set(names))
    assert len(names) >= 14
    for name in names:
        found = find_motion(name)
        assert found.name == name
        assert len(found.summary) > 10
        assert "motions/library/" in found.source


@pytest.mark.parametrize("name", ["", "High_Five", "levitate"])
def test_an_unknown_name_is_refused_with_the_valid_ones(name: str) -> None:
    with pytest.raises(CommandError, match=f"unknown motion '{name}'; valid: ") as caught:
        load_motion(name)
    assert all(valid in str(caught.value) for valid in motion_names())


def test_a_file_of_ones_own_is_to_be_imported() -> None:
    with pytest.raises(CommandError, match="from greet import NAME"):
        find_motion("moves/greet.py")


@pytest.mark.parametrize("name", motion_names())
def test_every_motion_of_the_library_is_feasible_on_both_sides(
    checker: FeasibilityChecker, name: str
) -> None:
    sides = [
        parameter.valid.words
        for parameter in find_motion(name).parameters
        if isinstance(parameter.valid, Choice)
    ]
    for side in sides[0] if sides else (None,):
        usual = side is None
        report = checker.check(library_plan(name) if usual else load_motion(name, side=side))
        assert report.ok, report.table()


@pytest.mark.parametrize("name", motion_names())
def test_every_motion_holds_its_ends(name: str) -> None:
    plan = library_plan(name)
    assert plan.duration > 0.0
    assert plan.problems == ()
    for inside, outside in ((0.0, -5.0), (plan.duration, plan.duration + 5.0)):
        here, there = plan.at(inside), plan.at(outside)
        assert np.allclose(here.body.p_world, there.body.p_world)
        assert np.allclose(here.q_joints, there.q_joints)
        assert not there.body.v_world.any()
        assert not there.v_joints.any()
        assert there.stance.all()


@pytest.mark.parametrize("name", motion_names())
def test_a_foot_is_unloaded_before_it_lifts_and_loaded_only_after_it_lands(name: str) -> None:
    plan = library_plan(name)
    times = np.arange(0.0, plan.duration, 0.005)
    references = [plan.at(float(t)) for t in times]
    loads = np.array([reference.normal_force_max for reference in references])
    stances = np.array([reference.stance for reference in references])
    assert not loads[~stances].any()
    change = np.abs(np.diff(loads, axis=0)).max(axis=1)
    written = np.array([not within_dynamic(plan, float(t)) for t in times[1:]])
    assert plan.ramp >= LEAST_RAMP
    assert change[written].max() < 1.01 * 0.005 / plan.ramp * loads.max()


@pytest.mark.parametrize(
    ("name", "turns"), [("bow_and_turn", 1), ("march", 2), ("patrol", 2), ("pirouette", 2)]
)
def test_an_about_turn_ends_along_the_line_on_which_it_began(name: str, turns: int) -> None:
    plan = library_plan(name)
    ahead = [plan.at(t).body.R_world_base[:2, 0] for t in (0.0, plan.duration)]
    np.testing.assert_allclose(ahead[1], (-1) ** turns * ahead[0], atol=1e-3)


def within_dynamic(plan: CompiledPlan, t: float) -> bool:
    return any(span.start - STEP <= t <= span.end + STEP for span in plan.dynamic)


def test_a_left_high_five_is_the_mirror_image_of_a_right_one(model: RobotModel) -> None:
    left, right = (
        compile_timeline(load_motion("high_five", side=side, hold=1.0), model)
        for side in ("left", "right")
    )
    assert left.duration == right.duration
    mirror = np.array([1.0, -1.0, 1.0])
    for t in np.linspace(0.0, left.duration, 25):
        a, b = left.at(float(t)), right.at(float(t))
        assert a.body.p_world == pytest.approx(mirror * b.body.p_world, abs=2e-3)
        paw_a, paw_b = a.q_joints[Leg.FL.joints], b.q_joints[Leg.FR.joints]
        assert paw_a == pytest.approx([-paw_b[0], *paw_b[1:]], abs=2e-2)
        assert a.stance.tolist() == b.stance[[1, 0, 3, 2]].tolist()


@pytest.mark.parametrize("hold", [0.5, 2.0, 7.0])
def test_the_paw_is_held_for_the_time_asked_for(model: RobotModel, hold: float) -> None:
    plan = compile_timeline(load_motion("high_five", hold=hold), model)
    start, end = plan.spans["held"]
    assert end - start == pytest.approx(hold)
    joints = [plan.at(float(t)).q_joints for t in np.linspace(start, end, 9)]
    assert np.ptp(joints, axis=0).max() < 1e-3  # rad; the spline swings a little about a hold
    assert (plan.entry, plan.exit) == (Posture.STAND, Posture.STAND)


def test_the_ends_of_a_range_are_within_it() -> None:
    for parameter in find_motion("high_five").parameters:
        if not isinstance(parameter.valid, Choice):
            assert parameter.check(parameter.valid.low) == parameter.valid.low
            assert parameter.check(parameter.valid.high) == parameter.valid.high


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"height": 0.9}, "height must be 0.25 to 0.66 m, got 0.9"),
        ({"side": "top"}, "unknown side 'top'; valid: left, right"),
        ({"speed": 1.0}, "high_five: unknown parameter 'speed'; valid: height, hold, reach, side"),
        ({"hold": float("nan")}, "hold must be 0.5 to 30 s, got nan"),
    ],
)
def test_a_parameter_out_of_range_is_refused_by_name(
    values: dict[str, float | str], message: str
) -> None:
    with pytest.raises(TimelineError, match=message):
        load_motion("high_five", **values)


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_trunk_comes_back_through_the_poses_by_which_it_went(side: str) -> None:
    keys = load_motion("high_five", side=side).in_order(BodyKey)
    for channel in BODY_CHANNELS:
        goals = [0.0, *(key.value for key in keys if key.channel == channel)]
        assert goals == goals[::-1], channel


@pytest.mark.parametrize(("side", "leg"), [("right", Leg.FR), ("left", Leg.FL)])
def test_it_counts_as_done_only_if_the_paw_is_held_at_its_height(side: str, leg: Leg) -> None:
    plan = compile_timeline(load_motion("high_five", side=side, height=0.6), MODEL)
    (held,) = plan.held_feet
    assert (held.name, held.leg) == ("held", leg)
    assert held.height == pytest.approx(0.6, abs=1e-6)
    assert (held.start, held.end) == plan.spans["held"]
    assert held.end - held.start == pytest.approx(2.0)
    for t in (held.start, held.end):
        assert not plan.at(t).stance[leg]


def test_a_foot_on_the_ground_is_not_held_up() -> None:
    with pytest.raises(TimelineError, match="foot FL must be raised"):
        Timeline().foot("FR", z=0.05, over=0.5).hold(0.5, name="held", foot="FL")


def test_it_looks_up_to_the_left_then_up_to_the_right_then_down() -> None:
    plan = compile_timeline(load_motion("look_around"), RobotModel())
    looks = [rpy_from_rotation(plan.at(t).body.R_world_base) for t in (1.15, 2.95, 4.4)]
    (_, up_left, left), (_, up_right, right), (_, down, ahead) = looks
    assert left > 0.2
    assert right < -0.2
    assert abs(ahead) < 1e-6
    assert max(up_left, up_right) < -0.15
    assert down > 0.2
