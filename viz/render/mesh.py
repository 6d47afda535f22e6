"""Triangle surfaces: smooth normals with creases, simplification, and arrows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import trimesh
from jaxtyping import Float, Int

_WELD_DIGITS = 5  # [10 um] vertices that round to the same are one; the exporter repeats them
_ARROW_SIDES, _ARROW_CREASE = 12, np.deg2rad(40.0)  # the 30 deg between its sides look round
_HEAD_WIDTH, _HEAD_LENGTH = 2.4, 4.5  # radius and length of an arrow's head over its shaft's radius
_QUADRIC_REGULARISATION = 0.02  # share of the mean point in a cluster's position; keeps it inside


@dataclass(frozen=True, slots=True)
class Surface:
    """Coloured triangles.

    Attributes:
        points: (n, 3) vertex positions [m].
        normals: (n, 3) outward unit normals; a crease repeats the point with another normal.
        triangles: (m, 3) vertex rows, counter-clockwise seen from outside.
        colors: (m, 3) red, green, blue of each triangle in 0..1.
    """

    points: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    triangles: Int[np.ndarray, "m 3"]
    colors: Float[np.ndarray, "m 3"]

    @staticmethod
    def joined(parts: Sequence[Surface]) -> Surface:
        """All triangles of several surfaces as one."""
        offsets = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
        return Surface(
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.triangles + o for part, o in zip(parts, offsets, strict=True)]),
            np.concatenate([part.colors for part in parts]),
        )

    def placed(self, T: pin.SE3) -> Surface:
        """The same surface in another frame, in which its own has the pose ``T``."""
        R = T.rotation.T
        return replace(self, points=self.points @ R + T.translation, normals=self.normals @ R)


def smooth_surface(
    points: Float[np.ndarray, "n 3"],
    triangles: Int[np.ndarray, "m 3"],
    color: Float[np.ndarray, "3"],
    *,
    crease: float,
) -> Surface:
    """Weld a triangle soup and give it normals that are smooth except across creases.

    The surface is cut into patches along its creases, and a vertex has the mean normal of the
    faces of its patch that meet there, weighted by their angles at it.

    Args:
        points: vertex positions [m], repeated ones allowed.
        triangles: vertex rows.
        color: red, green, blue in 0..1.
        crease: faces that meet at a larger angle than this [rad] keep a sharp edge.
    """
    mesh = _welded(points, triangles)
    mesh.update_faces(mesh.nondegenerate_faces())
    patches = trimesh.graph.smooth_shade(mesh, angle=crease, facet_minarea=None)
    return Surface(
        np.array(patches.vertices),
        np.array(patches.vertex_normals),
        np.array(patches.faces),
        np.tile(color, (len(patches.faces), 1)),
    )


def simplify(mesh: Surface, *, cell: float, crease: float) -> Surface:
    """Collapse all vertices within one grid cell into one, placed by quadric error.

    Vertex clustering (Rossignac and Borrel, "Multi-resolution 3D approximations for rendering
    complex scenes", 1993) with the representative of Lindstrom, "Out-of-core simplification of
    large polygonal models", 2000: one pass, robust to meshes that are no closed manifolds, which
    the robot's are not. Triangles that lose a side vanish; those on both sides of a thin sheet
    survive with opposite orientation.

    Args:
        mesh: the surface, of one colour.
        cell: edge of the grid cells [m]; features smaller than this disappear.
        crease: see ``smooth_surface``, for the new normals [rad].
    """
    welded = _welded(mesh.points, mesh.triangles)
    cells = np.floor((welded.vertices - welded.vertices.min(axis=0)) / cell).astype(np.int64)
    _, cluster = np.unique(cells, axis=0, return_inverse=True)
    cluster = cluster.ravel()
    faces = cluster[welded.faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    # Every triangle once: turned so that its lowest row leads, which keeps its orientation.
    order = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3
    faces = np.unique(np.take_along_axis(faces, order, axis=1), axis=0)
    points = _cluster_points(welded, cluster)
    return smooth_surface(points, faces, mesh.colors[0], crease=crease)


def _welded(points: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "m 3"]) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(points, triangles, process=False)
    mesh.merge_vertices(digits_vertex=_WELD_DIGITS)
    return mesh


def _cluster_points(
    mesh: trimesh.Trimesh, cluster: Int[np.ndarray, " n"]
) -> Float[np.ndarray, "k 3"]:
    """The point of each cluster closest to the planes of the faces that touch it.

    A face with the unit normal n, the area a and a corner c is seen from x at the distance
    n . (x - c). The sum of a (n . (x - c))^2 over the faces (their error quadric: Garland and
    Heckbert, "Surface simplification using quadric error metrics", 1997) is least where
    (sum a n n') (x - m) = sum a (n . (c - m)) n, here about the cluster's mean m: the pull
    towards it, a share of the quadric's trace, decides where the planes leave x free.
    """
    count = int(cluster.max()) + 1
    points, triangles = mesh.vertices.view(np.ndarray), mesh.faces.view(np.ndarray)
    members = np.bincount(cluster, minlength=count)[:, None]
    mean = np.column_stack([np.bincount(cluster, points[:, k], count) for k in range(3)]) / members
    areas = mesh.area_faces
    unit = mesh.triangles_cross / np.maximum(2 * areas, 1e-16)[:, None]
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


def arrow(
    start: Float[np.ndarray, "3"], length: float, radius: float, color: tuple[float, float, float]
) -> Surface:
    """An upright arrow of this length [m] from ``start``; ``radius`` [m] is that of its shaft."""
    neck, wide = length - min(_HEAD_LENGTH * radius, 0.6 * length), _HEAD_WIDTH * radius
    profile = [(0.0, 0.0), (radius, 0.0), (radius, neck), (wide, neck), (0.0, length)]
    solid = trimesh.creation.revolve(profile, sections=_ARROW_SIDES)
    return smooth_surface(
        solid.vertices + start, solid.faces, np.array(color), crease=_ARROW_CREASE
    )
