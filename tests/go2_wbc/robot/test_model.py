"""The robot model: limits, masses and kinematics, and which descriptions it refuses."""

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import DescriptionError
from go2_wbc.legs import FOOT_NAMES, LEGS
from go2_wbc.robot.description import find_description, find_profile
from go2_wbc.robot.model import FINGERPRINT, RobotModel, fingerprint
from tests.engine_helpers import random_state

HIP_LIMIT = find_profile().hip_limit
FOOT_RADIUS = find_profile().foot_radius

EXACT = 1e-12  # rounding of numbers of order one
MESH_TOLERANCE = 1e-3  # [m]; the fitted sphere has 22.9 mm and sits 2.6 mm behind the frame
GO2_MASS = 16.085  # [kg] the sum over the URDF's links


MODEL = RobotModel()


def installed_urdf() -> str:
    return find_description().urdf_path.read_text(encoding="utf-8")


def described(tmp_path: Path, text: str) -> RobotModel:
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return RobotModel(find_description(path))


def test_mass_torques_and_speeds_are_the_robots() -> None:
    links = re.findall(r'<mass\s+value="([^"]+)"', installed_urdf())
    assert MODEL.mass == pytest.approx(sum(map(float, links)), abs=1e-9)
    assert MODEL.mass == pytest.approx(GO2_MASS, abs=1e-3)
    assert MODEL.gravity == 9.81
    np.testing.assert_allclose(MODEL.torque_limits, MODEL.description.efforts)
    np.testing.assert_allclose(MODEL.speed_limits, MODEL.description.speeds)


def test_the_limits_are_the_tighter_of_published_ones_and_those_of_any_urdf(tmp_path: Path) -> None:
    robot = pin.buildModelFromUrdf(str(find_description().urdf_path), pin.JointModelFreeFlyer())
    lower, upper = robot.lowerPositionLimit[7:], robot.upperPositionLimit[7:]
    hips, others = np.arange(12) % 3 == 0, np.arange(12) % 3 != 0
    assert (np.abs([lower[hips], upper[hips]]) > HIP_LIMIT).all()
    np.testing.assert_array_equal(MODEL.q_lower[hips], -HIP_LIMIT)
    np.testing.assert_array_equal(MODEL.q_upper[hips], HIP_LIMIT)
    np.testing.assert_array_equal(MODEL.q_lower[others], lower[others])
    np.testing.assert_array_equal(MODEL.q_upper[others], upper[others])
    narrow = described(tmp_path, installed_urdf().replace("1.0472", "0.5"))
    np.testing.assert_array_equal(narrow.q_upper[0::3], 0.5)
    np.testing.assert_array_equal(narrow.q_lower[0::3], -0.5)


def test_the_hips_and_nominal_feet_lie_symmetrically_below_the_trunk() -> None:
    q = np.concatenate([np.zeros(6), [1.0], np.zeros(12)])
    _, feet = MODEL.forward_kinematics(q)
    np.testing.assert_allclose(MODEL.p_base_feet_nominal[:, :2], feet[:, :2], atol=1e-9)
    mirror = [leg.mirror for leg in LEGS]
    for points in (MODEL.p_base_hips, MODEL.p_base_feet_nominal):
        np.testing.assert_allclose(points[mirror], points * [1.0, -1.0, 1.0], atol=EXACT)


@pytest.mark.parametrize("seed", range(10))
def test_forward_kinematics_is_pinocchios(seed: int) -> None:
    robot, q = MODEL.pin_model, random_state(np.random.default_rng(seed)).q
    data = robot.createData()
    pin.framesForwardKinematics(robot, data, q)
    com, feet = MODEL.forward_kinematics(q)
    np.testing.assert_allclose(com, pin.centerOfMass(robot, data, q), atol=EXACT)
    for name, foot in zip(FOOT_NAMES, feet, strict=True):
        np.testing.assert_allclose(foot, data.oMf[robot.getFrameId(name)].translation, atol=EXACT)


def test_the_rotors_add_their_inertia_to_the_diagonal_of_the_joints_only() -> None:
    state = random_state(np.random.default_rng(2))
    geared = RobotModel().snapshot(state).mass_matrix
    bare = RobotModel(armature=np.zeros(12)).snapshot(state).mass_matrix
    expected = np.diag(np.concatenate([np.zeros(6), np.tile(find_profile().armature, 4)]))
    np.testing.assert_allclose(geared - bare, expected, atol=EXACT)


def test_the_foot_mesh_is_nearly_a_sphere_of_the_foot_radius() -> None:
    meshes = pin.buildGeomFromUrdf(
        MODEL.pin_model,
        str(MODEL.description.urdf_path),
        pin.GeometryType.COLLISION,
        package_dirs=[str(path) for path in MODEL.description.package_dirs],
    )
    feet = [mesh for mesh in meshes.geometryObjects if mesh.name.rsplit("_", 1)[0] in FOOT_NAMES]
    assert len(feet) == len(LEGS)
    for mesh in feet:
        points = mesh.geometry.vertices()
        sphere = np.linalg.lstsq(
            np.column_stack([2 * points, np.ones(len(points))]), (points**2).sum(axis=1)
        )[0]
        centre, radius = sphere[:3], np.sqrt(sphere[3] + sphere[:3] @ sphere[:3])
        assert radius == pytest.approx(FOOT_RADIUS, abs=MESH_TOLERANCE)
        frame = MODEL.pin_model.frames[MODEL.pin_model.getFrameId(mesh.name.rsplit("_", 1)[0])]
        offset = frame.placement.actInv(mesh.placement.act(centre))
        np.testing.assert_allclose(offset, 0.0, atol=3 * MESH_TOLERANCE)


def test_a_missing_urdf_or_one_that_pinocchio_cannot_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match=r"nowhere\.urdf"):
        RobotModel(find_description(tmp_path / "nowhere.urdf"))
    broken = installed_urdf().replace('<parent link="FL_hip"', '<parent link="nothing"')
    with pytest.raises(DescriptionError, match=r"cannot read the URDF .*robot\.urdf"):
        described(tmp_path, broken)


def test_a_robot_with_one_joint_more_is_refused_with_the_names(tmp_path: Path) -> None:
    arm = (
        '<link name="arm"/><joint name="arm_joint" type="revolute"><parent link="base"/>'
        '<child link="arm"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    with pytest.raises(DescriptionError, match=r"has joints .*arm_joint.*; expected .*FL_hip"):
        described(tmp_path, installed_urdf().replace("</robot>", arm))


def changed(mass: float) -> RobotModel:
    model = RobotModel()
    model.pin_model.inertias[1].mass += mass
    return model


def test_models_of_the_same_robot_have_the_same_fingerprint_and_another_one_another() -> None:
    own = fingerprint(RobotModel())
    assert len(own) == FINGERPRINT
    assert own == fingerprint(RobotModel())
    assert own == fingerprint(changed(1e-12))  # as another library's rounding does
    model = RobotModel()
    assert model.pin_model.armature[0] == 0.0
    model.pin_model.armature[0] = -0.0
    assert own == fingerprint(model)
    models = [
        RobotModel(),
        changed(1e-3),
        RobotModel(armature=np.full(12, 0.01)),
        RobotModel(foot_radius=0.023),
    ]
    assert len({fingerprint(model) for model in models}) == len(models)
