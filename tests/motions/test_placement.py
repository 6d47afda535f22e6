"""Trunk and joints from feet and CoM, all instants at once, against Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import angular_velocity_from_rpy, rotation_from_rpy, rpy_from_rotation
from motions.balance import nearest
from motions.footing import standing_feet
from motions.placement import Wanted, attitudes, place
from motions.trajectory import _angular_rates, _rpy_of

COUNT = 300
ROUNDING = 1e-9  # m, rad
STEEP = 1e-6  # m; where a leg is as long as it can be, the arc cosine is vertical


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def wanted_somewhere(model: RobotModel, seed: int) -> Wanted:
    rng = np.random.default_rng(seed)
    return Wanted(
        p=np.array([0.0, 0.0, 0.27]) + rng.normal(scale=[0.05, 0.05, 0.06], size=(COUNT, 3)),
        is_com=rng.random(COUNT) < 0.7,
        R=attitudes(rng.normal(scale=0.3, size=(COUNT, 3))),
        q_joints=rng.uniform(-2.0, 2.0, size=(COUNT, 12)),
        raised=rng.random((COUNT, 4)) < 0.3,
        p_feet=standing_feet(model) + rng.normal(scale=0.02, size=(COUNT, 4, 3)),
    )


@pytest.mark.parametrize("steps", [0, 1, 5])
def test_feet_and_com_are_where_pinocchio_has_them(model: RobotModel, steps: int) -> None:
    wanted = wanted_somewhere(model, steps)
    found = place(wanted, steps, model)
    attitude = Rotation.from_matrix(wanted.R).as_quat()
    for row, q in enumerate(np.hstack([found.p_base, attitude, found.q_joints])):
        com, feet = model.forward_kinematics(q)
        raised = wanted.raised[row]
        assert found.p_com[row] == pytest.approx(com, abs=ROUNDING)
        off = np.linalg.norm(feet - wanted.p_feet[row], axis=1)[~raised]
        assert off == pytest.approx(found.miss[row, ~raised], abs=STEEP)
        joints = found.q_joints[row].reshape(4, 3)
        np.testing.assert_array_equal(joints[raised], wanted.q_joints[row].reshape(4, 3)[raised])
    assert (found.miss[wanted.raised] == 0.0).all()
    assert (found.miss > 0.0).any()


def test_every_step_moves_the_base_by_what_the_com_is_off(model: RobotModel) -> None:
    wanted = wanted_somewhere(model, 9)
    for steps in range(4):
        before, after = place(wanted, steps, model), place(wanted, steps + 1, model)
        step = np.where(wanted.is_com[:, None], wanted.p - before.p_com, 0.0)
        np.testing.assert_allclose(after.p_base, before.p_base + step, atol=ROUNDING)
        if steps == 0:
            np.testing.assert_array_equal(before.p_base, wanted.p)


def test_the_com_comes_to_its_place_where_the_feet_are_reached(model: RobotModel) -> None:
    wanted = wanted_somewhere(model, 5)
    found = place(wanted, 5, model)
    is_reached = wanted.is_com & (found.miss == 0.0).all(axis=1)
    assert is_reached.sum() > COUNT // 10
    assert np.median(np.abs(found.p_com - wanted.p)[is_reached]) < 1e-6


def test_what_is_wanted_stays_as_it_was(model: RobotModel) -> None:
    wanted = Wanted(
        p=np.array([[0.0, 0.0, 0.27]]),
        is_com=np.ones(1, dtype=bool),
        R=np.eye(3)[None],
        q_joints=np.zeros((1, 12)),
        raised=np.zeros((1, 4), dtype=bool),
        p_feet=standing_feet(model)[None],
    )
    for array in (wanted.p, wanted.R, wanted.q_joints, wanted.raised, wanted.p_feet):
        array.flags.writeable = False
    assert place(wanted, 2, model).p_base[0, 2] != pytest.approx(0.27)


def test_roll_pitch_and_yaw_are_those_of_one_rotation_after_the_other() -> None:
    rng = np.random.default_rng(4)
    rpy = rng.uniform([-3.1, -1.57, -3.1], [3.1, 1.57, 3.1], size=(COUNT, 3))
    R = np.array([rotation_from_rpy(*row) for row in rpy.tolist()])
    expected = np.array([rpy_from_rotation(rotation) for rotation in R])
    assert _rpy_of(R) == pytest.approx(expected, abs=1e-8)  # steep where the trunk is upright


def test_a_trunk_on_its_end_has_angles_that_give_its_attitude() -> None:
    R = attitudes(np.array([[0.4, np.pi / 2, 0.3], [-0.2, -np.pi / 2, 1.0]]))
    assert attitudes(_rpy_of(R)) == pytest.approx(R, abs=1e-9)


def test_angular_rates_are_those_of_one_instant_after_the_other() -> None:
    rpy, rate, acceleration = np.random.default_rng(5).normal(size=(3, COUNT, 3))
    w, dw = _angular_rates(rpy, rate, acceleration)
    for row in range(COUNT):
        expected = angular_velocity_from_rpy(rpy[row], rate[row], acceleration[row])
        assert (w[row], dw[row]) == (
            pytest.approx(expected[0], abs=1e-12),
            pytest.approx(expected[1], abs=1e-12),
        )


def test_the_nearest_sample_is_that_of_the_least_distance() -> None:
    times = np.linspace(0.0, 3.0, 301)
    for t in [-1.0, 0.0, 0.005, 2.995, 3.0, 7.0, *np.random.default_rng(6).uniform(0, 3, 200)]:
        assert nearest(times, float(t)) == int(np.abs(times - t).argmin())
