"""After a fall onto the belly, a side or the back, the robot gets up."""

from pathlib import Path

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.state import JointCommand
from tests.unchecked import run_trials

DROP_HEIGHT = 0.25  #: Base height [m] from which the robot is dropped in its attitude
SETTLE_TICKS = 500
FOLDED = np.tile([0.0, 0.9, -1.8], 4)


def dropped(roll: float) -> MujocoPlant:
    plant = MujocoPlant()
    q = np.zeros(19)
    q[2], q[3], q[6] = DROP_HEIGHT, np.sin(roll / 2), np.cos(roll / 2)
    q[7:] = FOLDED
    plant.place(q, np.zeros(18))
    for _ in range(SETTLE_TICKS):
        plant.write(JointCommand.damping(3.0))
    return plant


@pytest.mark.slow
@pytest.mark.parametrize("roll_deg", [0, 50, -50, 90, -90, 150, 180])
def test_a_robot_that_was_dropped_at_any_roll_gets_up(roll_deg: int) -> None:
    with GO2Controller(plant=dropped(np.radians(roll_deg))) as go2:
        assert go2.recover(), go2.last_outcome.reason
        assert go2.state.tilt < np.radians(6)
        assert go2.state.feet_in_contact.all()
        assert go2.telemetry.peak_speed_ratio < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("side", [-1, 1])
def test_a_go1_whose_sides_are_flat_gets_up_from_either_where_its_feet_slide(side: int) -> None:
    plant = MujocoPlant(robot="go1", friction=0.5)
    q = np.zeros(19)
    q[2], q[3], q[6] = 0.147, side * np.sqrt(0.5), np.sqrt(0.5)
    q[7:] = find_profile("go1").tucked_joints
    plant.place(q)
    with GO2Controller(plant=plant) as go2:
        assert go2.recover(), go2.last_outcome.reason


@pytest.mark.slow
def test_a_robot_that_lies_on_its_back_says_that_it_cannot_stand() -> None:
    with GO2Controller(plant=dropped(np.pi)) as go2:
        assert go2.state.R_world_base[2, 2] < -0.9
        assert not go2.stand()
        assert "recover()" in go2.last_outcome.reason


@pytest.mark.slow
def test_a_robot_that_was_dropped_at_random_gets_up(tmp_path: Path) -> None:
    found = run_trials("balance", "recover", range(8), tmp_path)["recover"]
    assert [result.values["recover"] for result in found.values()] == [1.0] * 8, found
