"""Triangle surfaces: smooth normals with creases, simplification, arrows, and their pixels.

A z-buffer rasteriser in numpy tells the pixels: triangles in, per-pixel winners out. No GPU, no
system library.

All triangles of a picture are scan-converted at once (Foley et al., "Computer Graphics", 2nd ed.,
section 3.6): first to rows, then to pixels, each as one flat array, so the cost is that of the
pixels and not of a Python loop. The nearest triangle wins (z-buffer: Catmull 1974).
"""

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
    """Coloured triangles."""

    points: Float[np.ndarray, "n 3"]  #: (n, 3) vertex positions [m]
    normals: Float[np.ndarray, "n 3"]
    """(n, 3) outward unit normals; a crease repeats the point with another normal."""
    triangles: Int[np.ndarray, "m 3"]  #: (m, 3) vertex rows, counter-clockwise seen from outside
    colors: Float[np.ndarray, "m 3"]  #: (m, 3) red, green, blue of each triangle in 0..1

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


_LEAST_AREA = 1e-9  # [px^2] flatter triangles have no inside
_COVERAGE_SLACK = 1e-6  # [px] samples this close to an edge count, so that no crack opens


def rasterize(
    points: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "m 3"], size: tuple[int, int]
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """The samples that are covered, and the row of the triangle that is in front at each.

    A sample is known by its flat index, row * width + column.

    A sample lies at the centre of its pixel. Of two triangles the one with the larger third
    coordinate is in front; give 1 / distance, which is linear in the picture where distance is
    not (Blinn, "Hyperbolic interpolation", 1992).

    Args:
        points: x (right) and y (down) in pixels, and nearness (> 0, larger is closer).
        triangles: rows of ``points``, counter-clockwise as seen (with y pointing up); the others
            are seen from behind, and dropped.
        size: width and height [px].
    """
    width, height = size
    corners = triangles.T
    x, y = points[:, 0][corners], points[:, 1][corners]
    top = np.maximum(np.ceil(np.minimum(np.minimum(y[0], y[1]), y[2]) - 0.5), 0)
    bottom = np.minimum(np.floor(np.maximum(np.maximum(y[0], y[1]), y[2]) - 0.5), height - 1)
    kept = np.flatnonzero((_doubled_area(x, y) > _LEAST_AREA) & (top <= bottom))
    x, y, top = x[:, kept], y[:, kept], top[kept].astype(np.int64)
    counts = bottom[kept].astype(np.int64) - top + 1
    triangle, row = np.repeat(np.arange(len(kept)), counts), _expand(top, counts)
    first, last = _spans(x, y, triangle, row, width)
    covered = np.flatnonzero(last >= first)
    triangle, row, first, last = (values[covered] for values in (triangle, row, first, last))
    step_x, step_y, start = plane_coefficients(x, y, points[:, 2][corners[:, kept]])
    at_row = start[triangle] + step_y[triangle] * (row + 0.5)
    column = _expand(first, last - first + 1)
    run = np.repeat(np.arange(len(row)), last - first + 1)
    nearness = at_row.astype(np.float32)[run] + step_x[triangle].astype(np.float32)[run] * (
        column.astype(np.float32) + np.float32(0.5)
    )
    pixel = (row * width)[run] + column
    return _resolve(pixel, nearness, kept[triangle].astype(np.int32)[run], width * height)


def _doubled_area(
    x: Float[np.ndarray, "3 m"], y: Float[np.ndarray, "3 m"]
) -> Float[np.ndarray, " m"]:
    """Twice the area of each triangle [px^2], positive if counter-clockwise (with y up).

    The edge function of the side 0-1 at corner 2 (Pineda, "A parallel algorithm for polygon
    rasterization", 1988): its sign says on which side of an edge a point lies.
    """
    return (x[2] - x[0]) * (y[1] - y[0]) - (x[1] - x[0]) * (y[2] - y[0])


def plane_coefficients(
    x: Float[np.ndarray, "3 m"], y: Float[np.ndarray, "3 m"], value: Float[np.ndarray, "3 m"]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Slopes along x and y, and value at the origin, of the plane through three corner values.

    From value[k] - value[0] = slope_x (x[k] - x[0]) + slope_y (y[k] - y[0]) for k = 1, 2 by
    Cramer's rule, whose determinant is twice the area; ``x`` and ``y`` are columns and rows [px].
    """
    area = _doubled_area(x, y)
    d1, d2 = value[1] - value[0], value[2] - value[0]
    slope_x = (d2 * (y[1] - y[0]) - d1 * (y[2] - y[0])) / area
    slope_y = (d1 * (x[2] - x[0]) - d2 * (x[1] - x[0])) / area
    return slope_x, slope_y, value[0] - slope_x * x[0] - slope_y * y[0]


def _spans(
    x: Float[np.ndarray, "3 m"],
    y: Float[np.ndarray, "3 m"],
    triangle: Int[np.ndarray, " r"],
    row: Int[np.ndarray, " r"],
    width: int,
) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, " r"]]:
    """First and last column that each triangle covers in its rows, clipped to the picture.

    At the height y an edge a-b is crossed at x = x_a + (y - y_a) (x_b - x_a) / (y_b - y_a). Edges
    that rise bound a row of a triangle on one side, those that fall on the other.
    """
    low = np.full(len(row), -np.inf)
    high = np.full(len(row), np.inf)
    centre = row + 0.5
    for a, b in ((0, 1), (1, 2), (2, 0)):
        rise = y[b] - y[a]
        slope = (x[b] - x[a]) / np.where(rise == 0, 1.0, rise)
        start = x[a] - y[a] * slope
        crossing = start[triangle] + centre * slope[triangle]
        side = rise[triangle]
        np.maximum(low, crossing, out=low, where=side > 0)
        np.minimum(high, crossing, out=high, where=side < 0)
    first = np.clip(np.ceil(low - 0.5 - _COVERAGE_SLACK), 0, width).astype(np.int64)
    last = np.clip(np.floor(high - 0.5 + _COVERAGE_SLACK), -1, width - 1).astype(np.int64)
    return first, last


def _expand(first: Int[np.ndarray, " r"], count: Int[np.ndarray, " r"]) -> Int[np.ndarray, " k"]:
    """Concatenate the integer ranges first[i], first[i] + 1, ... of length count[i]."""
    offset = np.repeat(first - (np.cumsum(count) - count), count)
    return offset + np.arange(len(offset))


def _resolve(
    pixel: Int[np.ndarray, " k"],
    nearness: Float[np.ndarray, " k"],
    triangle: Int[np.ndarray, " k"],
    samples: int,
) -> tuple[Int[np.ndarray, " v"], Int[np.ndarray, " v"]]:
    """Keep the nearest candidate of each sample; among equals the last triangle."""
    nearest = np.zeros(samples, dtype=np.float32)
    np.maximum.at(nearest, pixel, nearness)
    front = nearness >= nearest[pixel]
    winner = np.full(samples, -1, dtype=np.int32)
    winner[pixel[front]] = triangle[front]
    seen = np.flatnonzero(winner >= 0)
    return seen, winner[seen]
