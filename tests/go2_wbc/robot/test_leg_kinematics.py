"""Legs and CoM of many configurations against Pinocchio."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.compilation import Kernel
from go2_wbc.errors import DescriptionError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.records import packed
from go2_wbc.robot.leg_kinematics import (
    LegGeometry,
    centres_of_mass,
    foot_places,
    leg_angles,
    leg_table,
    link_table,
    settle,
    solve_legs,
    turns_of,
    turns_to,
)
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternions_from_rpy, rotations_from_rpy
from go2_wbc.wbc.trajectory_loads import share_loads
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import POLAR

EXACT = 1e-9  # m, rad
ROUNDING = 1e-12  # m, rad, 1
STEEP = 1e-7  # rad, where a leg is as long or as short as it can be, and the arc cosine is vertical
COUNT = 200
MANY = 1000  # places


MODEL = RobotModel()


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
def test_feet_are_where_pinocchio_has_them(leg: Leg) -> None:
    q = random_angles(MODEL, leg)
    places = foot_places(LegGeometry.of(MODEL, leg), q)
    for angles, place in zip(q[:20], places, strict=False):
        whole = np.zeros(19)
        whole[6] = 1.0
        whole[7:][leg.joints] = angles
        assert place == pytest.approx(MODEL.forward_kinematics(whole)[1][leg], abs=EXACT)


@pytest.mark.parametrize("is_raised", [False, True])
@pytest.mark.parametrize("leg", LEGS)
def test_angles_come_back_from_the_places_they_lead_to(leg: Leg, is_raised: bool) -> None:
    geometry = LegGeometry.of(MODEL, leg)
    q = random_angles(MODEL, leg, is_raised=is_raised)
    found = leg_angles(geometry, foot_places(geometry, q))
    turns = (found.q - q) / (2.0 * np.pi)
    assert turns == pytest.approx(np.round(turns), abs=1e-6)  # near the knee's limits acos is steep
    assert np.abs(found.q).max() <= np.pi
    assert found.miss == pytest.approx(0.0, abs=EXACT)


@pytest.mark.parametrize("leg", LEGS)
def test_a_place_out_of_reach_is_missed_by_its_distance_to_the_nearest_one(leg: Leg) -> None:
    geometry = LegGeometry.of(MODEL, leg)
    rng = np.random.default_rng(10 + int(leg))
    places = geometry.p_base_hip + rng.uniform(-0.7, 0.7, size=(500, 3))
    found = leg_angles(geometry, places)
    y, z = (places - geometry.p_base_hip)[:, 1:].T
    is_beside = np.hypot(y, z) > abs(geometry.width)  # not nearer to the hip's axis than the leg is
    assert (is_beside & (found.miss > 0.0)).sum() > 50
    distance = np.linalg.norm(foot_places(geometry, found.q) - places, axis=1)
    assert distance == pytest.approx(found.miss, abs=1e-6)
    assert (found.miss[~is_beside] > 0.0).all()


def test_a_foot_too_near_to_its_hip_is_missed_and_a_nan_answered_by_nans() -> None:
    # Thigh and calf are equally long here, so only a made-up leg has a hole in its reach.
    leg = packed(LegGeometry(np.zeros(3), 0.1, 0.25, 0.15))
    place = np.array([[0.0, 0.1, -0.04]])
    assert leg_angles(leg, place).miss == pytest.approx(0.06, abs=EXACT)
    inside = leg_angles(leg, np.array([[0.3, 0.06, 0.0]]))
    assert inside.miss == pytest.approx(0.04, abs=EXACT)
    found = leg_angles(LegGeometry.of(MODEL, Leg.FL), np.full((1, 3), np.nan))
    assert np.isnan(found.q).all()
    assert np.isnan(found.miss).all()


@pytest.mark.parametrize("leg", [Leg.FL, Leg.RL])
def test_left_and_right_are_mirror_images(leg: Leg) -> None:
    geometry, other = LegGeometry.of(MODEL, leg), LegGeometry.of(MODEL, leg.mirror)
    places = foot_places(geometry, random_angles(MODEL, leg))
    mirrored = leg_angles(other, places * POLAR)
    expected = leg_angles(geometry, places).q * [-1.0, 1.0, 1.0]
    assert mirrored.q == pytest.approx(expected, abs=EXACT)


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
    return geometry.p_base_hip + np.vstack([rng.uniform(-0.6, 0.6, size=(MANY, 3)), odd])


@pytest.mark.parametrize("leg", LEGS)
def test_cosines_and_sines_are_those_of_the_angles(leg: Leg) -> None:
    geometry = LegGeometry.of(MODEL, leg)
    fast, slow = np.empty(6), np.empty(6)
    for row, place in enumerate(places(geometry, 10 + int(leg))):
        x, y, z = place.tolist()
        turns_to(geometry, x, y, z, fast)
        turns_of(leg_angles(geometry, place[None]).q[0], slow)
        assert np.abs(fast - slow).max() < (ROUNDING if row < MANY else STEEP), place


def test_the_centre_of_mass_is_pinocchios() -> None:
    rng = np.random.default_rng(3)
    p, joints = rng.normal(size=(MANY, 3)), rng.uniform(-3.0, 3.0, size=(MANY, 12))
    attitude, com = Rotation.random(MANY, rng=rng), np.empty((MANY, 3))
    centres_of_mass(link_table(MODEL), p, attitude.as_matrix(), joints, com)
    for row, q in enumerate(np.hstack([p, attitude.as_quat(), joints])):
        assert com[row] == pytest.approx(MODEL.center_of_mass(q), abs=ROUNDING)


def test_a_robot_with_tilted_joints_is_refused() -> None:
    other = RobotModel()
    place = other.pin_model.jointPlacements[3]
    tilted = pin.SE3(pin.utils.rotate("x", 0.1), place.translation)
    other.pin_model.jointPlacements[3] = tilted
    with pytest.raises(DescriptionError, match="FL_thigh_joint"):
        link_table(other)


@pytest.mark.parametrize(
    "kernel",
    [rotations_from_rpy, quaternions_from_rpy, solve_legs, centres_of_mass, settle, share_loads],
)
def test_a_control_loop_need_not_wait_for_the_check_of_a_long_motion(
    kernel: Callable[..., None],
) -> None:
    """Plans are made beside a loop that ticks; for 60 s of motion a kernel takes many ticks."""
    assert isinstance(kernel, Kernel)
    assert kernel.nogil
    assert kernel.compiled.targetoptions["nogil"]  # type: ignore[attr-defined]


def test_a_settled_trunk_stands_on_its_feet() -> None:
    p, joints, feet = np.array([[0.01, 0.02, 0.28]]), np.zeros((1, 12)), MODEL.p_base_feet_nominal
    wanted, miss, com = p.copy(), np.empty((1, 4)), np.empty((1, 3))
    given = (np.array([True]), np.zeros((1, 4), dtype=bool), np.eye(3)[None], feet[None].copy())
    settle(wanted, *given, leg_table(MODEL), link_table(MODEL), 9, p, joints, miss, com)
    found = MODEL.forward_kinematics(np.concatenate([p[0], [0.0, 0.0, 0.0, 1.0], joints[0]]))
    assert com[0] == pytest.approx(found[0], abs=EXACT)
    assert com[0] == pytest.approx(wanted[0], abs=1e-6)
    assert found[1] == pytest.approx(feet, abs=EXACT)
    assert miss.max() == 0.0


def test_compiled_is_plain() -> None:
    rng = np.random.default_rng(4)
    geometry, n = LegGeometry.of(MODEL, Leg.RL), 20
    feet = places(geometry, 20)[-n:]
    assert_plain_is_compiled(solve_legs, geometry, feet, np.empty((n, 3)), np.empty(n))
    R = Rotation.from_rotvec(0.3 * rng.normal(size=(n, 3))).as_matrix()
    p, joints = rng.normal(scale=0.05, size=(n, 3)) + [0.0, 0.0, 0.3], rng.normal(size=(n, 12))
    links, com = link_table(MODEL), np.empty((n, 3))
    assert_plain_is_compiled(centres_of_mass, links, p, R, joints, com)
    raised, is_com = rng.random((n, 4)) < 0.3, rng.random(n) < 0.5
    p_feet = MODEL.p_base_feet_nominal + rng.normal(scale=0.02, size=(n, 4, 3))
    given = (p, is_com, raised, R, p_feet, leg_table(MODEL), links, 3)
    assert_plain_is_compiled(settle, *given, p, joints, np.empty((n, 4)), com)
