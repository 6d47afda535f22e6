"""Dynamic motions are played by simulated robots, and by others only if the caller allows it."""

from __future__ import annotations

import pytest

from controller import GO2Controller
from go2_wbc.errors import DynamicMotionRefused, StanceMismatch
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, Timeline, compile_timeline, load_motion
from tests.controller.plants import StillPlant


class LivePlant(StillPlant):
    """A user's own plant, of which nothing is known but that its time does not wait."""

    @property
    def is_live(self) -> bool:
        return True


@pytest.fixture(scope="module")
def two_feet() -> CompiledPlan:
    line = Timeline(balance=False).foot("FL", z=0.03, over=0.4).foot("RR", z=0.03, over=0.4)
    return compile_timeline(line.home(over=0.4), RobotModel())


def test_a_plant_that_may_be_a_robot_is_not_sent_a_dynamic_motion(two_feet: CompiledPlan) -> None:
    with GO2Controller(plant=LivePlant(), realtime=True) as go2:
        with pytest.raises(DynamicMotionRefused, match="LivePlant may move a robot") as caught:
            go2.play(two_feet, check=False)
        assert "play(..., allow_dynamic=True)" in str(caught.value)
        assert not go2.last_outcome


@pytest.mark.parametrize("is_simulated", [False, True])
def test_who_allows_it_or_simulates_gets_as_far_as_with_any_other_motion(
    two_feet: CompiledPlan, *, is_simulated: bool
) -> None:
    plant = StillPlant() if is_simulated else LivePlant()
    with GO2Controller(plant=plant, realtime=not is_simulated) as go2:
        for plan in (two_feet, compile_timeline(load_motion("bow"), RobotModel())):
            is_allowed = plan is two_feet and not is_simulated
            with pytest.raises(StanceMismatch, match="the robot is lying"):
                go2.play(plan, check=False, allow_dynamic=is_allowed)


def test_what_simulates_says_so() -> None:
    plant = GroundTruth(MujocoPlant())
    assert not plant.is_hardware
    assert LivePlant().is_hardware
    plant.close()
