"""A posture is one at any height of the ground, still, and with every foot down where it must."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from controller.modes import (
    Limited,
    are_within,
    lying,
    posture_measurements,
    sitting,
    standing,
    told,
)
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.state import Snapshot
from motions.batch_kinematics import configurations
from motions.postures import home_poses
from tests.engine_helpers import state_of

MODEL = RobotModel()
HOME = home_poses(MODEL)
LYING = 0.085  # m; of the base over the ground, on its belly
ASKED: dict[Posture, Callable[[Snapshot], Limited]] = {
    Posture.STAND: standing,
    Posture.SIT: sitting,
    Posture.LIE: lying,
}


def at_rest(posture: Posture, ground: float = 0.0, slope: float = 0.0) -> Snapshot:
    """In ``posture`` with the feet below the hips, the ground at a height, or rising ahead."""
    pose = HOME[posture].copy()
    pose[2] = LYING if posture is Posture.LIE else pose[2]
    feet = MODEL.p_base_feet_nominal.copy()
    feet[:, 2] = MODEL.foot_radius + slope * feet[:, 0]
    p_base_feet = (feet - pose[:3]) @ rotation_from_rpy(*pose[3:])
    joints = [leg_angles(LegGeometry.of(MODEL, leg), p_base_feet[leg][None]).q[0] for leg in LEGS]
    pose[2] += ground
    state = state_of(configurations(pose[None], np.concatenate(joints)[None])[0])
    return MODEL.snapshot(replace(state, feet_in_contact=np.ones(4, dtype=bool)))


@pytest.mark.parametrize("ground", [0.0, 0.4, -1.3])
@pytest.mark.parametrize("posture", Posture)
def test_a_posture_is_known_whatever_the_height_of_the_ground(
    posture: Posture, ground: float
) -> None:
    snapshot = at_rest(posture, ground)
    assert [name for name, asked in ASKED.items() if are_within(asked(snapshot))] == [posture]
    level = posture_measurements(at_rest(posture))
    assert posture_measurements(snapshot) == pytest.approx(level, abs=1e-9)


def test_the_speed_that_is_told_is_how_fast_the_base_moves_not_how_it_turns() -> None:
    state = replace(at_rest(Posture.STAND).state, v=np.array([0.3, 0.0, 0.4, *np.ones(15)]))
    told = posture_measurements(MODEL.snapshot(state))
    assert told["base speed [m/s]"] == pytest.approx(0.5)


@pytest.mark.parametrize("slope", [-0.14, 0.14])
@pytest.mark.parametrize("posture", [Posture.STAND, Posture.SIT])
def test_on_a_slope_a_posture_has_its_height_over_the_ground_below_it(
    posture: Posture, slope: float
) -> None:
    # The lowest foot of a robot that sat on 8 deg was 27 mm lower: it sat still, and `sit` said no.
    assert are_within(ASKED[posture](at_rest(posture, slope=slope)))


@pytest.mark.parametrize(("part", "speed"), [(0, 0.06), (8, 0.6)])  # the base, a joint
@pytest.mark.parametrize("posture", Posture)
def test_a_robot_that_still_moves_is_in_no_posture(
    posture: Posture, part: int, speed: float
) -> None:
    snapshot, v = at_rest(posture), np.zeros(18)
    v[part] = speed
    moving = MODEL.snapshot(replace(snapshot.state, v=v))
    assert not any(are_within(asked(moving)) for asked in ASKED.values())


@pytest.mark.parametrize("posture", [Posture.STAND, Posture.SIT])
def test_a_foot_in_the_air_is_no_posture_on_four_feet(posture: Posture) -> None:
    snapshot = at_rest(posture)
    touching = np.array([True, True, False, True])
    raised = snapshot.replaced(state=replace(snapshot.state, feet_in_contact=touching))
    assert told(ASKED[posture](raised)) == "feet in the air 1, limit 1"
