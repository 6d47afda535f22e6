"""Footholds and swings on ground that the robot has seen.

A foothold is the cell near the blind robot's foothold (``footholds``), at a distance d from it,
that costs least:

    (d / FAR)^2 + EDGE edge + (range / FLAT)^2 + UNKNOWN [not known] + STICKY (way / FAR)^2
        + MISS sum of how far, at touchdown, in the middle and at the end of its stance, the calf
        comes below CLEARANCE over the ground, and the hip out of reach
        + LOWERING sum of how far the back of the calf does so, EARLIER, with the foot a third and
        two thirds of the way down to a lower place above it

``way`` is the distance from the foothold to which the foot swings at present: changes of the
trunk's velocity within a stride must not move it to and fro. ``edge`` falls, as a square, through 1
at ``NEAR`` to 0 at ``NEAR_ENOUGH`` from the next cell that is lower by more than ``STEP``, or
unknown, or a little nearer if it is higher; ``range`` is that of the heights of the cells around
it. The foothold is chosen anew until ``LATEST`` of the swing, and approached at ``SLEW``; later
only its height is updated. The last term keeps a foot on top of a high step until its hip has gone
on: a hip 7 cm past the edge bends the knee so far that the calf hits the edge, and the foot hangs
in the air. The foothold chosen last may always be kept: the blind one moves sideways with the trunk
by 8 cm, and would drag it over an edge.

The swing rises to an apex above both of its ends and the ground between them, and descends; each
part's time is in proportion to its height. The foot moves ahead between two instants, which are the
nearest to the swing's begin and to ``LANDED``, from which on the foot may touch, between which it
clears the ground by ``OVER``. So the foot rises in front of a step, and moves ahead over the edge
behind it before it descends; on the level it moves ahead all the time. A foot that comes down from
a step arrives above its place early enough that the back of the calf clears the edge all the way by
``CLEARANCE``: if it still moved ahead on its way down, the calf lay on the edge of a block of 20
cm, the foot hung 6 cm above the ground as its stance began, and the trunk fell onto that corner.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.linear import plus_scaled, triple
from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.planning.height_map import CELL, HeightMap, height_at
from go2_wbc.planning.swing import Swing, cubic
from go2_wbc.planning.trunk import world_velocity
from go2_wbc.planning.walk import Planner, Walk
from go2_wbc.records import V3, Array3
from go2_wbc.robot.state import Snapshot

BACK, ALONG, ACROSS = 8, 7, 4
"""Cells by which a foothold may be moved back, ahead, and aside either way."""
FAR, FLAT, MISS = 0.06, 0.02, 150.0
"""Distance [m] and range of heights [m] that cost 1, and what a metre of missing room costs."""
EDGE, UNKNOWN, STICKY = 10.0, 15.0, 1.0
NEAR, NEAR_ENOUGH, STEP, HIGHER = 0.036, 0.085, 0.035, 0.015
"""Distances [m] of an edge, its height [m], and by how much nearer [m] one may be that is
higher."""
CLEARANCE, SHORTEST, LONGEST = 0.035, 0.14, 0.39
"""Height [m] of the calf's axis over the ground, and lengths [m] from hip to foot."""
LOWERING, EARLIER, BEHIND = 300.0, 0.06, 0.03
"""What a metre of missing room costs on the way down, the time [s] before touchdown at which the
hip is there, and how far [m] the back of the calf, and what the map is off, lie behind its axis.
With more of them feet wait too long, and the robot is stretched over two steps: of 20 runs over
stairs of 20 cm 10 to 14 were done instead of 15."""
POINTS = 8
"""Of a calf that are looked at. The edge of a block lay between three of them, 7 cm apart."""
LATEST, SLEW, RISE, AGAIN = 0.6, 2.5, 1.0, 0.01
"""Share of a swing in which footholds are chosen, speeds [m/s] at which they and a swing's top
move, and time [s] between two choices."""
MOVED = 0.25
"""How far [m] a foothold may be moved as a swing begins, and times (1 - u)^2 at its share u. A foot
that was sent to the other side of a gap in the middle of its swing came down inside."""
LEAST_TOP, OVER_WAY, OVER = 0.06, 0.05, 0.02
"""Height [m] of a swing's top over its ends, over the ground between them, and of every other point
over what it passes."""
SHAPED, WAITS, WAIT, LANDED = 0.1, 6, 0.06, 0.9
"""Share of the swing until which its shape is sought, the moments tried, how many and how far
apart, and the last of them."""
LANDS = 0.03
"""Distance [m] from the map within which a contact late in the swing may be a landing."""


@subroutine
def edge_cost(m: HeightMap, x: float, y: float, z: float) -> tuple[float, float]:
    """How near an edge is, 0 to 1, and the range [m] of the heights around."""
    nearest, low, high = NEAR_ENOUGH, z, z
    for i in range(-3, 4):
        for j in range(-3, 4):
            far = CELL * np.sqrt(i * i + j * j)
            if far >= nearest:
                continue
            beside = height_at(m, x + i * CELL, y + j * CELL)
            if beside > z + STEP:
                nearest = min(nearest, far + HIGHER)
            elif not beside >= z - STEP:  # lower, or unknown
                nearest = far
            elif abs(i) <= 1 and abs(j) <= 1:
                low, high = min(low, beside), max(high, beside)
    near = (NEAR_ENOUGH - nearest) / (NEAR_ENOUGH - NEAR)
    return near * near, high - low


@subroutine
def leg_miss(
    m: HeightMap, hip: V3, way: V3, foot: V3, ahead: tuple[float, float], c: Walk
) -> float:
    """How much room [m] a leg lacks in a stance, in which its hip goes the ``way`` [m]."""
    missing = 0.0
    for n in range(3):
        x, y, z = hip[0] + 0.5 * n * way[0], hip[1] + 0.5 * n * way[1], hip[2] + 0.5 * n * way[2]
        d = np.sqrt((x - foot[0]) ** 2 + (y - foot[1]) ** 2 + (z - foot[2]) ** 2)
        missing += max(d - LONGEST, 0.0) + max(SHORTEST - d, 0.0)
        missing += calf_miss(m, (x, y, z), foot, ahead, 0.0, c)
    return missing


@subroutine
def calf_miss(
    m: HeightMap, hip: V3, foot: V3, ahead: tuple[float, float], behind: float, c: Walk
) -> float:
    """How far [m] the calf comes below ``CLEARANCE`` over the ground, at its worst point.

    It is measured so far [m] ``behind`` its axis, in the direction opposite to ``ahead``.
    With d from hip to foot and links of the length l, the knee is sqrt(l^2 - d^2 / 4) behind the
    middle between them, in the upright plane of the heading ``ahead``, whichever way it walks.
    """
    dx, dy, dz = hip[0] - foot[0], hip[1] - foot[1], hip[2] - foot[2]
    d = np.sqrt(dx * dx + dy * dy + dz * dz)
    bend = np.sqrt(max(c.link * c.link - 0.25 * d * d, 0.0)) / max(d, TIE)
    back = bend * dz
    up = 0.5 * dz + bend * (dx * ahead[0] + dy * ahead[1])
    worst = 0.0
    for k in range(1, POINTS + 1):
        share = k / POINTS
        px = foot[0] + share * (0.5 * dx - back * ahead[0]) - behind * ahead[0]
        py = foot[1] + share * (0.5 * dy - back * ahead[1]) - behind * ahead[1]
        ground = height_at(m, px, py)
        if not np.isnan(ground):
            worst = max(worst, ground + CLEARANCE - foot[2] - share * up)
    return worst


@subroutine
def lowering_miss(
    m: HeightMap, hip: V3, goal: V3, drop: float, ahead: tuple[float, float], c: Walk
) -> float:
    """How much room [m] the calf of a foot lacks that comes down to ``goal`` by ``drop`` [m]."""
    missing = 0.0
    if drop > STEP:
        for k in range(1, 3):
            foot = (goal[0], goal[1], goal[2] + k / 3.0 * drop)
            missing += calf_miss(m, hip, foot, ahead, BEHIND, c)
    return missing


@subroutine
def hip_of(leg: int, now: Snapshot, c: Walk) -> V3:
    """Where the hip of a leg is [m]."""
    hip = now.q[:3].copy()
    for i in range(3):
        for k in range(3):
            hip[i] += now.R_world_base[i, k] * c.p_base_hips[leg, k]
    return triple(hip)


@subroutine
def choose(
    leg: int,
    now: Snapshot,
    s: Planner,
    c: Walk,
    m: HeightMap,
    spans: tuple[float, float],
    blind: Array3,
    most: float,
) -> None:
    """Choose the foothold of a foot that has swung, and will, for so long [s].

    ``blind``: where it would come down by the plane; ``most``: how far [m] from where it is led.
    """
    start, step, yaw = s.feet[leg].swing.start, s.feet[leg].step, s.trunk.yaw
    cosine, sine = np.cos(yaw), np.sin(yaw)
    v_x, v_y = world_velocity(s.trunk)
    climb = s.ground.slope[0] * v_x + s.ground.slope[1] * v_y
    stance = s.clock.duty * s.clock.period
    way = (stance * v_x, stance * v_y, stance * climb)
    at = plus_scaled(hip_of(leg, now, c), spans[1] / stance, way)
    before = plus_scaled(at, -EARLIER / stance, way)
    best, kept = np.inf, triple(step.chosen)
    for n in range(-1, (BACK + ALONG + 1) * (2 * ACROSS + 1)):
        i, j = n // (2 * ACROSS + 1) - BACK, n % (2 * ACROSS + 1) - ACROSS
        x = blind[0] + CELL * (cosine * i - sine * j)
        y = blind[1] + CELL * (sine * i + cosine * j)
        if n < 0:
            x, y, _ = kept
        cost = ((x - blind[0]) ** 2 + (y - blind[1]) ** 2) / FAR**2
        moved = np.hypot(x - step.goal[0], y - step.goal[1])
        if cost >= best or moved > most:
            continue
        if most < np.inf:
            cost += STICKY * (moved / FAR) ** 2
        z = height_at(m, x, y)
        if np.isnan(z):
            cost, z = cost + UNKNOWN, blind[2] - c.foot_radius
        near, spread = edge_cost(m, x, y, z)
        cost += EDGE * near + (spread / FLAT) ** 2
        if cost >= best:
            continue
        goal = (x, y, z + c.foot_radius)
        cost += MISS * leg_miss(m, at, way, goal, (cosine, sine), c)
        if cost < best:
            cost += LOWERING * lowering_miss(m, before, goal, start[2] - goal[2], (cosine, sine), c)
        if cost < best:
            best = cost
            step.chosen[0], step.chosen[1] = x, y
            step.chosen[2] = z + c.foot_radius


@subroutine
def ground_over(m: HeightMap, a: Array3, b: Array3) -> float:
    """Greatest height [m] of the ground on the way between two places."""
    highest, count = -np.inf, int(np.hypot(b[0] - a[0], b[1] - a[1]) / CELL) + 2
    for n in range(count + 1):
        share = n / count
        z = height_at(m, a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
        if z > highest:
            highest = z
    return highest


@subroutine
def height_of_swing(swing: Swing, top: float, peak: float, end: float, u: float) -> V3:
    """Height [m] of a foot at a share ``u`` of its swing, and its two derivatives by u."""
    if u < peak - TIE:
        x, dx, ddx = cubic(u / peak)
        way = top - swing.start[2]
        return swing.start[2] + x * way, dx * way / peak, ddx * way / peak**2
    x, dx, ddx = cubic(min((u - peak) / (1.0 - peak), 1.0))
    way = end - top
    return top + x * way, dx * way / (1.0 - peak), ddx * way / (1.0 - peak) ** 2


@subroutine
def top_of(leg: int, s: Planner, c: Walk, m: HeightMap) -> float:
    """Greatest height [m] that a swing needs."""
    start, goal = s.feet[leg].swing.start, s.feet[leg].step.goal
    over = ground_over(m, start, goal) + c.foot_radius + OVER_WAY
    return max(max(start[2], goal[2]) + LEAST_TOP, over)


@subroutine
def shape(
    leg: int, now: Snapshot, s: Planner, c: Walk, m: HeightMap, spans: tuple[float, float]
) -> None:
    """Find the top of a swing, when it is reached, and when the foot goes ahead."""
    foot = s.feet[leg]
    swing, step = foot.swing, foot.step
    a, b, r = swing.start, step.goal, c.foot_radius
    step.top = top_of(leg, s, c, m)
    up, down = step.top - a[2], step.top - b[2]
    step.peak = min(max(up / (up + down), 0.3), 0.7)
    length = max(np.hypot(b[0] - a[0], b[1] - a[1]), TIE)
    ahead_x, ahead_y = r * (b[0] - a[0]) / length, r * (b[1] - a[1]) / length
    yaw, (v_x, v_y) = s.trunk.yaw, world_velocity(s.trunk)
    heading = np.cos(yaw), np.sin(yaw)
    way = (v_x, v_y, s.ground.slope[0] * v_x + s.ground.slope[1] * v_y)
    is_lowered, hip = a[2] - b[2] > STEP, hip_of(leg, now, c)
    best = np.inf
    for wait in range(WAITS + 1):
        for early in range(WAITS + 1):
            begin, end = wait * WAIT, LANDED - early * WAIT
            cost = 0.2 * (begin + LANDED - end)
            if cost >= best:
                continue
            for n in range(1, 12):
                u = n / 12.0
                z, _, _ = height_of_swing(swing, step.top, step.peak, b[2], u)
                x, _, _ = cubic(min(max((u - begin) / (end - begin), 0.0), 1.0))
                px, py = a[0] + x * (b[0] - a[0]), a[1] + x * (b[1] - a[1])
                side = 1.0 if u < step.peak else -1.0
                base = a[2] if u < step.peak else b[2]
                for k in range(2):  # below the foot, and in front of it, or behind it going down
                    ground = height_at(m, px + k * side * ahead_x, py + k * side * ahead_y)
                    if ground > base - r + OVER:
                        cost += max(ground + OVER - z + r, 0.0) / OVER
                if is_lowered and u > step.peak:
                    at = plus_scaled(hip, u * (spans[0] + spans[1]) - spans[0], way)
                    cost += calf_miss(m, at, (px, py, z), heading, BEHIND, c) / OVER
                if cost >= best:
                    break
            if cost < best:
                best, step.begin, step.end = cost, begin, end


@subroutine
def swing_by_sight(
    leg: int,
    now: Snapshot,
    s: Planner,
    c: Walk,
    m: HeightMap,
    spans: tuple[float, float],
    blind: Array3,
    dt: float,
    p: Array3,
    v: Array3,
    a: Array3,
) -> None:
    """Fill position [m], velocity [m/s] and acceleration [m/s^2] of a foot that swings.

    Args:
        spans: for how long it has swung, and will [s].
        blind: where it would be put down by the plane [m].
    """
    foot, elapsed, remaining = s.feet[leg], spans[0], spans[1]
    step, swing, duration = foot.step, foot.swing, elapsed + remaining
    progress = elapsed / duration
    is_new = not step.is_sighted
    if is_new:
        step.is_sighted, step.next = True, s.time
        step.chosen[:] = blind
    if s.time >= step.next - TIE and progress <= LATEST:
        most = np.inf if is_new else MOVED * (1.0 - progress) ** 2
        choose(leg, now, s, c, m, spans, blind, most)
        step.next = s.time + AGAIN
        if is_new:
            step.goal[:] = step.chosen
        if progress <= SHAPED or is_new:
            shape(leg, now, s, c, m, spans)
        elif progress < step.peak:
            off = top_of(leg, s, c, m) - step.top
            step.top += min(max(off, -RISE * AGAIN), RISE * AGAIN)
    known = height_at(m, step.chosen[0], step.chosen[1])
    if not np.isnan(known):
        step.chosen[2] = known + c.foot_radius
    for i in range(3):
        off = step.chosen[i] - step.goal[i]
        step.goal[i] += min(max(off, -SLEW * dt), SLEW * dt)
    step.top = max(step.top, step.goal[2] + LEAST_TOP / 2)
    x, dx, ddx = cubic(min(max((progress - step.begin) / (step.end - step.begin), 0.0), 1.0))
    span = duration * (step.end - step.begin)
    if not step.begin < progress < step.end:
        dx = ddx = 0.0
    for i in range(2):
        delta = step.goal[i] - swing.start[i]
        p[i] = swing.start[i] + x * delta
        v[i] = dx / span * delta
        a[i] = ddx / span**2 * delta
    end = step.goal[2] - c.config.swing.touchdown_depth
    p[2], dz, ddz = height_of_swing(swing, step.top, step.peak, end, progress)
    v[2], a[2] = dz / duration, ddz / duration**2


@subroutine
def height_to_land(m: HeightMap, x: float, y: float, z: float) -> float:
    """Height [m] of a foot's underside at ``z`` above the map, 0 where it cannot have landed.

    A contact high above what is known is that of a riser, or of an edge that is brushed.
    """
    above = z - height_at(m, x, y)
    return above if above < LANDS else 0.0
