"""What a walk takes from the height map: the plane below the trunk, its speed, and where it stops.

The plane z = h + s (p - p_com) fits, by least squares, the known ground from ``BEHIND`` to
``AHEAD`` of the CoM and ``ASIDE``, and with ``LANDING_WEIGHT`` the last foothold of each foot. Pits
and walls, on which no foot stands, are left out. The plane is fitted, and the path ahead checked,
every ``AGAIN`` seconds. The trunk approaches the plane with the time constant ``SMOOTH_TIME``.
Uphill, the trunk has the pitch of the plane; downhill it is higher, so that the calves clear the
edges behind their feet.

Where the ground has steps of more than ``UNEVEN`` the feet are placed and swung by the map
(``sighted_steps``), at ``SPEED`` and with ``gait_clock.SEEN_STRIDE``.

Along three lines, of the feet and of the middle, possible footholds are followed ahead over the
map: from the last place where a foot could stand, ``FOOT_CELLS`` even cells in a row, at height h,
to the next one with |z - h| <= ``GREATEST_STEP``. A cell that is higher ends the path, and so does
a hole longer than ``GREATEST_GAP``. The speed towards that end, d from the CoM, is at most sqrt(2 a
(d - d_stop)); at d_stop the robot has stopped.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.planning.ground import FOLLOW, Ground
from go2_wbc.planning.height_map import CELL, HeightMap, height_at
from go2_wbc.records import V3, Array3, Record
from go2_wbc.robot.state import Snapshot

BEHIND, AHEAD, ASIDE, GRID = -0.35, 0.45, 0.225, 0.05
"""Ground [m] that the plane fits, from the CoM, and the distance of its samples."""
LANDING_WEIGHT = 3.0  #: Of a landing, beside that of a sample
LEAST_KNOWN = 0.5  #: Share of the samples that must be known
STEEPEST = 0.75  #: Greatest slope that is believed: that of stairs of 23 cm
AGAIN, SMOOTH_TIME = 0.02, 0.12
"""Time [s] between two looks, and time constant [s] with which the trunk follows the plane."""
PIT = 0.24  #: Height [m] below, or above, all feet from which on ground is none to stand on
UNEVEN, UNEVEN_WAY = 0.04, 0.4
"""Height [m] of a step on ``GRID`` from which on ground is uneven, and for how far [m] that is
remembered."""
LOOK = 1.1  #: How far ahead [m] uneven ground counts
SPEED, FLIGHT_SPEED = 0.43, 0.32  #: Greatest speed [m/s] on it, and on a flight of stairs: of
FLIGHT, FLIGHT_STEP = 3, 0.13  #: so many steps in sight, and higher than that [m]
LOWERED, LIFT, LIFT_RATE = 0.15, 0.045, 0.1
"""Fall of the way, per metre, from which on it leads down; by how much [m] the trunk is higher on
it, and how fast [m/s] it comes there."""
GREATEST_STEP, GREATEST_GAP = 0.24, 0.38
"""Height [m] of a step and length [m] of a hole that the robot does not try."""
EVEN, FOOT_CELLS = 0.04, 3
"""Cells in a row that a foot needs, and the height [m] by which two of them may differ."""
FAR, LINE, MOVED_ASIDE = 1.15, 0.15, 0.1
"""How far ahead [m] its way is looked along, how far aside [m] the feet go, and how far from there
they can be put."""
STOP, BRAKING = 0.60, 0.5
"""Distance [m] of the CoM from the end of its way at which it has stopped, and the deceleration
[m/s^2] of what it is told."""
NEAR_STOP, CERTAIN = 0.03, 0.7
"""Distance [m] from there at which it counts as stopped, and time [s] after which it says so: the
first step down of a flight is seen later than the second."""
RISE, DROP = 1.0, 2.0  #: What ends a way: a step up or a wall, or a gap or a step down
_TINY = 1e-9


class Sight(Record):
    """What a walk has seen."""

    since: float  #: for how long [s] it has not looked
    sees: bool  #: whether the ground below the trunk is known
    plane: Array3  #: height [m] below the CoM and slope of the ground
    most: float  #: greatest speed [m/s] that the way permits
    uneven_way: float  #: for how far [m] the ground is taken for uneven yet
    lift: float  #: height [m] by which the trunk is carried higher
    blocked: float  #: what ends the way ahead, 0 for nothing
    end: float  #: how far ahead [m] of the CoM that is
    stopped: float  #: for how long [s] it has been so near that the robot has stopped
    is_slowed: bool  #: whether the robot is told less than it was asked for

    @property
    def why_blocked(self) -> str:
        """What the robot stands in front of, in plain words; "" if it may go on."""
        if self.stopped < CERTAIN:
            return ""
        drop = f"a gap of more than {GREATEST_GAP:g} m or a step down of more than"
        what = "a wall or a step up of more than" if self.blocked == RISE else drop
        return f"{what} {GREATEST_STEP:g} m, {self.end:.2f} m ahead"


@subroutine
def steps_by_sight(sight: Sight) -> bool:
    """Whether feet are placed by the map."""
    return sight.sees and sight.uneven_way > 0.0


@subroutine
def fitted_plane(
    g: Ground, m: HeightMap, x: float, y: float, yaw: float, foot_radius: float, plane: Array3
) -> bool:
    """Fill height [m] and slope at a place, by the map; False where too little is known."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    lowest, highest = np.min(g.p_met[:, 2]) - PIT, np.max(g.p_met[:, 2]) + PIT
    rows = int((AHEAD - BEHIND) / GRID + 1.5)
    columns = int(2.0 * ASIDE / GRID + 1.5)
    w = xs = ys = zs = xx = xy = yy = xz = yz = 0.0
    known = 0
    for n in range(rows * columns + 4):
        weight = 1.0
        if n < rows * columns:
            ahead, left = BEHIND + (n // columns) * GRID, (n % columns) * GRID - ASIDE
            dx, dy = cosine * ahead - sine * left, sine * ahead + cosine * left
            z = height_at(m, x + dx, y + dy)
            if np.isnan(z):
                continue
            known += 1
            if not lowest < z < highest:
                continue
        else:
            foot, weight = g.p_met[n - rows * columns], LANDING_WEIGHT
            dx, dy, z = foot[0] - x, foot[1] - y, foot[2] - foot_radius
        w += weight
        xs += weight * dx
        ys += weight * dy
        zs += weight * z
        xx += weight * dx * dx
        xy += weight * dx * dy
        yy += weight * dy * dy
        xz += weight * dx * z
        yz += weight * dy * z
    if known < LEAST_KNOWN * rows * columns:
        return False
    xx, xy, yy = xx - xs * xs / w, xy - xs * ys / w, yy - ys * ys / w
    xz, yz = xz - xs * zs / w, yz - ys * zs / w
    determinant = max(xx * yy - xy * xy, _TINY)
    a, b = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    share = min(1.0, STEEPEST / max(np.hypot(a, b), _TINY))
    plane[1], plane[2] = share * a, share * b
    plane[0] = (zs - plane[1] * xs - plane[2] * ys) / w
    return True


@subroutine
def unevenness(
    m: HeightMap, x: float, y: float, way: V3, plane: Array3
) -> tuple[float, float, int]:
    """Mean distance [m] of the ground from the plane, and steps along a way: highest and how many.

    ``way``: the direction ahead, and how far it is looked along [m].
    """
    total, known, highest, most = 0.0, 0, 0.0, 0
    steps = int((way[2] - BEHIND) / GRID)
    for line in range(-1, 2):
        before, rise, count = np.nan, 0.0, 0
        for n in range(steps):
            ahead, left = BEHIND + n * GRID, line * LINE
            dx, dy = way[0] * ahead - way[1] * left, way[1] * ahead + way[0] * left
            off = height_at(m, x + dx, y + dy) - plane[0] - plane[1] * dx - plane[2] * dy
            if ahead <= AHEAD and not np.isnan(off):
                total += abs(off)
                known += 1
            if abs(off - before) > UNEVEN:  # never if either is unknown
                count = count + 1 if rise == 0.0 else count
                rise += off - before
                highest = max(highest, abs(rise))
            else:
                rise = 0.0
            before = off
        most = max(most, count)
    return total / max(known, 1), highest, most


@subroutine
def beside(m: HeightMap, x: float, y: float, way: V3, off: tuple[float, float]) -> float:
    """Height [m] of the ground so far ahead and aside of a way."""
    ahead, left = off
    return height_at(m, x + way[0] * ahead - way[1] * left, y + way[1] * ahead + way[0] * left)


@subroutine
def way_ahead(m: HeightMap, x: float, y: float, way: V3, here: float) -> tuple[float, float]:
    """What ends a way (0 for nothing), and how far ahead [m] that is.

    ``here``: height [m] of the ground below the robot.
    """
    what, end = 0.0, FAR
    steps = int(FAR / CELL)
    for line in range(-1, 2):
        last, at, low, high, run, before = here, 0.0, 0, 0, 0, here
        for n in range(steps + 1):
            ahead = (n + 0.5) * CELL
            z = beside(m, x, y, way, (ahead, line * LINE))
            high = high + 1 if z > last + GREATEST_STEP else 0
            if high > 1:
                if ahead - 1.5 * CELL < end:
                    what, end = RISE, ahead - 1.5 * CELL
                break
            for side in (-MOVED_ASIDE, MOVED_ASIDE):
                other = beside(m, x, y, way, (ahead, line * LINE + side))
                if np.isnan(z) or abs(other - last) < abs(z - last):
                    z = other
            if np.isnan(z):
                continue
            run = run + 1 if abs(z - before) < EVEN else 1
            before = z
            low = low + 1 if z < last - GREATEST_STEP else low
            if low > 0 and ahead - at > GREATEST_GAP:
                if at < end:
                    what, end = DROP, at
                break
            if run >= FOOT_CELLS and abs(z - last) <= GREATEST_STEP:
                last, at, low = z, ahead, 0
    return what, end


@subroutine
def look_anew(
    sight: Sight, g: Ground, m: HeightMap, now: Snapshot, yaw: float, velocity: Array3, dt: float
) -> None:
    """Take in the ground below and ahead, ``dt`` seconds after the last time.

    ``velocity``: that is commanded, in the heading frame.
    """
    x, y, plane = now.p_world_com[0], now.p_world_com[1], sight.plane
    sight.sees = fitted_plane(g, m, x, y, yaw, now.foot_radius, plane)
    sight.blocked, g.steeper = 0.0, 0.0
    if not sight.sees:
        sight.uneven_way = 0.0
        return
    speed, cosine, sine = np.hypot(velocity[0], velocity[1]), np.cos(yaw), np.sin(yaw)
    ahead, left = (1.0, 0.0) if speed < _TINY else (velocity[0] / speed, velocity[1] / speed)
    way = (cosine * ahead - sine * left, sine * ahead + cosine * left, LOOK)
    mean, highest, steps = unevenness(m, x, y, way, plane)
    come = np.hypot(now.v_world_com[0], now.v_world_com[1]) * dt
    sight.uneven_way = UNEVEN_WAY if steps > 0 else max(sight.uneven_way - come, 0.0)
    g.roughness, g.rough_way, g.high_way, g.rise_way = mean, 0.0, 0.0, 0.0
    climb = g.slope[0] * way[0] + g.slope[1] * way[1]
    g.steeper = 1.0 - FOLLOW if climb > 0.0 else 0.0
    lift = LIFT if climb < -LOWERED and sight.uneven_way > 0.0 else 0.0
    sight.lift += min(max(lift - sight.lift, -LIFT_RATE * dt), LIFT_RATE * dt)
    sight.blocked, sight.end = way_ahead(m, x, y, way, plane[0])
    is_near = sight.blocked != 0.0 and sight.end < STOP + NEAR_STOP
    sight.stopped = sight.stopped + dt if is_near else 0.0
    sight.most = SPEED if sight.uneven_way > 0.0 else np.inf
    if steps >= FLIGHT and highest > FLIGHT_STEP:
        sight.most = FLIGHT_SPEED
    if sight.blocked != 0.0:
        sight.most = min(sight.most, np.sqrt(2.0 * BRAKING * max(sight.end - STOP, 0.0)))


@subroutine
def look(
    sight: Sight,
    g: Ground,
    m: HeightMap,
    now: Snapshot,
    yaw: float,
    velocity: Array3,
    dt: float,
) -> None:
    """Bring the ground, and what is known of the way, to this tick, ``dt`` seconds after the last.

    ``velocity``: that is commanded, in the heading frame; what ends the way limits it.
    """
    plane = sight.plane
    sight.since += dt
    plane[0] += dt * (plane[1] * now.v_world_com[0] + plane[2] * now.v_world_com[1])
    if sight.since > AGAIN - TIE or not sight.sees:
        look_anew(sight, g, m, now, yaw, velocity, sight.since)
        sight.since = 0.0
    sight.is_slowed = False
    if sight.sees:
        share = min(dt / SMOOTH_TIME, 1.0)
        g.height += share * (plane[0] - g.height)
        g.slope[0] += share * (plane[1] - g.slope[0])
        g.slope[1] += share * (plane[2] - g.slope[1])
        speed = np.hypot(velocity[0], velocity[1])
        sight.is_slowed = sight.most < speed
        velocity *= min(sight.most / max(speed, _TINY), 1.0)
