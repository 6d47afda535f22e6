"""A motion that is called off ends on four feet, wherever in it that happens."""

from __future__ import annotations

import numpy as np
import pytest

from controller.behaviours.plans import PlayPlan
from controller.behaviours.safe_return import SafeReturn, nearest_safe_instant, retimed
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline, load_motion
from motions.compiled_plan import CompiledPlan
from tests.controller.plants import WatchedPlant

TICK = 0.002
# s into the high five: lifting, tapping, lowering.
MOMENTS = (2.0, 5.4, 7.0)


@pytest.fixture(scope="module")
def plan() -> CompiledPlan:
    return compile_timeline(load_motion("high_five"), RobotModel())


@pytest.mark.slow
@pytest.mark.parametrize("moment", MOMENTS)
def test_a_high_five_that_is_cancelled_ends_standing(moment: float) -> None:
    plant = WatchedPlant()
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        start = go2.state.time
        plant.once_at(start + 0.9 + moment, go2.cancel)
        assert go2.high_five() is False
        assert "cancelled" in go2.last_outcome.reason
        assert go2.mode is Mode.STANDING
        assert go2.state.feet_in_contact.all()
        assert go2.state.time - start < 0.9 + moment + 6.0
        assert go2.telemetry.qp_failures == 0


def test_a_motion_that_is_cancelled_before_it_begins_is_not_played() -> None:
    plant = WatchedPlant()
    with GO2Controller(plant=plant) as go2:
        plant.once_at(1.0, go2.cancel)
        assert go2.high_five() is False
        assert "before it began" in go2.last_outcome.reason
        assert go2.mode is Mode.STANDING
        assert go2.progress == 0.0


def test_a_plan_that_has_not_begun_has_made_no_progress(plan: CompiledPlan) -> None:
    # It had no attribute to tell it by.
    playing = PlayPlan(plan)
    assert playing.progress == 0.0
    playing.return_safely()
    assert playing.progress == 0.0


def test_progress_grows_from_nothing_to_all_while_a_motion_plays() -> None:
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


def test_time_that_runs_backwards_negates_velocities_only(plan: CompiledPlan) -> None:
    forward = plan.at(2.0)
    backward = retimed(forward, -1.0, 0.0)
    assert (backward.v_joints == -forward.v_joints).all()
    assert (backward.a_joints == forward.a_joints).all()
    assert (backward.body.v_world == -forward.body.v_world).all()
    assert (backward.q_joints == forward.q_joints).all()
