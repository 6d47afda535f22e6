"""Height of the ground around the robot, cell by cell, as its scans and its feet have found it.

The map is a circular buffer of ``CELLS`` x ``CELLS`` cells, aligned with the axes of the frame in
which the robot's pose is estimated: the cell (i, j) lies in row i mod ``CELLS`` and column j mod
``CELLS``, and stores its index there. So new cells overwrite those left behind, and nothing is
moved.

Each scan measures a cell by the mean z of its points that lie at most ``LAYER`` below its highest,
with the variance r = sigma^2 / n. While z is within ``JUMP`` of the height h with its variance P,
one step of a Kalman filter of a drifting height takes it in (Fankhauser et al., Probabilistic
Terrain Mapping for Mobile Robots With Uncertain Localization, RA-L 2018):

    P <- P + q,    k = P / (P + r),    h <- h + k (z - h),    P <- (1 - k) P

A higher measurement replaces h at once, a lower one after ``DOWNS`` scans in a row: an obstacle for
a foot must not be missed, and a point that slips past an edge is no pit.

The estimated height of the robot drifts; its stance feet measure the drift. Their mean distance
from the map below them shifts the whole map:

    s' = RATE mean(z_foot - r_foot + compression - h - s)

Where nothing is known yet, a stance foot writes the height that it has found.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.linear import plus, put, triple
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.records import Array3, Array3x3, ArrayNx3, Record
from go2_wbc.robot.state import Snapshot

CELL, CELLS = 0.025, 160  #: Side of a cell [m], and how many cells the map is long and wide: 4 m
_STRIDE = 2.0**20  #: Between the names of two rows
LAYER, JUMP, DOWNS = 0.05, 0.05, 4
"""Depth [m] of the points that count, height [m] beyond which a cell has jumped, and the scans in
a row after which a jump down is believed."""
DRIFT = 1.6e-5
"""Variance [m^2] that a scan adds before it is taken in: 4 mm of the height that the robot believes
to have, so that newer scans carry the map along."""
LEAST_VARIANCE = 1e-6  #: Of a scan's point [m^2]: 1 mm
REACH, TALLEST = 1.9, 0.5
"""Distance [m] ahead and aside, and height [m] over the base, beyond which a point is left out: the
map reaches no farther, and what is higher is no ground."""
RATE, STOOD, STILL, ASTRAY = 1.0, 0.04, 0.15, 0.04
"""How fast feet move the map [1/s], how long [s] they must have stood, more slowly than [m/s], and
how near to the map [m]."""
FOOT_VARIANCE, COMPRESSION = 1e-4, 0.004
"""Of what a foot writes [m^2]: 1 cm; and by how much [m] a foot that carries the robot is flatter
than a round one. Without it feet and scans pull the map to and fro."""


class HeightMap(Record):
    """What is known of the ground around the robot."""

    is_used: bool  #: whether there has been a scan
    shift: float  #: what is added to every height [m]; see the module
    stood: Float[np.ndarray, "4"]  #: time [s] for which each foot has stood
    name: Float[np.ndarray, "160 160"]  #: of the cell that a place of the ring holds; 0 for none
    height: Float[np.ndarray, "160 160"]  #: of the cells [m]
    variance: Float[np.ndarray, "160 160"]  #: of the heights [m^2]
    lower: Float[np.ndarray, "160 160"]
    """How many scans in a row have found a cell lower than it is believed."""
    highest: Float[np.ndarray, "160 160"]  #: of a scan's points, while it is taken in
    total: Float[np.ndarray, "160 160"]  #: of the same
    count: Float[np.ndarray, "160 160"]  #: of the same


@subroutine
def cell_of(x: float, y: float) -> tuple[int, int, float]:
    """Row and column in the ring of the cell at a place [m], and its name."""
    i, j = np.floor(x / CELL), np.floor(y / CELL)
    return int(i) % CELLS, int(j) % CELLS, i * _STRIDE + j + 0.5


@subroutine
def height_at(m: HeightMap, x: float, y: float) -> float:
    """Height [m] of the ground there, nan where nothing is known."""
    row, column, name = cell_of(x, y)
    return m.height[row, column] + m.shift if m.name[row, column] == name else np.nan


@kernel
def heights_at(m: HeightMap, places: Float[np.ndarray, "n 2"], z: Float[np.ndarray, " n"]) -> None:
    """Fill the heights [m] at many places, nan where nothing is known."""
    for n in range(places.shape[0]):
        z[n] = height_at(m, places[n, 0], places[n, 1])


def cells(m: HeightMap) -> Float[np.ndarray, "n 3"]:
    """Middles of all cells that are known [m]."""
    known = m.name[m.name != 0.0] - 0.5
    i = np.round(known / _STRIDE)  # j may be negative
    xy = CELL * (np.column_stack([i, known - i * _STRIDE]) + 0.5)
    return np.column_stack([xy, m.height[m.name != 0.0] + m.shift])


@subroutine
def take_in(m: HeightMap, row: int, column: int, name: float, z: float, r: float) -> None:
    """Take in a height [m], less the shift, that was measured of a cell with a variance [m^2]."""
    off = z - m.height[row, column]
    is_new = m.name[row, column] != name
    if not is_new and off < -JUMP:
        m.lower[row, column] += 1.0
        if m.lower[row, column] < DOWNS:
            return
    if is_new or abs(off) > JUMP:
        m.name[row, column], m.height[row, column], m.variance[row, column] = name, z, r
    else:
        p = m.variance[row, column] + DRIFT
        m.height[row, column] += p / (p + r) * off
        m.variance[row, column] = p * r / (p + r)
    m.lower[row, column] = 0.0


@kernel
def fuse(
    m: HeightMap,
    p_base_points: Foreign[ArrayNx3],
    p_world_base: Array3,
    R_world_base: Array3x3,
    deviation: float,
) -> None:
    """Take in a scan.

    Args:
        p_base_points: where its rays have met something, in the base frame [m].
        p_world_base, R_world_base: pose of the base when it was taken.
        deviation: of a point's height [m].
    """
    points, kept, R = np.empty(p_base_points.shape), 0, R_world_base
    for n in range(p_base_points.shape[0]):
        for i in range(3):
            points[kept, i] = 0.0
            for k in range(3):
                points[kept, i] += R[i, k] * p_base_points[n, k]
        x, y, z = triple(points[kept])
        if max(abs(x), abs(y)) < REACH and z < TALLEST:
            put(plus((x, y, z - m.shift), triple(p_world_base)), points[kept])
            row, column, _ = cell_of(points[kept, 0], points[kept, 1])
            m.highest[row, column] = -np.inf
            m.total[row, column] = m.count[row, column] = 0.0
            kept += 1
    for n in range(kept):
        row, column, _ = cell_of(points[n, 0], points[n, 1])
        m.highest[row, column] = max(m.highest[row, column], points[n, 2])
    for n in range(kept):
        row, column, _ = cell_of(points[n, 0], points[n, 1])
        if points[n, 2] >= m.highest[row, column] - LAYER:
            m.total[row, column] += points[n, 2]
            m.count[row, column] += 1.0
    r = max(deviation * deviation, LEAST_VARIANCE)
    for n in range(kept):
        row, column, name = cell_of(points[n, 0], points[n, 1])
        hits = m.count[row, column]
        if hits > 0.0:
            take_in(m, row, column, name, m.total[row, column] / hits, r / hits)
            m.count[row, column] = 0.0
    m.is_used = True


@kernel
def feel(
    m: HeightMap,
    now: Snapshot,
    contact: Foreign[Bool[np.ndarray, "4"]],
    dt: float,
) -> None:
    """Take in the feet that stand, ``dt`` seconds after the last time."""
    off, count = 0.0, 0
    for leg in range(4):
        p, v = now.p_world_feet[leg], now.v_world_feet[leg]
        speed = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        m.stood[leg] = m.stood[leg] + dt if contact[leg] and speed < STILL else 0.0
        if m.stood[leg] < STOOD:
            continue
        z = p[2] - now.foot_radius + COMPRESSION
        known = height_at(m, p[0], p[1])
        if np.isnan(known):
            for i in range(-1, 2):
                for j in range(-1, 2):
                    row, column, name = cell_of(p[0] + i * CELL, p[1] + j * CELL)
                    if m.name[row, column] != name:
                        take_in(m, row, column, name, z - m.shift, FOOT_VARIANCE)
        elif abs(z - known) < ASTRAY:
            off += z - known
            count += 1
    if count > 0:
        m.shift += min(RATE * dt, 1.0) * off / count
