"""Trunk and joints from feet and CoM, all instants at once, against Pinocchio and rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy, rpy_from_rotation
from motions.batch_kinematics import Wanted, angles_of, attitudes, place
from motions.plan.balance import nearest
from motions.postures import standing_feet

COUNT = 300
LEFT = 0.2  # share of the error that a step leaves at most; an eighth is usual
ROUNDING = 1e-9  # m, rad; where a leg is stretched the rounding of its foot's place is amplified


@pytest.mark.parametrize("steps", [0, 1, 5])
def test_feet_and_centre_of_mass_are_where_pinocchio_puts_them(
    model: RobotModel, steps: int
) -> None:
    rng = np.random.default_rng(steps)
    wanted = Wanted(
        p=np.array([0.0, 0.0, 0.27]) + rng.normal(scale=[0.05, 0.05, 0.06], size=(COUNT, 3)),
        is_com=rng.random(COUNT) < 0.7,
        R=attitudes(rng.normal(scale=0.3, size=(COUNT, 3))),
        q_joints=rng.uniform(-2.0, 2.0, size=(COUNT, 12)),
        raised=rng.random((COUNT, 4)) < 0.3,
        p_feet=standing_feet(model) + rng.normal(scale=0.02, size=(COUNT, 4, 3)),
    )
    found = place(wanted, steps, model)
    q = np.hstack([found.p_base, Rotation.from_matrix(wanted.R).as_quat(), found.q_joints])
    feet = np.array([model.forward_kinematics(row)[1] for row in q])
    off = np.linalg.norm(feet - wanted.p_feet, axis=2)
    stands = ~wanted.raised
    assert off[stands] == pytest.approx(found.miss[stands], abs=ROUNDING)
    assert (found.miss[wanted.raised] == 0.0).all()
    kept = np.repeat(wanted.raised, 3, axis=1)
    np.testing.assert_array_equal(found.q_joints[kept], wanted.q_joints[kept])
    com = np.array([model.center_of_mass(row) for row in q])
    assert found.p_com == pytest.approx(com, abs=ROUNDING)
    np.testing.assert_array_equal(found.p_base[~wanted.is_com], wanted.p[~wanted.is_com])
    assert (found.miss > 0.0).any()
    is_reached = wanted.is_com & (found.miss == 0.0).all(axis=1)
    left = np.median(np.linalg.norm(com - wanted.p, axis=1)[is_reached])
    first = np.median(np.linalg.norm(place(wanted, 0, model).p_com - wanted.p, axis=1)[is_reached])
    assert is_reached.sum() > COUNT // 10
    assert left <= LEFT**steps * first


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


def test_roll_pitch_and_yaw_are_one_rotation_after_the_other_even_on_its_end() -> None:
    rng = np.random.default_rng(4)
    rpy = rng.uniform([-3.1, -1.57, -3.1], [3.1, 1.57, 3.1], size=(COUNT, 3))
    R = np.array([rotation_from_rpy(*row) for row in rpy.tolist()])
    expected = np.array([rpy_from_rotation(rotation) for rotation in R])
    assert angles_of(R) == pytest.approx(expected, abs=1e-8)  # steep where the trunk is upright
    R = attitudes(np.array([[0.4, np.pi / 2, 0.3], [-0.2, -np.pi / 2, 1.0]]))
    assert attitudes(angles_of(R)) == pytest.approx(R, abs=1e-9)


def test_the_nearest_sample_is_that_of_the_least_distance() -> None:
    times = np.linspace(0.0, 3.0, 301)
    for t in [-1.0, 0.0, 0.005, 2.995, 3.0, 7.0, *np.random.default_rng(6).uniform(0, 3, 200)]:
        assert nearest(times, float(t)) == int(np.abs(times - t).argmin())
