"""The robot's looks against Pinocchio's own loader and against its mirror image."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.legs import LEGS
from go2_wbc.robot.description import find_description
from go2_wbc.robot.profile import find_profile
from viz.render.mesh import arrow
from viz.render.robot_meshes import PosedRobot, load_robot_visuals

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


def test_each_mesh_is_loaded_once_and_shared_by_the_legs() -> None:
    visuals = load_robot_visuals()
    shown = [item.meshPath for item in visuals.geometry.geometryObjects]
    assert len(shown) == 17
    assert len(visuals.meshes) == 7
    assert sum(path.endswith("hip.dae") for path in shown) == 4


def test_every_mesh_lies_as_in_pinocchios_own_loader() -> None:
    visuals = load_robot_visuals()
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


def test_the_sole_of_each_foot_is_where_the_contact_model_puts_it() -> None:
    feet = PosedRobot(load_robot_visuals()).feet(_STAND)
    for leg in LEGS:
        sole = _points_of(leg.foot)[:, 2].min()
        assert sole == pytest.approx(feet[leg, 2] - FOOT_RADIUS, abs=_MESH_ERROR)


def test_normals_are_unit_and_point_out_of_the_faces() -> None:
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
