"""Every fault ends in a clear error of our own or in a limp robot, and the next call works."""

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller, Mode
from go2_wbc.config import Config
from go2_wbc.errors import ModeError, PlantTimeout
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.config import WbcConfig
from tests.controller.plants import (
    HANG_GUARD,
    MID_RISE,
    PERIOD,
    WatchedPlant,
    break_qp,
    failing,
    in_thread,
    is_limp,
)
from tests.go2_wbc.plant.contract import PlantContract

FEEBLE = 0.05  # A share of the motors' torque with which the legs cannot carry the trunk
HEAVY = 40.0  # kg; two and a half times the robot's own mass
# N for 0.2 s at the trunk: 60 N s, three times what a standing robot withstands.
SHOVE = np.array([0.0, 500.0, 0.0])


class TestWatchedPlantContract(PlantContract):
    """The plant of these tests is a plant like any other."""

    @pytest.fixture
    def plant(self) -> WatchedPlant:
        return WatchedPlant()


@pytest.mark.parametrize(("count", "limp"), [(1, 0), (6, 5)])
def test_a_few_infeasible_qps_damp_the_robot_at_most_and_it_stands_all_the_same(
    plant: WatchedPlant, go2: GO2Controller, monkeypatch: pytest.MonkeyPatch, count: int, limp: int
) -> None:
    break_qp(monkeypatch, lambda n: 100 <= n < 100 + count)
    assert go2.stand()
    assert go2.mode is Mode.STANDING
    assert go2.telemetry.qp_failures == count
    assert sum(map(is_limp, plant.commands)) == limp


def test_a_qp_that_stays_infeasible_ends_in_a_limp_robot_that_says_why(
    plant: WatchedPlant,
    go2: GO2Controller,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    with monkeypatch.context() as patch:
        break_qp(patch, lambda n: n >= 100)
        assert not go2.stand()
    assert go2.mode is Mode.DAMPED
    assert "damped after 10 QP failures in a row" in go2.last_outcome.reason
    assert "active_set found no solution" in go2.last_outcome.reason
    assert go2.telemetry.qp_failures == 10
    assert is_limp(plant.commands[-1])
    assert "contact forces" in caplog.text
    with pytest.raises(ModeError, match="not damped"):
        go2.move(0.1)
    assert go2.stand()


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (PlantTimeout("the robot does not answer"), "the robot does not answer"),
        (ZeroDivisionError("a bug"), "ZeroDivisionError during stand(): a bug"),
    ],
)
def test_an_error_of_a_plant_ends_the_call_leaves_it_limp_and_it_is_used_again_afterwards(
    plant: WatchedPlant, go2: GO2Controller, error: Exception, told: str
) -> None:
    plant.once_at(MID_RISE, failing(error))
    with pytest.raises(type(error), match=str(error)):
        go2.stand()
    assert go2.mode is Mode.DAMPED
    assert not go2.last_outcome
    assert told in go2.last_outcome.reason
    assert is_limp(plant.commands[-1])
    assert go2.stand()


def not_finite(name: str) -> Callable[[RobotState], RobotState]:
    def corrupt(state: RobotState) -> RobotState:
        values = getattr(state, name).copy()
        values[9] = np.nan
        return replace(state, **{name: values})

    return corrupt


@pytest.mark.parametrize(
    ("corrupt", "lack"),
    [
        (lambda state: replace(state, time=MID_RISE), "new"),  # it stands still
        (lambda state: replace(state, time=-1.0), "new"),
        (lambda state: replace(state, time=0.5), "new"),
        (lambda state: replace(state, time=np.nan), "finite"),
        (lambda state: replace(state, time=np.inf), "finite"),
        (not_finite("q"), "finite"),
        (not_finite("v"), "finite"),
    ],
)
def test_a_clock_that_does_not_go_on_and_a_state_that_is_not_finite_end_the_call(
    plant: WatchedPlant, go2: GO2Controller, corrupt: Callable[[RobotState], RobotState], lack: str
) -> None:
    """An infinite time would end every wait at once, and the gait's phase with it."""
    plant.on_read = lambda state: state if state.time < MID_RISE else corrupt(state)
    with pytest.raises(PlantTimeout, match=f"no {lack} state from the plant for 3[26] ms"):
        go2.stand()
    assert go2.mode is Mode.DAMPED
    assert is_limp(plant.commands[-1])
    assert np.isfinite(go2.state.q).all()
    assert f"no {lack} state" in go2.last_outcome.reason


@pytest.mark.parametrize("realtime", [False, True])
def test_damp_from_another_thread_ends_the_call_honestly(
    plant: WatchedPlant, *, realtime: bool
) -> None:
    under_way = threading.Event()
    plant.once_at(0.1, under_way.set)
    with GO2Controller(plant=plant, realtime=realtime) as go2:
        call = in_thread(go2.stand)
        assert under_way.wait(HANG_GUARD)
        in_thread(go2.damp).result(HANG_GUARD)
        assert call.result(HANG_GUARD) is False
        assert go2.mode is Mode.DAMPED
        assert go2.last_outcome.reason == "damped by damp()"


def test_a_robot_pushed_over_in_the_middle_of_a_call_says_that_it_fell(
    plant: WatchedPlant, go2: GO2Controller
) -> None:
    assert go2.stand()
    plant.inner.push(SHOVE, 0.2)
    assert go2.sit() is False
    assert go2.mode is Mode.FALLEN
    assert go2.last_outcome.reason.startswith("fell at t=")
    assert " deg" in go2.last_outcome.reason
    assert is_limp(plant.commands[-1])
    for call in (go2.stand, go2.sit, go2.walk, go2.lie_down, go2.high_five):
        with pytest.raises(ModeError, match=r"call recover\(\) first"):
            call()
    with pytest.raises(ModeError, match="fallen"):
        go2.move(0.1)
    go2.wait(0.1)
    assert go2.mode is Mode.FALLEN


@pytest.mark.parametrize(("torque_share", "payload"), [(FEEBLE, 0.0), (1.0, HEAVY)])
def test_a_robot_that_cannot_carry_its_weight_says_no_and_how_far_it_got(
    torque_share: float, payload: float
) -> None:
    config = Config(wbc=replace(WbcConfig(), torque_share=torque_share))
    plant = MujocoPlant(control_period=PERIOD, payload=payload)
    with GO2Controller(plant=plant, config=config) as go2:
        for _ in range(2):
            assert go2.stand() is False
            reason = go2.last_outcome.reason
            assert reason.startswith("stand not done within 3.0 s: height error [m] 0.")
            assert go2.mode is not Mode.STANDING
            with pytest.raises(ModeError):
                go2.move(0.1)
        if not payload:
            assert go2.telemetry.qp_failures == 0
            assert go2.telemetry.relaxed_ticks > 100
        assert go2.lie_down()
        assert go2.mode is Mode.LYING
