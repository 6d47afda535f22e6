"""What a leg tells the state estimator: where its foot is, how fast the trunk, how high the ground.

With s_i the position of the foot's centre from the IMU along the world's axes by the leg's
kinematics, and m_i the velocity of the IMU if the foot rolls (innovation and h as in
``state_filter``):

    place      s_i - (f_i - p) = df_i - dp - theta x s_i     r = place^2
    velocity   m_i - v = dv - theta x v                      r = k ((velocity / trust)^2 + slip^2
                                                                    + creep^2)
    height     level - g_i = df_i,z                          r = height^2, once after touchdown
    slope      plane - g_i = df_i,z                          r = (print^2 + d^2) (1 + leverage)

A rotation of the estimate rotates a leg's velocity with it, by theta x v. trust grows from 0 to 1
between ``contact_force`` and ``trusted_force``, slip decays after touchdown, creep grows with the
foot's speed along the trunk, vertically ``vertical`` is added, and k is ``slip_factor``. The drift
speed of a foot gives its part of Q. g_i is the height of the ground at the foot's touchdown, before
it sank in: known to 3 mm, be it on the level, on stairs or on blocks. The level is the known height
of the ground there, see ``height_off``: foot-mounted IMUs get their height the same way (Park &
Suh, *Height compensation using ground inclination estimation*, Sensors 11, 2011).

Where the ground has no levels, a plane is fitted to the footholds near by, which deviate from it by
d (``footprints``). Its normal n is the one about which a foot rolls there, while it creeps
downhill: its centre moves with w_i x (r n) + creep (n_z n - e_z). The height of a front foot is
taken from the footholds of the hind feet, and the other way round: these were made when the trunk
was elsewhere, so the innovation shows the drift since. Drift along the plane cannot be seen.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.linear import cross, put, triple, turned
from go2_wbc.compilation import subroutine
from go2_wbc.records import Array3, Array3x3, Record
from go2_wbc.robot.estimator_config import EstimatorConfig
from go2_wbc.robot.footprints import EACH, plane_near
from go2_wbc.robot.leg_kinematics import LegGeometry
from go2_wbc.robot.state_filter import FEET, THETA, VELOCITY, Filter, take_in, take_in_one

LEAST_TRUST = 1e-3
"""Trust in a foot in the air: its place drifts a thousand times as fast as a standing one's."""
_HEIGHT_GATE = 9.0
"""Square of the deviations by which a foot's height may be off that of flat ground; else it stands
on something else, and its height says nothing."""
_LEVEL_SHARE = 0.2
"""Share of a landing foot's height in that of the ground, while this is not believed."""
_PRINT, _BETWEEN = 0.003, 1.0
"""Deviation [m] of a print's height, and greatest leverage at which it tells of that of a foot:
between the prints, not beyond them."""
_BENT = 0.02
"""Deviation [m] of prints from their plane at which half its slope is believed."""


class Foot(Record):
    """A foot, as its leg measures it, along the world's axes."""

    age: float  #: time [s] for which it has touched the ground
    met: float  #: height of the ground [m] where it came down; the rest is of this tick alone
    place: Array3  #: of its centre from the IMU [m]
    velocity: Array3  #: of the IMU if it rolls on the ground [m/s]
    rolling: Array3  #: velocity of its centre then [m/s]
    speed: float  #: of it along the trunk [m/s]
    normal: Array3  #: of the ground under it, upwards
    carries: bool  #: whether it counts as standing
    variance: Array3  #: of the velocity; 0 if it is not to be taken in
    height_off: float  #: of the ground above it [m], where that is known; else inf
    height_variance: float  #: of that [m^2]


class Level(Record):
    """The ground: in terraces, as far as it is level, or what the prints of the feet say."""

    heights: Float[np.ndarray, "8"]  #: of those met last [m], the last one first
    doubt_time: float  #: for which they are not believed [s]
    prints: Float[np.ndarray, "16 3"]
    """Where the front feet came down last [m], the last one first, and then the hind feet."""


@subroutine
def see_foot(
    foot: Foot,
    leg: LegGeometry,
    q: Array3,
    u: Array3,
    p_imu: Array3,
    w: Array3,
    radius: float,
    creep: float,
    R: Array3x3,
) -> None:
    """Fill what a leg measures, along the world's axes.

    q and u are the angles and speeds of its joints, w the angular velocity of the base, ``creep``
    the speed downhill [m/s] of a foot, per sine of the slope.
    """
    c1, s1, c2, s2 = np.cos(q[0]), np.sin(q[0]), np.cos(q[1]), np.sin(q[1])
    c3, s3, bend = np.cos(q[1] + q[2]), np.sin(q[1] + q[2]), u[1] + u[2]
    hip, width, thigh, calf = leg.p_base_hip, leg.width, leg.thigh, leg.calf
    down = thigh * c2 + calf * c3
    longer = -thigh * s2 * u[1] - calf * s3 * bend
    x = hip[0] - thigh * s2 - calf * s3 - p_imu[0]
    y = hip[1] + width * c1 + down * s1 - p_imu[1]
    z = hip[2] + width * s1 - down * c1 - p_imu[2]
    dx = -thigh * c2 * u[1] - calf * c3 * bend
    dy = longer * s1 + (down * c1 - width * s1) * u[0]
    foot.speed = np.sqrt(dx * dx + dy * dy)
    dx += w[1] * z - w[2] * y
    dy += w[2] * x - w[0] * z
    dz = (width * c1 + down * s1) * u[0] - longer * c1 + w[0] * y - w[1] * x
    put(turned(R, (x, y, z)), foot.place)
    put(turned(R, (-dx, -dy, -dz)), foot.velocity)
    n = foot.normal
    put(
        cross(turned(R, (w[0] + u[0], w[1] + c1 * bend, w[2] + s1 * bend)), triple(n)), foot.rolling
    )
    for k in range(3):
        downhill = n[2] * n[k] - (1.0 if k == 2 else 0.0)
        foot.rolling[k] = radius * foot.rolling[k] + creep * downhill
        foot.velocity[k] += foot.rolling[k]


@subroutine
def slip_factor(f: Filter, foot: Foot, gate: float) -> float:
    """Factor on the variances of a foot that stands: above 1 if it moves as no standing one would.

    With chi^2 the square of the velocity's innovation over its variance, and the gate its greatest
    usual root: max(1, chi^2 / gate^2), so that an outlier counts by its size no longer (Huber,
    *Robust Statistics*, 1981).
    """
    chi = 0.0
    for k in range(3):
        off = foot.velocity[k] - f.x.v[k]
        chi += off * off / (f.P[VELOCITY + k, VELOCITY + k] + foot.variance[k])
    return max(1.0, chi / (gate * gate))


@subroutine
def height_off(level: Level, ground: float, variance: float, c: EstimatorConfig) -> float:
    """How far the ground is above ``ground`` [m], where a foot stands on it; inf if unknown.

    ``variance``: of that difference. What is more than ``uneven`` off every terrace is a terrace
    that nobody knew. What is less off, yet no error, tells that the ground is not in terraces: they
    follow the feet, and say nothing of them for a while.
    """
    heights, place = level.heights, 0
    for k in range(len(heights)):
        if abs(heights[k] - ground) < abs(heights[place] - ground):
            place = k
    off = heights[place] - ground
    is_known = abs(off) <= c.uneven
    terrace = heights[place] if is_known else ground
    for k in range(place if is_known else len(heights) - 1, 0, -1):
        heights[k] = heights[k - 1]
    heights[0] = terrace
    if not is_known:
        return np.inf
    if abs(off) > c.terrace or off * off > _HEIGHT_GATE * variance:
        level.doubt_time = c.uneven_time
    if level.doubt_time > 0.0:
        heights[0] -= _LEVEL_SHARE * off
        return np.inf
    return off


@subroutine
def follow_foot(
    f: Filter,
    foot: Foot,
    leg: int,
    force: float,
    dt: float,
    vertical: float,
    rests: bool,
    c: EstimatorConfig,
) -> float:
    """Move a foot on by ``dt``, and fill how far what it tells is believed; returns its last age.

    Args:
        f: whose estimate and covariance of the foot are moved on.
        foot: as ``see_foot`` has filled it.
        force: on it [N].
        vertical: speed at which standing feet are pressed flat and spring back [m/s].
        rests: whether nothing moves.
    """
    age = foot.age if force > c.contact_force else -dt
    slip = c.touchdown_slip * np.exp(-max(age, 0.0) / c.touchdown_time)
    vertical += c.landing * np.exp(-max(age, 0.0) / c.landing_time)
    share = (force - c.contact_force) / (c.trusted_force - c.contact_force)
    trust = min(max(share, LEAST_TRUST), 1.0)
    foot.age = age + dt
    creeping = c.settled_drift if age > c.settled_time else c.foot_drift
    level = creeping / trust + slip + c.drift_share * foot.speed
    factor = 1.0
    foot.carries, foot.variance[:] = trust > LEAST_TRUST, 0.0
    if foot.carries:
        creep, variance = c.velocity_share * foot.speed, foot.variance
        variance[:2] = (c.velocity / trust) ** 2 + slip * slip + creep * creep
        variance[2] = variance[0] + vertical * vertical
        factor = slip_factor(f, foot, c.slip)
        variance *= factor
    for k in range(3):
        drift = level if k < 2 else level + vertical
        if rests:
            drift = c.still_drift
        f.P[FEET + 3 * leg + k, FEET + 3 * leg + k] += factor * (drift * dt) ** 2
        f.x.p_feet[leg, k] += dt * foot.rolling[k]
    return age


@subroutine
def see_slope(foot: Foot, spot: Array3, variance: float, end: int, level: Level) -> None:
    """Keep the print of a foot, and fill what prints say of the ground under it, if in no levels.

    ``spot`` [m] is where the foot is, ``variance`` [m^2] that of its height; ``end`` is 0 in front.
    """
    prints, x, y, in_doubt = level.prints, spot[0], spot[1], level.doubt_time > 0.0
    own, other = EACH * end, EACH * (1 - end)
    if in_doubt:
        height, _, _, bent, leverage = plane_near(prints, other, other + EACH, x, y)
        off, unsure = height - foot.met, (_PRINT**2 + bent * bent) * (1.0 + leverage)
        if leverage < _BETWEEN and off * off < _HEIGHT_GATE * (unsure + variance):
            foot.height_off, foot.height_variance = off, unsure
    for k in range(own + EACH - 1, own, -1):
        prints[k] = prints[k - 1]
    put((x, y, foot.met), prints[own])
    sx, sy = 0.0, 0.0
    if in_doubt:
        _, sx, sy, bent, _ = plane_near(prints, 0, 2 * EACH, x, y)
        share = 1.0 / (1.0 + (bent / _BENT) ** 4)
        sx, sy = share * sx, share * sy
    up = 1.0 / np.sqrt(1.0 + sx * sx + sy * sy)
    put((-sx * up, -sy * up, up), foot.normal)


@subroutine
def see_ground(
    f: Filter,
    foot: Foot,
    leg: int,
    force: float,
    age: float,
    radius: float,
    level: Level,
    c: EstimatorConfig,
) -> None:
    """Fill how far the ground is above where the foot has met it, once it has settled; else inf.

    ``age``: of its contact [s] before this tick; ``radius``: of the foot [m].
    """
    foot.height_off = np.inf
    if age < 0.0:
        foot.met = f.x.p[2] + foot.place[2] - radius + c.compliance * force
    if age < c.landing_time <= foot.age:
        z = FEET + 2 + 3 * leg
        foot.height_off = height_off(level, foot.met, f.P[z, z] + c.height**2, c)
        foot.height_variance = c.height**2
        see_slope(foot, f.x.p_feet[leg], f.P[z, z], leg // 2, level)


@subroutine
def take_in_leg(f: Filter, foot: Foot, leg: int, c: EstimatorConfig) -> None:
    """Take in what a leg measures: its place, its velocity if it stands, and its height.

    A turn of the estimate turns a leg's velocity with it, by theta x v. The estimate is put there
    for v, not what the leg measures: its noise would stand in the gain and in what that multiplies,
    and a mean of their product, which tilted a standing robot by a degree a minute.
    """
    x, s, m, variance = f.x, foot.place, foot.velocity, c.place**2
    places, shares, first = np.empty(4, np.int64), np.empty(4), FEET + 3 * leg
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        # R s = f - p - theta x R s; the k-th number of the product has those at i and j
        places[0], places[1], places[2], places[3] = first + k, k, THETA + i, THETA + j
        shares[0], shares[1], shares[2], shares[3] = 1.0, -1.0, -s[j], s[i]
        off = s[k] - x.p_feet[leg, k] + x.p[k]
        take_in(f, places, shares, 4, off, variance)
        if foot.variance[k] > 0.0:
            places[1], shares[1] = VELOCITY + k, 1.0
            shares[2], shares[3] = -x.v[j], x.v[i]
            off = m[k] - x.v[k]
            take_in(f, places[1:], shares[1:], 3, off, foot.variance[k])
    if foot.height_off != np.inf:
        take_in_one(f, first + 2, foot.height_off, foot.height_variance)
