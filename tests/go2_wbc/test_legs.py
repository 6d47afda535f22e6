"""Leg order and index arithmetic agree with Pinocchio's model and with each other."""

import numpy as np
import pinocchio as pin

from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS
from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel


def test_the_legs_columns_tile_the_joints_in_pinocchios_order() -> None:
    urdf = find_description().urdf_path
    robot = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    assert list(robot.names)[2:] == list(JOINT_NAMES)
    for leg in LEGS:
        names = JOINT_NAMES[leg.joints]
        assert all(name.startswith(leg.name) for name in names)
        columns = [robot.joints[robot.getJointId(name)].idx_v for name in names]
        assert columns == list(range(18))[leg.velocities]
    joints = np.concatenate([np.arange(12)[leg.joints] for leg in LEGS])
    velocities = np.concatenate([np.arange(18)[leg.velocities] for leg in LEGS])
    np.testing.assert_array_equal(joints, np.arange(12))
    np.testing.assert_array_equal(velocities, np.arange(6, 18))


def test_a_legs_name_says_where_its_hip_is_and_its_mirror_is_across() -> None:
    model = RobotModel()
    for leg in LEGS:
        x, y, _ = model.p_base_hips[leg]
        assert np.sign(y) == leg.side
        assert (x > 0) == leg.is_front
        assert FOOT_NAMES[leg] == leg.foot == f"{leg.name}_foot"
        assert model.pin_model.existFrame(leg.foot)
    for leg in LEGS:
        assert leg.mirror.side == -leg.side
        assert leg.mirror.is_front == leg.is_front
        assert leg.mirror.mirror is leg
