"""Motions whose feet step, or leave the ground, in MuJoCo: done, or told that they were not."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.legs import Leg
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from motions.plan.compiled_plan import CompiledPlan
from tests.controller.plants import WatchedPlant
from tests.stepping_plans import LANDING, TAKE_OFF, hop_plan, step_plan

MODEL = RobotModel()
STEP_ERROR = 0.015  #: What is asked of a step [m]
FORWARD = 0.1  #: Of the hop [m]


def standing() -> tuple[WatchedPlant, GO2Controller]:
    plant = WatchedPlant(MujocoPlant())
    go2 = GO2Controller(plant=plant)
    assert go2.stand()
    return plant, go2


def play(go2: GO2Controller, plan: CompiledPlan) -> bool:
    return go2.play(plan, check=False)


def when_playing(
    plant: WatchedPlant, go2: GO2Controller, t: float, action: Callable[[], None]
) -> None:
    """Does ``action`` once the plan has been played for ``t`` seconds."""
    since: list[float] = []

    def watch() -> None:
        if go2.progress > 0.0:
            since.append(plant.inner.time)
        if since and plant.inner.time - since[0] >= t - 1e-9:
            plant.on_write = lambda: None
            action()

    plant.on_write = watch


@pytest.mark.parametrize("leg", [Leg.FR, Leg.RL])
def test_a_foot_steps_to_a_new_place_and_the_robot_says_where_it_stands(leg: Leg) -> None:
    _, go2 = standing()
    with go2:
        before = go2.state.p_world_base.copy()
        assert play(go2, step_plan(MODEL, leg, 0.05)), go2.last_outcome
        measured = go2.last_outcome.measured
        assert measured["missed landings"] == 0.0
        assert measured["end place error [m]"] < STEP_ERROR
        moved = np.linalg.norm(go2.state.p_world_base - before)
        assert 0.005 < moved < 0.03, "a quarter of the step"


def test_a_hop_lands_where_it_should_and_hops_again() -> None:
    plant, go2 = standing()
    flown = []
    plant.on_write = lambda: flown.append(not go2.state.feet_in_contact.any())
    with go2:
        start = go2.state.p_world_base[:2].copy()
        assert play(go2, hop_plan(MODEL, FORWARD, 2)), go2.last_outcome
        assert np.linalg.norm(go2.state.p_world_base[:2] - start) == pytest.approx(0.2, abs=0.05)
        assert go2.last_outcome.measured["end heading error [rad]"] < 0.05
    assert sum(flown) * plant.control_period > 0.25, "it was in the air twice"


@pytest.mark.parametrize("moment", [TAKE_OFF - 0.05, TAKE_OFF + 0.05, LANDING - 0.02])
def test_a_hop_that_is_cancelled_lands_first_and_then_stands(moment: float) -> None:
    plant, go2 = standing()
    with go2:
        when_playing(plant, go2, moment, go2.cancel)
        start = go2.state.time
        assert play(go2, hop_plan(MODEL, FORWARD, 3)) is False
        assert "cancelled" in go2.last_outcome.reason
        assert go2.mode is Mode.STANDING
        assert go2.state.feet_in_contact.all()
        assert go2.state.time - start < 6.0, "and does not hop on"


def test_a_motion_that_ends_elsewhere_was_not_done() -> None:
    _, go2 = standing()
    with go2:
        plan = step_plan(MODEL, Leg.FR, 0.05)
        away = plan.curves.c.copy()
        away[3, -1, 18:] += 0.3  # the end, which is only held, is said to be far away
        curves = type(plan.curves)(away, plan.curves.x)
        assert play(go2, replace(plan, curves=curves)) is False
        assert "ended elsewhere" in go2.last_outcome.reason
        assert go2.last_outcome.measured["end place error [m]"] > 0.05
        assert go2.mode is Mode.STANDING


def test_a_fall_out_of_a_flight_is_a_fall() -> None:
    plant, go2 = standing()
    with go2:
        blow = np.array([0.0, 900.0, 0.0])
        when_playing(plant, go2, TAKE_OFF + 0.05, lambda: plant.inner.push(blow, 0.1))
        assert play(go2, hop_plan(MODEL, 0.0)) is False
        assert "fell" in go2.last_outcome.reason
        assert go2.mode is Mode.FALLEN
