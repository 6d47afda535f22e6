"""The robot's looks against Pinocchio's own loader and against its mirror image."""

import logging
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import DescriptionError
from go2_wbc.legs import LEGS
from go2_wbc.plant.mujoco.model import JointDynamics, build_spec
from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_description, find_profile, profile_names
from viz.render.mesh import arrow
from viz.render.robot_meshes import PosedRobot, load_robot_visuals, visuals_of

FOOT_RADIUS = find_profile().foot_radius

_MESH_ERROR = 0.002  # [m] the foot's mesh is not exactly the sphere of the contact model
_STAND = np.concatenate([[0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0], np.tile([0.0, 0.8, -1.5], 4)])


def _points_of(link: str) -> np.ndarray:
    visuals = load_robot_visuals()
    data = visuals.model.createData()
    pin.forwardKinematics(visuals.model, data, _STAND)
    frame = visuals.model.getFrameId(link)
    (item,) = [item for item in visuals.geometry.geometryObjects if item.parentFrame == frame]
    T = (data.oMi[item.parentJoint] * item.placement).homogeneous
    local = np.vstack([part.points for part in visuals.meshes[item.meshPath]])
    return local @ T[:3, :3].T + T[:3, 3]


def test_each_mesh_is_loaded_once_and_lies_as_in_pinocchios_own_loader() -> None:
    visuals = load_robot_visuals()
    shown = [item.meshPath for item in visuals.geometry.geometryObjects]
    assert len(shown) == 17
    assert len(visuals.meshes) == 7
    assert sum(path.endswith("hip.dae") for path in shown) == 4
    description = find_description()
    geometry = pin.GeometryModel()
    folders = [str(folder) for folder in description.package_dirs]
    pin.buildGeomFromUrdf(
        visuals.model, str(description.urdf_path), pin.GeometryType.VISUAL, geometry, folders
    )
    for item in geometry.geometryObjects:
        item.geometry.computeLocalAABB()
        box = item.geometry.aabb_local
        points = np.vstack([part.points for part in visuals.meshes[item.meshPath]])
        np.testing.assert_allclose(points.min(axis=0), box.min_.ravel(), atol=2e-5)
        np.testing.assert_allclose(points.max(axis=0), box.max_.ravel(), atol=2e-5)


def test_soles_are_where_contacts_put_them_and_normals_point_out() -> None:
    feet = PosedRobot(load_robot_visuals()).feet(_STAND)
    for leg in LEGS:
        sole = _points_of(leg.foot)[:, 2].min()
        assert sole == pytest.approx(feet[leg, 2] - FOOT_RADIUS, abs=_MESH_ERROR)
    for parts in load_robot_visuals().meshes.values():
        for surface in parts:
            np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1.0)
            corners = surface.points[surface.triangles]
            faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            agree = np.sum(faces * surface.normals[surface.triangles].mean(axis=1), axis=1)
            assert np.mean(agree > 0) > 0.999


def test_the_simplified_robot_has_the_same_size() -> None:
    full = PosedRobot(load_robot_visuals()).at(_STAND)
    coarse = PosedRobot(load_robot_visuals().simplified(0.008)).at(_STAND)
    assert len(coarse.triangles) < 0.5 * len(full.triangles)
    np.testing.assert_allclose(coarse.points.min(axis=0), full.points.min(axis=0), atol=0.008)
    np.testing.assert_allclose(coarse.points.max(axis=0), full.points.max(axis=0), atol=0.008)


def test_an_arrow_is_as_long_as_asked_and_faces_outward() -> None:
    start = np.array([0.1, 0.2, 0.3])
    made = arrow(start, 0.15, 0.006, (1.0, 0.5, 0.0))
    assert made.points[:, 2].min() == pytest.approx(0.3)
    assert made.points[:, 2].max() == pytest.approx(0.45)
    corners = made.points[made.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    solid = np.linalg.norm(faces, axis=1) > 1e-12
    volume = np.einsum("ij,ij->i", faces, corners.mean(axis=1) - start).sum() / 6
    assert volume > 0
    agree = np.sum(faces * made.normals[made.triangles].mean(axis=1), axis=1)
    assert np.all(agree[solid] > 0)


@pytest.mark.parametrize("robot", sorted({*profile_names()} - {"go2"}))
def test_another_robot_is_drawn_as_itself(robot: str, recording: Recording) -> None:
    """Its soles lie where its own legs put them, which are not those of a Go2."""
    visuals = visuals_of(replace(recording, robot=robot))
    posed, radius = PosedRobot(visuals), find_profile(robot).foot_radius
    feet = posed.feet(_STAND)
    assert np.abs(feet - PosedRobot(load_robot_visuals()).feet(_STAND)).max() > 0.005
    lowest = posed.at(_STAND).points[:, 2].min()
    assert lowest == pytest.approx(feet[:, 2].min() - radius, abs=2 * _MESH_ERROR)


@pytest.fixture(scope="module")
def own_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Go2 with its usual looks, a capsule on its back, and frames of its own."""
    spec = build_spec(find_description(), JointDynamics(), friction=0.7, visuals=True)
    box, capsule = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CAPSULE
    base = spec.body("base")
    base.add_geom(type=capsule, size=[0.05, 0.1, 0.0], pos=[0.0, 0.0, 0.2], rgba=[1, 0, 0, 1])
    spec.worldbody.add_geom(type=box, size=[0.1, 0.1, 2.0], pos=[3.0, 0.0, 2.0])
    base.pos, base.quat = [1.0, 2.0, 0.5], [0.6, 0.0, 0.0, 0.8]
    spec.compile()
    path = tmp_path_factory.mktemp("own") / "own.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    return path


def test_a_users_file_is_drawn_with_all_that_it_shows_of_the_robot(
    own_file: Path, recording: Recording
) -> None:
    """The same meshes in the same places as from the URDF, and the capsule; not the world's box."""
    own = PosedRobot(visuals_of(replace(recording, model_file=str(own_file)))).at(_STAND)
    usual = PosedRobot(load_robot_visuals()).at(_STAND)
    assert own.points[:, 2].max() == pytest.approx(0.3 + 0.2 + 0.1 + 0.05, abs=1e-3)
    is_red = (own.colors[:, 0] > 0.99) & (own.colors[:, 1] < 0.2)
    body = own.points[np.unique(own.triangles[~is_red])]
    assert body.min(axis=0) == pytest.approx(usual.points.min(axis=0), abs=1e-3)
    assert body.max(axis=0) == pytest.approx(usual.points.max(axis=0), abs=1e-3)


def test_a_file_that_is_gone_or_broken_is_said(
    tmp_path: Path, recording: Recording, caplog: pytest.LogCaptureFixture
) -> None:
    gone = replace(recording, model_file=str(tmp_path / "gone.xml"))
    with caplog.at_level(logging.WARNING):
        assert visuals_of(gone) is visuals_of(recording)
    assert "gone.xml is gone: the robot is drawn as any go2" in caplog.text
    broken = tmp_path / "broken.xml"
    broken.write_text("<mujoco/>", encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"broken.xml"):
        visuals_of(replace(recording, model_file=str(broken)))
