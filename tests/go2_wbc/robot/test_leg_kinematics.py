"""The closed-form inverse kinematics of a leg against Pinocchio's forward kinematics."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places, leg_angles
from go2_wbc.robot.model import RobotModel
from tests.engine_helpers import POLAR

EXACT = 1e-9  # m, rad
COUNT = 200


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def random_angles(model: RobotModel, leg: Leg, *, is_raised: bool = False) -> np.ndarray:
    """Angles within the limits with the foot below the hip's axis, or above it."""
    rng = np.random.default_rng(int(leg))
    lower, upper = model.q_lower[leg.joints], model.q_upper[leg.joints]
    q = rng.uniform(lower, upper, size=(20 * COUNT, 3))
    geometry = LegGeometry.of(model, leg)
    down = geometry.thigh * np.cos(q[:, 1]) + geometry.calf * np.cos(q[:, 1] + q[:, 2])
    z = (foot_places(geometry, q) - geometry.p_base_hip)[:, 2]
    fits = (down < 0.0) & (z > 0.0) if is_raised else (down > 0.0) & (z < 0.0)
    assert fits.sum() >= COUNT
    return q[fits][:COUNT]


@pytest.mark.parametrize("leg", LEGS)
def test_feet_are_where_pinocchio_has_them(model: RobotModel, leg: Leg) -> None:
    q = random_angles(model, leg)
    places = foot_places(LegGeometry.of(model, leg), q)
    for angles, place in zip(q[:20], places, strict=False):
        whole = np.zeros(19)
        whole[6] = 1.0
        whole[7:][leg.joints] = angles
        assert place == pytest.approx(model.forward_kinematics(whole)[1][leg], abs=EXACT)


@pytest.mark.parametrize("is_raised", [False, True])
@pytest.mark.parametrize("leg", LEGS)
def test_angles_come_back_from_the_places_they_lead_to(
    model: RobotModel, leg: Leg, is_raised: bool
) -> None:
    geometry = LegGeometry.of(model, leg)
    q = random_angles(model, leg, is_raised=is_raised)
    found = leg_angles(geometry, foot_places(geometry, q))
    turns = (found.q - q) / (2.0 * np.pi)
    assert turns == pytest.approx(np.round(turns), abs=1e-6)  # near the knee's limits acos is steep
    assert np.abs(found.q).max() <= np.pi
    assert found.miss == pytest.approx(0.0, abs=EXACT)


@pytest.mark.parametrize("leg", LEGS)
def test_a_place_out_of_reach_is_missed_by_its_distance_to_the_nearest_one(
    model: RobotModel, leg: Leg
) -> None:
    geometry = LegGeometry.of(model, leg)
    rng = np.random.default_rng(10 + int(leg))
    places = geometry.p_base_hip + rng.uniform(-0.7, 0.7, size=(500, 3))
    found = leg_angles(geometry, places)
    y, z = (places - geometry.p_base_hip)[:, 1:].T
    is_beside = np.hypot(y, z) > abs(geometry.width)  # not nearer to the hip's axis than the leg is
    assert (is_beside & (found.miss > 0.0)).sum() > 50
    distance = np.linalg.norm(foot_places(geometry, found.q) - places, axis=1)
    assert distance == pytest.approx(found.miss, abs=1e-6)
    assert (found.miss[~is_beside] > 0.0).all()


def test_a_foot_too_near_to_its_hip_is_missed(model: RobotModel) -> None:
    # Thigh and calf are equally long here, so only a made-up leg has a hole in its reach.
    leg = LegGeometry(np.zeros(3), 0.1, 0.25, 0.15)
    place = np.array([[0.0, 0.1, -0.04]])
    assert leg_angles(leg, place).miss == pytest.approx(0.06, abs=EXACT)
    inside = leg_angles(leg, np.array([[0.3, 0.06, 0.0]]))
    assert inside.miss == pytest.approx(0.04, abs=EXACT)


@pytest.mark.parametrize("leg", [Leg.FL, Leg.RL])
def test_left_and_right_are_mirror_images(model: RobotModel, leg: Leg) -> None:
    geometry, other = LegGeometry.of(model, leg), LegGeometry.of(model, leg.mirror)
    places = foot_places(geometry, random_angles(model, leg))
    mirrored = leg_angles(other, places * POLAR)
    expected = leg_angles(geometry, places).q * [-1.0, 1.0, 1.0]
    assert mirrored.q == pytest.approx(expected, abs=EXACT)
