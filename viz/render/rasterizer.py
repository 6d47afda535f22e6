"""A z-buffer rasteriser in numpy: triangles in, per-pixel winners out. No GPU, no system library.

All triangles of a picture are scan-converted at once (Foley et al., "Computer Graphics", 2nd ed.,
section 3.6): first to rows, then to pixels, each as one flat array, so the cost is that of the
pixels and not of a Python loop. The nearest triangle wins (z-buffer: Catmull 1974).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

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
