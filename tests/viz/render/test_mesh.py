"""Welding, normals and simplification on shapes that are known in closed form."""

import numpy as np
import trimesh

from viz.render.mesh import simplify, smooth_surface

_CREASE = np.deg2rad(40.0)
_RED = np.array([1.0, 0.0, 0.0])


def test_a_cube_keeps_its_sharp_edges_and_a_sphere_becomes_smooth() -> None:
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    soup = box.vertices[box.faces].reshape(-1, 3)
    surface = smooth_surface(soup, np.arange(36).reshape(12, 3), _RED, crease=_CREASE)
    assert len(surface.points) == 24
    np.testing.assert_allclose(np.abs(surface.normals).max(axis=1), 1.0)
    assert np.all(np.sum(surface.points * surface.normals, axis=1) > 0.09)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    soup = ball.vertices[ball.faces].reshape(-1, 3)
    surface = smooth_surface(soup, np.arange(len(soup)).reshape(-1, 3), _RED, crease=_CREASE)
    assert len(surface.points) == len(ball.vertices)
    radial = surface.points / np.linalg.norm(surface.points, axis=1, keepdims=True)
    assert np.min(np.sum(radial * surface.normals, axis=1)) > 0.999


def test_simplification_keeps_the_shape_and_both_sides_of_a_thin_sheet() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    fine = smooth_surface(ball.vertices, ball.faces, _RED, crease=_CREASE)
    coarse = simplify(fine, cell=0.012, crease=_CREASE)
    assert len(coarse.triangles) < len(fine.triangles) / 5
    np.testing.assert_array_equal(coarse.colors, [_RED] * len(coarse.triangles))
    radii = np.linalg.norm(coarse.points, axis=1)
    np.testing.assert_allclose(radii, 0.1, atol=0.001)
    sheet = trimesh.creation.box((0.3, 0.3, 0.002)).subdivide().subdivide().subdivide()
    coarse = simplify(
        smooth_surface(sheet.vertices, sheet.faces, _RED, crease=_CREASE), cell=0.05, crease=_CREASE
    )
    corners = coarse.points[coarse.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.count_nonzero(normals[:, 2] > 1e-6) > 10
    assert np.count_nonzero(normals[:, 2] < -1e-6) > 10
