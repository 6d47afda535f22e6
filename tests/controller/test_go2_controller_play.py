"""``play`` does nothing twice, tells how far a plan is from what was written, and may ask first."""

from dataclasses import replace
from importlib import import_module

import pytest

import motions
from benchmarks.validation_set.physics import play
from controller import GO2Controller
from controller.behaviours.standing import Standing
from go2_wbc.errors import DynamicMotionRefused, MotionInfeasible, StanceMismatch
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, FeasibilityChecker, Timeline, compile_timeline, load_motion
from tests.controller.plants import StillPlant
from tests.solver import needs_solver

AS_REPORTED = 0.010  #: Difference [m] between what is reported of the trunk and what is measured
STILL = 0.008
"""Distance [m] that a foot which stands may slide: less than the 10 mm that count as a slip."""


def test_a_checked_motion_is_played_or_refused_by_the_report_that_it_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    checker = FeasibilityChecker()
    good = checker.evaluate("nod")
    bad = checker.evaluate(Timeline().body(z=0.18, over=1.0).home(over=1.0))
    checking = import_module("motions.feasibility.check")  # the package has a function of its name
    for name in ("trajectory_of", "compile_timeline"):
        monkeypatch.setattr(checking, name, lambda *_: pytest.fail("done twice"))
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.play(good), go2.last_outcome.reason
        with pytest.raises(MotionInfeasible, match="way of a foot"):
            go2.play(bad)


@pytest.mark.slow
def test_a_high_five_takes_the_plan_of_a_caller_who_has_one(
    monkeypatch: pytest.MonkeyPatch, model: RobotModel
) -> None:
    plan = compile_timeline(load_motion("high_five", side="left", hold=0.5), model)
    monkeypatch.setattr(motions, "compile_timeline", lambda *_: pytest.fail("done twice"))
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.high_five("left", hold=0.5, plan=plan), go2.last_outcome.reason


@needs_solver
def test_play_tells_how_far_the_plan_is_from_what_was_written() -> None:
    line = Timeline(physics="nearest").hold(0.2).body(y=0.06, over=0.2).body(y=-0.06, over=0.2)
    checked = FeasibilityChecker().evaluate(line.home(over=0.4).hold(0.2))
    (departed,) = checked.report.departures
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.play(checked), go2.last_outcome.reason
        measured = dict(go2.last_outcome.measured)
        assert measured["plan off what was written [m]"] == pytest.approx(departed.place)
        assert measured["the same, at [s]"] == pytest.approx(departed.place_time)
        assert measured["plan late [s]"] == pytest.approx(departed.lag)
        assert go2.play(Timeline().body(z=-0.02, over=0.4).home(over=0.4))
        assert not any("written" in name for name in go2.last_outcome.measured)


PAIR, QUICK = Timeline(physics="nearest", shift_time=0.3), Timeline(physics="nearest")
PAIR = PAIR.hold(0.3).foot("FL", z=0.05, over=0.2).also().foot("RR", z=0.05, over=0.2).hold(0.1)
PAIR = PAIR.down("FL", over=0.2).also().down("RR", over=0.2).home(over=0.4).hold(0.3)
QUICK = QUICK.hold(0.2).body(y=0.045, yaw=0.3, over=0.16).body(x=-0.04, roll=0.2, over=0.16)
QUICK = QUICK.home(over=0.24).hold(0.2)


@needs_solver
@pytest.mark.parametrize("line", [PAIR, QUICK], ids=["diagonal pair", "quick trunk"])
def test_the_nearest_to_a_refused_motion_is_done_and_as_far_off_as_reported(
    line: Timeline, model: RobotModel
) -> None:
    checker = FeasibilityChecker(model)
    assert not checker.check(replace(line, physics="as_written")).ok
    checked = checker.evaluate(line)
    (departed,) = checked.report.departures
    run = play(checked.plan, model, seed=0)
    assert run.said, run.reason
    assert run.trunk_off == pytest.approx(departed.place, abs=AS_REPORTED)
    assert run.trunk_off > AS_REPORTED


@needs_solver
def test_feet_stand_still_on_the_floor_that_a_quick_sway_was_solved_for(model: RobotModel) -> None:
    """Its forces lie in the cone of that floor; shared evenly they do not, and feet slid 20 mm."""
    line = Timeline(physics="nearest").body(y=0.085, over=0.45).body(y=-0.085, over=0.45)
    plan = FeasibilityChecker(model).plan(line.home(over=0.4))
    run = play(plan, model, seed=0)
    assert run.said, run.reason
    assert run.slip < STILL


class LivePlant(StillPlant):
    """A user's own plant, of which nothing is known but that its time does not wait."""

    @property
    def is_live(self) -> bool:
        return True


@pytest.fixture(scope="module")
def two_feet(model: RobotModel) -> CompiledPlan:
    line = Timeline(balance=False).foot("FL", z=0.03, over=0.4).foot("RR", z=0.03, over=0.4)
    return compile_timeline(line.home(over=0.4), model)


def test_a_plant_that_may_be_a_robot_is_not_sent_a_dynamic_motion_and_what_simulates_is(
    two_feet: CompiledPlan,
) -> None:
    with GO2Controller(plant=LivePlant(), realtime=True) as go2:
        with pytest.raises(DynamicMotionRefused, match="LivePlant may move a robot") as caught:
            go2.play(two_feet, check=False)
        assert "play(..., allow_dynamic=True)" in str(caught.value)
        assert not go2.last_outcome
    plant = GroundTruth(MujocoPlant())
    assert not plant.is_hardware
    assert LivePlant().is_hardware
    assert not StillPlant().is_live
    assert not StillPlant().is_hardware
    plant.close()


@pytest.mark.parametrize("is_simulated", [False, True])
def test_who_allows_it_or_simulates_gets_as_far_as_with_any_other_motion(
    two_feet: CompiledPlan, model: RobotModel, *, is_simulated: bool
) -> None:
    plant = StillPlant() if is_simulated else LivePlant()
    with GO2Controller(plant=plant, realtime=not is_simulated) as go2:
        for plan in (two_feet, compile_timeline(load_motion("bow"), model)):
            is_allowed = plan is two_feet and not is_simulated
            with pytest.raises(StanceMismatch, match="the robot is lying"):
                go2.play(plan, check=False, allow_dynamic=is_allowed)


def test_a_motion_is_played_as_often_as_asked() -> None:
    dip = Timeline().body(z=-0.02, over=0.4).home(over=0.4)
    with GO2Controller() as go2:
        go2.stand()
        start = go2.state.time
        assert go2.play(dip, times=3), go2.last_outcome.reason
        assert go2.state.time - start >= 3 * 0.8
        assert go2.last_outcome.duration >= 3 * 0.8
        assert isinstance(go2._pilot._loop.behaviour, Standing), "it keeps its balance afterwards"
