"""What the robot does is measured: lying is no walking, a held-down paw is no high five."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller, Mode
from controller import runner as runner_module
from go2_wbc.errors import PlantTimeout
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.state import JointCommand
from motions import Timeline
from tests.controller.plants import HANG_GUARD, PERIOD, WatchedPlant, in_thread

FEEBLE = 0.2  # A share of the motors' torque with which a walking robot sinks to the ground


class FadingPlant(WatchedPlant):
    """A robot whose motors give ``share`` of what they are told."""

    share = 1.0

    def write(self, command: JointCommand) -> None:
        super().write(replace(command, tau=self.share * command.tau))


def test_a_walking_robot_that_sinks_onto_its_belly_has_fallen() -> None:
    # The limit was lower than the belly at rest: the robot lay there and was said to walk.
    plant = FadingPlant()
    with GO2Controller(plant=plant) as go2:
        assert go2.walk()
        go2.move(0.3)
        go2.wait(1.0)
        plant.share = FEEBLE
        go2.wait(3.0)
        assert go2.mode is Mode.FALLEN
        assert "base" in go2.last_outcome.reason or "roll" in go2.last_outcome.reason
        go2.damp()
        assert go2.mode is Mode.FALLEN  # going limp does not undo a fall
        plant.share = 1.0
        assert go2.recover()


@pytest.mark.parametrize("moment", [0.0, 0.045, 0.09, 0.135])
def test_walking_again_while_walking_goes_on_with_the_command(moment: float) -> None:
    # It restarted the planner as if all feet stood, wherever they were: legs were flung about.
    plant = MujocoPlant(control_period=PERIOD)
    with GO2Controller(plant=plant) as go2:
        assert go2.walk()
        go2.move(1.0)
        go2.wait(2.0 + moment)
        assert go2.walk()
        assert go2.command.linear_x == 1.0
        go2.wait(1.0)
        assert go2.mode is Mode.WALKING
        assert go2.telemetry.peak_speed_ratio < 1.0
        assert go2.telemetry.qp_failures == 0


@pytest.mark.slow
def test_a_paw_that_is_held_down_is_no_high_five_for_play_either(
    plant: WatchedPlant, go2: GO2Controller
) -> None:
    assert go2.stand()
    hold = lambda: plant.inner.push(np.array([0.0, 0.0, -30.0]), 8.0, "FR_foot")  # noqa: E731
    plant.once_at(go2.state.time + 2.5, hold)
    assert go2.play("high_five") is False
    assert "went another way" in go2.last_outcome.reason
    assert go2.last_outcome.measured["mean joints off plan [deg]"] > 10.0


def test_stopping_from_another_thread_while_time_passes_is_no_error(
    plant: WatchedPlant, go2: GO2Controller
) -> None:
    assert go2.walk()
    go2.move(0.3)
    plant.once_at(go2.state.time + 0.5, lambda: in_thread(go2.stop).result(HANG_GUARD))
    go2.wait(2.0)
    assert go2.command.is_zero
    assert go2.mode is Mode.WALKING


def test_in_realtime_a_plant_that_blocks_keeps_nobody_waiting(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Calls waited for the lock that the blocked tick held: wait, damp and close hung with it.
    monkeypatch.setattr(runner_module, "HANG_LIMIT", 0.3)
    plant, released = WatchedPlant(), threading.Event()

    def block() -> None:
        released.wait(HANG_GUARD)

    go2 = GO2Controller(plant=plant, realtime=True)
    try:
        plant.on_write = block
        began = time.monotonic()
        with pytest.raises(PlantTimeout, match=r"waiting for more than 0\.3 s"):
            in_thread(lambda: go2.wait(1.0)).result(HANG_GUARD)
        with pytest.raises(PlantTimeout):
            in_thread(go2.damp).result(HANG_GUARD)
        in_thread(go2.close).result(HANG_GUARD)
        assert time.monotonic() - began < HANG_GUARD / 2
        assert go2.mode is Mode.CLOSED
    finally:
        released.set()


def test_a_motion_that_kneels_on_the_ground_is_not_done() -> None:
    # Trunk low and aside, a paw up: a thigh lay on the ground for a second, and play said True.
    low = Timeline().body(roll=-0.141, z=-0.14, over=1.0)
    line = low.foot("FR", z=0.07, over=0.6).hold(0.3).down("FR", over=0.4).home(over=0.9)
    with GO2Controller() as go2:
        assert go2.stand()
        assert not go2.play(line, check=False)
        assert "touched the ground with trunk or legs for" in go2.last_outcome.reason
        assert go2.play("nod"), go2.last_outcome.reason
