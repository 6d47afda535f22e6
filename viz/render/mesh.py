"""Triangle surfaces: welding, smooth normals with creases, and simplification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

_WELD = 1e-5  # [m] vertices closer than this are one; the exporter repeats them per face
_QUADRIC_REGULARISATION = 0.02  # share of the mean point in a cluster's position; keeps it inside


@dataclass(frozen=True, slots=True)
class SurfaceMesh:
    """An indexed triangle surface in its own frame.

    Attributes:
        points: (n, 3) vertex positions [m].
        normals: (n, 3) outward unit normals; a crease repeats the point with another normal.
        triangles: (m, 3) vertex rows, counter-clockwise seen from outside.
    """

    points: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    triangles: Int[np.ndarray, "m 3"]


def smooth_surface(
    points: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "m 3"], *, crease: float
) -> SurfaceMesh:
    """Weld a triangle soup and give it normals that are smooth except across creases.

    Args:
        points: vertex positions [m], repeated ones allowed.
        triangles: vertex rows.
        crease: faces that meet at a larger angle than this [rad] keep a sharp edge.
    """
    points, triangles = _weld(points, triangles)
    area_normals = _area_normals(points, triangles)
    lengths = np.linalg.norm(area_normals, axis=1)
    triangles, area_normals = triangles[lengths > 0], area_normals[lengths > 0]
    corner_normals = _corner_normals(triangles, area_normals, np.cos(crease))
    corners = triangles.ravel()
    keys = np.column_stack([corners, np.round(corner_normals * 64).astype(np.int64)])
    _, first, rows = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return SurfaceMesh(points[corners[first]], corner_normals[first], rows.reshape(-1, 3))


def simplify(mesh: SurfaceMesh, *, cell: float, crease: float) -> SurfaceMesh:
    """Collapse all vertices within one grid cell into one, placed by quadric error.

    Method: Lindstrom, "Out-of-core simplification of large polygonal models", 2000. Triangles that
    lose a side vanish; those on both sides of a thin sheet survive with opposite orientation.

    Args:
        mesh: the surface.
        cell: edge of the grid cells [m]; features smaller than this disappear.
        crease: see ``smooth_surface``, for the new normals [rad].
    """
    points, triangles = _weld(mesh.points, mesh.triangles)
    cells = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    _, cluster = np.unique(cells, axis=0, return_inverse=True)
    cluster = cluster.ravel()
    new_points = _cluster_points(points, triangles, cluster)
    faces = cluster[triangles]
    distinct = (
        (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    )
    faces = faces[distinct]
    turn = np.argmin(faces, axis=1)
    order = (turn[:, None] + np.arange(3)) % 3
    faces = np.unique(np.take_along_axis(faces, order, axis=1), axis=0)
    return smooth_surface(new_points, faces, crease=crease)


def _weld(
    points: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "m 3"]
) -> tuple[Float[np.ndarray, "k 3"], Int[np.ndarray, "m 3"]]:
    grid = np.round(points / _WELD).astype(np.int64)
    _, first, rows = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return points[first], rows.ravel()[triangles]


def _area_normals(
    points: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "m 3"]
) -> Float[np.ndarray, "m 3"]:
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    return np.cross(b - a, c - a) / 2


def _corner_normals(
    triangles: Int[np.ndarray, "m 3"],
    area_normals: Float[np.ndarray, "m 3"],
    least_cosine: float,
) -> Float[np.ndarray, "k 3"]:
    """One unit normal per triangle corner: the mean of the faces around it within the crease."""
    corners = triangles.ravel()
    order = np.argsort(corners, kind="stable")
    counts = np.bincount(corners)
    starts = np.cumsum(counts) - counts
    per_corner = counts[corners]
    left = np.repeat(np.arange(len(corners)), per_corner)
    within = np.arange(len(left)) - np.repeat(np.cumsum(per_corner) - per_corner, per_corner)
    right = order[starts[corners[left]] + within]
    unit = area_normals / np.linalg.norm(area_normals, axis=1, keepdims=True)
    near = np.einsum("ij,ij->i", unit[left // 3], unit[right // 3]) >= least_cosine - 1e-9
    left, right = left[near], right[near]
    sums = np.column_stack(
        [np.bincount(left, area_normals[right // 3, axis], len(corners)) for axis in range(3)]
    )
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def _cluster_points(
    points: Float[np.ndarray, "n 3"],
    triangles: Int[np.ndarray, "m 3"],
    cluster: Int[np.ndarray, " n"],
) -> Float[np.ndarray, "k 3"]:
    """The point of each cluster closest to the planes of the faces that touch it."""
    count = int(cluster.max()) + 1
    members = np.bincount(cluster, minlength=count)[:, None]
    mean = np.column_stack([np.bincount(cluster, points[:, k], count) for k in range(3)]) / members
    normals = _area_normals(points, triangles)
    areas = np.linalg.norm(normals, axis=1)
    unit = normals / np.maximum(areas, 1e-16)[:, None]
    quadric = np.zeros((count, 3, 3))
    target = np.zeros((count, 3))
    for corner in range(3):
        row = cluster[triangles[:, corner]]
        offset = np.einsum("ij,ij->i", unit, points[triangles[:, corner]] - mean[row])
        np.add.at(quadric, row, areas[:, None, None] * unit[:, :, None] * unit[:, None, :])
        np.add.at(target, row, (areas * offset)[:, None] * unit)
    trace = np.trace(quadric, axis1=1, axis2=2)
    damping = _QUADRIC_REGULARISATION * np.maximum(trace, 1e-12)
    quadric += damping[:, None, None] * np.eye(3)
    return mean + np.linalg.solve(quadric, target[:, :, None])[:, :, 0]
