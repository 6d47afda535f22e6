"""Legs and CoM by kernels, against the readable inverse kinematics and Pinocchio."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.errors import DescriptionError
from go2_wbc.kernels import kinematics, loads
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.leg_kinematics import (
    LegGeometry,
    leg_angles,
    link_table,
    readable_leg_angles,
)
from go2_wbc.robot.model import RobotModel

COUNT = 1000
ROUNDING = 1e-12  # m, rad, 1
STEEP = 1e-7  # rad, where a leg is as long or as short as it can be, and the arc cosine is vertical


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def places(geometry: LegGeometry, seed: int) -> np.ndarray:
    """Places in and out of reach, and those at which an angle is not defined."""
    rng = np.random.default_rng(seed)
    longest = geometry.thigh + geometry.calf
    odd = [
        [0.0, 0.0, 0.0],
        [0.1, 0.0, 0.0],
        [0.0, geometry.width, 0.0],
        [0.0, -geometry.width, 0.0],
        [0.0, geometry.width, -longest],
        [longest, geometry.width, 0.0],
        [0.0, 0.5 * geometry.width, 0.0],
    ]
    return geometry.p_base_hip + np.vstack([rng.uniform(-0.6, 0.6, size=(COUNT, 3)), odd])


@pytest.mark.parametrize("leg", LEGS)
def test_angles_are_those_of_the_readable_inverse_kinematics(model: RobotModel, leg: Leg) -> None:
    geometry = LegGeometry.of(model, leg)
    feet = places(geometry, int(leg))
    found, expected = leg_angles(geometry, feet), readable_leg_angles(geometry, feet)
    turns = np.abs(np.exp(1j * found.q) - np.exp(1j * expected.q))  # -pi is pi
    assert turns[:COUNT].max() < ROUNDING
    assert turns.max() < STEEP
    assert found.miss == pytest.approx(expected.miss, abs=ROUNDING)
    assert (found.miss > 0.0).sum() > COUNT // 10
    assert (found.miss == 0.0).sum() > COUNT // 10


def test_a_nan_is_answered_by_nans(model: RobotModel) -> None:
    found = leg_angles(LegGeometry.of(model, Leg.FL), np.full((1, 3), np.nan))
    assert np.isnan(found.q).all()
    assert np.isnan(found.miss).all()


@pytest.mark.parametrize("leg", LEGS)
def test_cosines_and_sines_are_those_of_the_angles(model: RobotModel, leg: Leg) -> None:
    geometry = LegGeometry.of(model, leg)
    fast, slow = np.empty(6), np.empty(6)
    for row, place in enumerate(places(geometry, 10 + int(leg))):
        x, y, z = place.tolist()
        kinematics.turns_to(geometry.row, x, y, z, fast)
        kinematics.turns_of(leg_angles(geometry, place[None]).q[0], slow)
        assert np.abs(fast - slow).max() < (ROUNDING if row < COUNT else STEEP), place


def test_rotations_and_quaternions_are_those_of_roll_pitch_yaw() -> None:
    rpy = np.random.default_rng(2).uniform(-4.0, 4.0, size=(COUNT, 3))
    expected = Rotation.from_euler("ZYX", rpy[:, ::-1])
    R, xyzw = np.empty((COUNT, 3, 3)), np.empty((COUNT, 4))
    kinematics.rotations(rpy, R)
    kinematics.quaternions(rpy, xyzw)
    assert pytest.approx(expected.as_matrix(), abs=ROUNDING) == R
    assert pytest.approx(expected.as_quat(), abs=ROUNDING) == xyzw


def test_the_centre_of_mass_is_pinocchios(model: RobotModel) -> None:
    rng = np.random.default_rng(3)
    p, joints = rng.normal(size=(COUNT, 3)), rng.uniform(-3.0, 3.0, size=(COUNT, 12))
    attitude, com = Rotation.random(COUNT, rng=rng), np.empty((COUNT, 3))
    kinematics.centres_of_mass(link_table(model), p, attitude.as_matrix(), joints, com)
    for row, q in enumerate(np.hstack([p, attitude.as_quat(), joints])):
        assert com[row] == pytest.approx(model.center_of_mass(q), abs=ROUNDING)


def test_a_robot_with_tilted_joints_is_refused() -> None:
    other = RobotModel()
    place = other.pin_model.jointPlacements[3]
    tilted = pin.SE3(pin.utils.rotate("x", 0.1), place.translation)
    other.pin_model.jointPlacements[3] = tilted
    with pytest.raises(DescriptionError, match="FL_thigh_joint"):
        link_table(other)


@pytest.mark.parametrize(
    ("module", "name"),
    [
        (kinematics, "rotations"),
        (kinematics, "quaternions"),
        (kinematics, "solve_legs"),
        (kinematics, "centres_of_mass"),
        (kinematics, "settle"),
        (loads, "share_loads"),
    ],
)
def test_a_control_loop_need_not_wait_for_the_check_of_a_long_motion(
    module: ModuleType, name: str
) -> None:
    """Plans are made beside a loop that ticks; for 60 s of motion a kernel takes many ticks."""
    assert getattr(module, name).targetoptions["nogil"]
