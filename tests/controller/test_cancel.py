"""A motion that is called off ends on four feet, wherever in it that happens."""

from dataclasses import replace

import numpy as np
import pytest

import motions
from controller import arguments
from controller.behaviours.plans import PlayPlan, SafeReturn, nearest_safe_instant, retimed
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.contacts import ContactSchedule
from go2_wbc.errors import ModeError
from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline, load_motion
from motions.plan.compiled_plan import CompiledPlan
from tests.controller.plants import WatchedPlant
from tests.stepping_plans import LANDING, LIFT_OFF, TAKE_OFF, TOUCHDOWN, hop_plan, step_plan

TICK = 0.002
MOMENTS = (2.0, 5.4, 7.0)  # s into the high five: lifting, tapping, lowering


@pytest.fixture(scope="module")
def plan() -> CompiledPlan:
    return compile_timeline(load_motion("high_five"), RobotModel())


@pytest.mark.slow
@pytest.mark.parametrize("moment", MOMENTS)
def test_a_high_five_that_is_cancelled_ends_standing(
    plant: WatchedPlant, go2: GO2Controller, moment: float
) -> None:
    assert go2.stand()
    start = go2.state.time
    plant.once_at(start + 0.9 + moment, go2.cancel)
    assert go2.high_five() is False
    assert "cancelled" in go2.last_outcome.reason
    assert go2.mode is Mode.STANDING
    assert go2.state.feet_in_contact.all()
    assert go2.state.time - start < 0.9 + moment + 6.0
    assert go2.telemetry.qp_failures == 0


def test_a_motion_that_is_cancelled_before_it_begins_is_not_played(
    plant: WatchedPlant, go2: GO2Controller
) -> None:
    plant.once_at(1.0, go2.cancel)
    assert go2.high_five() is False
    assert "before it began" in go2.last_outcome.reason
    assert "_checker" not in vars(go2), "it ships checked: nothing of the check is loaded for it"
    assert go2.mode is Mode.STANDING
    assert go2.progress == 0.0


@pytest.mark.parametrize("act", ["cancel", "damp"])
@pytest.mark.parametrize("call", ["high_five", "play"])
def test_who_cancels_or_damps_while_a_motion_is_planned_is_obeyed(
    go2: GO2Controller, monkeypatch: pytest.MonkeyPatch, call: str, act: str
) -> None:
    # Both were forgotten when the call began: it stood up, and played for 31 s.
    assert go2.stand()

    def planned(*_: object, **__: object) -> CompiledPlan:
        getattr(go2, act)()  # as another thread may, meanwhile
        return compile_timeline(load_motion("high_five"), RobotModel())

    monkeypatch.setattr(motions, "compile_timeline", planned)
    monkeypatch.setattr(GO2Controller, "prepare", planned)
    before = go2.state.time
    assert (go2.high_five() if call == "high_five" else go2.play("high_five")) is False
    assert ("cancelled" if act == "cancel" else "damp()") in go2.last_outcome.reason
    assert go2.mode is (Mode.STANDING if act == "cancel" else Mode.DAMPED)
    assert go2.state.time < before + 2.0
    assert go2.stand(), "what was pressed is over"


def test_who_damps_while_a_policy_is_loaded_is_obeyed(
    go2: GO2Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(arguments, "policy", lambda *_: go2.damp())
    assert not go2.walk(policy="any.onnx")
    assert go2.mode is Mode.DAMPED


@pytest.mark.parametrize("moment", [0.5, 2.3])
@pytest.mark.parametrize("call", ["turn_left", "move_forward"])
def test_a_goal_is_ended_by_stop_before_the_robot_walks(
    plant: WatchedPlant, go2: GO2Controller, call: str, moment: float
) -> None:
    plant.once_at(moment, go2.stop)
    assert getattr(go2, call)(1.5) is False
    assert "ended by stop()" in go2.last_outcome.reason
    assert go2.mode is Mode.WALKING
    assert np.hypot(*go2.state.q[:2]) < 0.1


def test_an_error_of_ours_in_what_runs_after_a_tick_leaves_the_robot_limp(
    plant: WatchedPlant,
) -> None:
    # It stayed as it was, in the middle of standing up, and said that it was moving.
    acts = iter([lambda: go2.move(0.3)])

    def after_tick() -> None:
        if plant.inner.time > 0.6:
            next(acts, lambda: None)()

    with GO2Controller(plant=plant, after_tick=after_tick) as go2:
        with pytest.raises(ModeError, match="needs walking mode"):
            go2.stand()
        assert go2.mode is Mode.DAMPED
        assert go2.stand()


def test_progress_grows_from_nothing_to_all_once_a_motion_has_begun(plan: CompiledPlan) -> None:
    # It had no attribute to tell it by.
    playing = PlayPlan(plan)
    assert playing.progress == 0.0
    playing.return_safely()
    assert playing.progress == 0.0
    plant, seen = WatchedPlant(), []
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        plant.on_write = lambda: seen.append(go2.progress)
        assert go2.play("nod")
    assert max(seen) == pytest.approx(1.0, abs=0.01)
    played = [share for share in seen if share > 0.0]
    assert played == sorted(played)


def test_the_safe_instant_has_four_fully_loaded_feet_and_is_the_nearer_one(
    plan: CompiledPlan,
) -> None:
    early, late = nearest_safe_instant(plan, 2.0), nearest_safe_instant(plan, 7.3)
    assert early is not None
    assert late is not None
    assert early < 2.0
    assert late > 7.3
    for t in (early, late):
        reference = plan.at(t)
        assert reference.stance.all()
        assert reference.normal_force_max.min() == reference.normal_force_max.max()


def test_the_way_back_is_smooth_and_its_rates_are_the_derivatives(plan: CompiledPlan) -> None:
    way_back = SafeReturn(plan, 3.0)
    steps = [way_back.advance(TICK) for _ in range(2500)]
    assert way_back.is_over
    q = np.array([step.q_joints for step in steps])
    v = np.array([step.v_joints for step in steps])
    a = np.array([step.a_joints for step in steps])
    step = TICK * np.abs(a).max()
    assert np.abs(v).max() > 10 * step
    assert np.abs(np.diff(q, axis=0) / TICK - (v[1:] + v[:-1]) / 2).max() < step
    assert np.abs(np.diff(v, axis=0)).max() < 2 * step
    assert not steps[-1].v_joints.any()


@pytest.mark.parametrize(("rate", "change"), [(0.4, 0.0), (0.7, -1.0), (-0.5, 2.0)])
def test_rates_are_those_of_a_clock_that_runs_otherwise(
    plan: CompiledPlan, rate: float, change: float
) -> None:
    """By differences: d/dt p(s) = rate p', d2/dt2 p(s) = rate^2 p'' + change p'."""
    t, h = 0.233, 1e-3
    found = retimed(plan.at(t), rate, change)
    before, now, after = (plan.at(t + rate * d + 0.5 * change * d**2) for d in (-h, 0.0, h))
    for rates, accelerations, values in (
        (found.v_joints, found.a_joints, [one.q_joints for one in (before, now, after)]),
        (found.body.v_world, found.body.a_world, [x.body.p_world for x in (before, now, after)]),
    ):
        first, middle, last = values
        assert rates == pytest.approx((last - first) / (2.0 * h), rel=1e-3, abs=1e-4)
        expected = (last - 2.0 * middle + first) / h**2
        assert accelerations == pytest.approx(expected, rel=2e-2, abs=1e-3)
        assert np.abs(expected).max() > 0.02


def test_time_that_runs_backwards_negates_velocities_only_and_forces_do_not_hold(
    plan: CompiledPlan,
) -> None:
    forward = replace(plan.at(2.0), force_weight=0.01)
    backward = retimed(forward, -1.0, 0.0)
    assert (backward.v_joints == -forward.v_joints).all()
    assert (backward.a_joints == forward.a_joints).all()
    assert (backward.body.v_world == -forward.body.v_world).all()
    assert (backward.q_joints == forward.q_joints).all()
    assert backward.force_weight == 0.0, "they were planned for another tempo"


def test_a_flight_that_has_begun_is_not_slowed_down_and_ends_on_four_feet() -> None:
    plan = hop_plan(RobotModel(), 0.1, 3)
    for moment in (TAKE_OFF - 0.1, TAKE_OFF + 0.01, LANDING - 0.01):
        way_back, last = SafeReturn(plan, moment), moment
        assert LANDING < way_back.target < LANDING + 0.5
        while not way_back.is_over:
            reference = way_back.advance(TICK)
            if way_back.t < LANDING:
                assert way_back.t == pytest.approx(last + TICK), "at its own tempo"
                assert (reference.row == plan.row_at(way_back.t)).all()
            assert way_back.t < LANDING + 0.5
            last = way_back.t
        assert plan.at(way_back.t).stance.all()
        assert not way_back.advance(TICK).body.v_world.any()


def test_a_crouch_before_a_flight_is_left_at_once() -> None:
    plan = hop_plan(RobotModel(), 0.1)
    way_back = SafeReturn(plan, 0.1)
    assert way_back.target < TAKE_OFF - 0.1
    while not way_back.is_over:
        way_back.advance(TICK)
        assert way_back.t < TAKE_OFF - 0.1


def test_a_foot_that_steps_goes_on_to_its_new_place() -> None:
    plan = step_plan(RobotModel(), Leg.FR, 0.05)
    way_back = SafeReturn(plan, LIFT_OFF + 0.05)
    assert way_back.target > TOUCHDOWN
    while not way_back.is_over:
        before = way_back.t
        way_back.advance(TICK)
        assert way_back.t >= before or way_back.t > TOUCHDOWN, "not back to where it stood"


def test_a_gait_that_never_stands_for_long_is_left_on_four_feet() -> None:
    hop = hop_plan(RobotModel(), 0.1, 6)
    times = np.arange(0.0, 4.0, 0.1)
    modes = np.ones((len(times), 4), dtype=bool)
    modes[1:-1:2, 1:3] = False
    plan = replace(hop, contacts=ContactSchedule(tuple(times.tolist()), modes), swings=~modes)
    way_back = SafeReturn(plan, 0.55)
    assert way_back.target == pytest.approx(0.6)
    while not way_back.is_over:
        way_back.advance(TICK)
    assert 0.6 <= way_back.t < 0.6 + 2 * TICK
