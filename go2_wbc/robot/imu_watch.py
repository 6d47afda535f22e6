"""The IMU held against feet that stand: does it err, and by how much?

With p_i the point of a foot that touches, u_i its velocity relative to the base (``less_rolling``),
and v that of the IMU by the feet that stand, weighted by what they bear, all in the base frame:

    gyro            d/dt (p_i - p_j) + w x (p_i - p_j) = 0    least squares over time
    accelerometer   d/dt s = a - w x s - R'g + (v - s) / T    (s - v) / T is its error

Feet that slip do not turn together: an error of the gyro has to explain their residual. Where the
gyro jumps from one reading to the next, whether the feet jump along is known at once, and of an
error then all of it, also about the line between two feet of a trot. s is the
velocity that the accelerometer integrates to, drawn to the feet's; between two steps nothing draws
it. What has been wrong for a while is named and taken off, and so is what it has done to s.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.linear import cross, dot, plus_scaled, put, triple
from go2_wbc.compilation import subroutine
from go2_wbc.records import V3, Array3, Array3x3, Record

CALM, LONG_CALM = 0.3, 1.0
"""Time [s] after which one that has come to its feet judges its gyro by them, and then its
accelerometer: whoever believes the IMU has to know by then which way is up."""
THROWN = 20.0
"""Acceleration [m/s^2] of the trunk by which it is thrown: trots over boxes stay below 16 in 99.9 %
of the time, pushes of 90 N s and falls are above 50."""
BETWEEN_STEPS = 0.06
"""Time [s] for which the legs of one that walks may not bear it: those of a trot do not for 0.03,
and as long as a flight takes its landing is no reason to doubt anything."""
SETTLING = 0.1
"""Time constant [s] over which both are judged (T)."""
GYRO_LIMIT, GYRO_LASTS = 0.22, 0.12
"""Error of the gyro [rad/s] that is named, if it lasts so long [s]."""
FOUND_AFTER, FOUND_SHARE = 0.2, 0.8
"""How long [s] an error of the gyro has been there when it is found, more or less, and the share of
it that the sums have taken in by then: 1 - exp(-0.16 / 0.1)."""
REFINING = 0.2
"""Time [s] over which what is left of it is measured then: both pairs of a trot's feet stand."""
EXPLAINED, UNEXPLAINED = 0.5, 0.3
"""Share of the feet's squared residual that an error of the gyro explains, if it is one, and what
else they may turn by [rad/s]: one that lies down on slippery ground slides by 0.46."""
JUMP, SEEN, JUMP_LASTS, LONGEST_JUMP = 0.3, 0.4, 0.03, 0.25
"""Change of the gyro from one reading to the next [rad/s] that may be an error; what feet that do
not jump along have to show of it [m^2/s^2], for how long at least [s], and at most."""
SEEN_AFTER = 0.08
"""Time [s] within which some have to begin: those that come down after a flight slide by as much.
Of 160 robots that met stairs and blocks at 1 m/s one was accused, of a jump 0.1 s before."""
SHAKEN, SHAKEN_LASTS = 0.01, 0.06
"""Time [s] after a landing, twice as long before, in which a jump may be its: a foot on the edge of
a step jerks the trunk, and then slides; 2 of 20 sound gyros were accused of it on stairs of 13 cm.
How long [s] feet have to show it then: to a sound one they have lent 0.03 of ``SEEN`` at most."""
GOES_ON = 0.25
"""Share of it by which the reading before or after changes alike, if it is the turning that has: a
foot that comes down hard turns the trunk for several."""
JUMP_SHARE, NO_JUMP, JUMP_EXPLAINED = (0.7, 1.4), 0.5, 0.85
"""Range of the share of the jump that they lack, if it is an error; share below which it is none;
and the share of their squared residual that an error explains: 0.97 of most, a slip 0.8."""
UNSEEN = 0.5
"""m^2 that is added to what feet tell of each axis of the gyro's error, and draws it towards 0: two
feet tell nothing of a turn about the line between them. A pair adds 0.1 to 0.25 in each tick."""
FINER = 1.0 / 3.0
"""Share of either's limit above which what is left of an error counts, too."""
FORCE_LIMIT, FORCE_LASTS, STAYING = 0.45, 0.25, 0.62
"""Error of the accelerometer [m/s^2] that is named, if it lasts so long [s] without falling below
this share of what it was: what a blow leaves fades."""
UPWARDS, UPWARDS_LASTS = 0.85, 0.1
"""Share of it by which it points up or down, and how long [s] it lasts then: feet slide sideways,
and a trot that believes it rises falls soon. Of sound ones 0.05 at most."""
UPSET = 3.0
"""Time [s] after a throw in which a sideways error of the accelerometer is a tilt, too: a trunk
that slid at 3 m/s on all its feet was believed to lean by 3 deg for two seconds more."""
STRUCK = 0.3
"""Time [s] after a foot has borne more than the robot's weight: an error that begins then has to
last as long as any other: where commands act late, and on waves, robots land so hard, their feet
spring back, and 2 sound ones of 20 were named in reversals."""
PUSHED = 0.6
"""Share of it by which the legs push the robot sideways, as they do if all feet slide together:
what the accelerometer feels then is true. An error makes the robot lean, and its weight then pushes
as well; but the legs lack the whole error of what is felt."""

TILTED, TILT_LASTS, TILT_SHARE = 2.0, 0.1, 0.7
"""Once the gyro has erred, an error of the accelerometer is a tilt that it has left: taken back
if it lasts so long [s], in the first two seconds from a finer limit on; and the share of it that is
measured by then."""


class WatchedImu(Record):
    """What is remembered from reading to reading."""

    stood: float  #: for how long its legs have carried it [s]
    unborne: float  #: for how long they have not [s]
    struck: float  #: for how long yet a foot counts as struck [s]
    upset: float  #: for how long yet the trunk counts as thrown [s]
    turning: Array3x3  #: matrix of the normal equations of the gyro's error,
    turned: Array3  #: their right side,
    residual: float  #: and the squared residual
    gyro_off: Array3  #: the error that is taken off [rad/s]
    gyro_time: float  #: for how long there has been one [s]
    refining: float  #: for how long what is left is still measured [s]
    change: Array3  #: of the gyro from the last reading but one to the last [rad/s]
    jump: Array3  #: the last of the gyro [rad/s]
    jump_time: float  #: for how long it is looked at [s]
    jump_lasts: float  #: how long feet have to show it [s]
    # Feet that stand would seem to move apart by f, if it were an error, and do so by e [m/s].
    jump_seen: float  #: sum of f . f
    jump_lacks: float  #: of f . e
    jump_residual: float  #: and of e . e
    any_seen: float  #: the first two with feet that have just landed
    any_lacks: float
    since: float  #: time since an error of the gyro was taken off [s]
    speed: Array3  #: of the IMU by the accelerometer, drawn to that by the feet [m/s]
    excess: Array3  #: error of the accelerometer, smoothed once more [m/s^2]
    most_excess: float  #: the greatest while there is one
    push: Array3  #: by which the legs push, smoothed [m/s^2]
    lack: Array3  #: and less what the accelerometer feels
    force_off: Array3  #: the same as of the gyro, of the accelerometer [m/s^2]
    force_time: float
    turn: Array3  #: by which the gyro has turned whoever believed it until now [rad]
    gyro_is_off: float  #: 1 for what is broken, as of the next
    force_is_off: float
    is_found: float  #: 1 in the moment in which an error is taken off


@subroutine
def note_bearing(m: WatchedImu, is_calm: bool, is_borne: bool, dt: float) -> None:
    """Count how long its legs have carried it; the gaps between steps do not count."""
    m.unborne = 0.0 if is_borne else m.unborne + dt
    m.struck = max(m.struck - dt, 0.0) if m.force_time == 0.0 else m.struck
    if not is_calm or m.unborne > BETWEEN_STEPS:
        m.stood = 0.0
    elif is_borne:
        m.stood += dt
    keep = 1.0 if m.refining > 0.0 else np.exp(-dt / SETTLING)
    forget_turns(m, keep if m.stood >= CALM else 0.0)


@subroutine
def note_push(m: WatchedImu, push: V3, force: V3, dt: float) -> None:
    """Smooth what the legs push by, sum f / m, and how much less the accelerometer feels."""
    for k in range(3):
        m.push[k] += dt / SETTLING * (push[k] - m.push[k])
        m.lack[k] += dt / SETTLING * (push[k] - force[k] - m.lack[k])


@subroutine
def note_turn(m: WatchedImu, between: V3, apart: V3, w: V3, has_landed: bool) -> None:
    """Add what two feet that stand say of the gyro's error d: apart + (w - d) x between = 0.

    Feet that have just landed only refute: a jump that they do not lack is none.

    With e = apart + w x between it is d x between = e, so that A d = b with
    A = between^2 1 - between between' and b = between x e.
    """
    moved = cross(w, between)
    e = (apart[0] + moved[0], apart[1] + moved[1], apart[2] + moved[2])
    if m.jump_time > 0.0:
        seen = cross(triple(m.jump), between)
        m.any_seen += dot(seen, seen)
        m.any_lacks += dot(seen, e)
        if has_landed:
            m.jump_seen += dot(seen, seen)
            m.jump_lacks += dot(seen, e)
            m.jump_residual += dot(e, e)
    if not has_landed:
        return
    b, length = cross(between, e), dot(between, between)
    m.residual += dot(e, e)
    for i in range(3):
        m.turned[i] += b[i]
        m.turning[i, i] += length
        for k in range(3):
            m.turning[i, k] -= between[i] * between[k]


@subroutine
def forget_turns(m: WatchedImu, keep: float) -> None:
    """Let what feet have said count less."""
    m.residual *= keep
    for i in range(3):
        m.turned[i] *= keep
        for k in range(3):
            m.turning[i, k] *= keep


@subroutine
def gyro_error(m: WatchedImu) -> V3:
    """The least squares' answer, drawn towards 0 where the feet tell nothing."""
    A, b = m.turning, m.turned
    c0 = (A[0, 0] + UNSEEN, A[1, 0], A[2, 0])
    c1 = (A[0, 1], A[1, 1] + UNSEEN, A[2, 1])
    c2 = (A[0, 2], A[1, 2], A[2, 2] + UNSEEN)
    r0, r1, r2 = cross(c1, c2), cross(c2, c0), cross(c0, c1)
    det = c0[0] * r0[0] + c0[1] * r0[1] + c0[2] * r0[2]
    return (
        (r0[0] * b[0] + r0[1] * b[1] + r0[2] * b[2]) / det,
        (r1[0] * b[0] + r1[1] * b[1] + r1[2] * b[2]) / det,
        (r2[0] * b[0] + r2[1] * b[1] + r2[2] * b[2]) / det,
    )


@subroutine
def judge_gyro(m: WatchedImu, told: float, dt: float) -> None:
    """Name it once its error has lasted, and take the error off; and once more what is left.

    ``told``: share of the time that counts: none while there are not two feet that tell.
    """
    error = gyro_error(m)
    if m.refining > 0.0:
        m.refining -= dt
        if m.refining <= 0.0:
            take_off(m, error, FOUND_AFTER + REFINING)
        return
    explained = dot(error, triple(m.turned))
    most = UNEXPLAINED**2 * (m.turning[0, 0] + m.turning[1, 1] + m.turning[2, 2])
    is_off = explained > max(EXPLAINED * m.residual, m.residual - most)
    limit = GYRO_LIMIT * (FINER if m.gyro_is_off > 0.0 else 1.0)
    is_off = is_off and dot(error, error) > limit**2
    m.gyro_time = m.gyro_time + told * dt if is_off else 0.0
    if m.gyro_time > GYRO_LASTS:
        m.gyro_is_off, m.refining = 1.0, REFINING
        share = 1.0 / FOUND_SHARE
        take_off(m, (share * error[0], share * error[1], share * error[2]), FOUND_AFTER)


@subroutine
def judge_jump(m: WatchedImu, change: V3, is_shaken: bool, dt: float) -> None:
    """Take off what the gyro has jumped by since the last reading if the feet lack it for a while.

    With f and e of each pair the share that they lack is sum f . e / sum f . f, least squares. What
    a landing turns goes on to turn in the next reading. A jump while the robot ``is_shaken``, as a
    foot has just landed, is looked at for longer, and feet count that have landed for a while.
    """
    last, jump, size = triple(m.change), triple(m.jump), dot(change, change)
    if m.jump_time < 1.5 * dt and dot(change, jump) > GOES_ON * dot(jump, jump):
        m.jump_time = 0.0
    if is_shaken and m.jump_time <= 2.0 * SHAKEN:
        m.jump_lasts = SHAKEN_LASTS
    if is_shaken and m.jump_lasts == SHAKEN_LASTS:
        m.any_seen = m.any_lacks = 0.0
    if m.jump_time > 0.0:
        m.jump_time += dt
        is_told = m.jump_seen > SEEN and m.jump_time > m.jump_lasts
        explains = m.jump_lacks**2 > JUMP_EXPLAINED * m.jump_seen * m.jump_residual
        share = m.jump_lacks / m.jump_seen if m.jump_seen > 0.0 else 1.0
        any_share = m.any_lacks / m.any_seen if m.any_seen > 0.0 else 1.0
        longest = LONGEST_JUMP if m.jump_seen > 0.0 else SEEN_AFTER
        if is_told and explains and JUMP_SHARE[0] < share < JUMP_SHARE[1]:
            m.gyro_is_off, m.refining = 1.0, REFINING
            take_off(m, triple(m.jump), m.jump_time)
        elif min(share, any_share) < NO_JUMP or m.jump_time > longest:
            m.jump_time = 0.0
    has_begun = dot(change, last) > GOES_ON * size
    put(change, m.change)
    if m.jump_time == 0.0 and m.stood >= CALM and not has_begun and size > JUMP**2:
        put(change, m.jump)
        m.jump_lasts = SHAKEN_LASTS if is_shaken else JUMP_LASTS
        m.jump_time, m.jump_seen, m.jump_lacks, m.jump_residual = dt, 0.0, 0.0, 0.0
        m.any_seen = m.any_lacks = 0.0


@subroutine
def take_off(m: WatchedImu, error: V3, time: float) -> None:
    """Take an error of the gyro off that has been there for so long [s]."""
    m.gyro_time, m.jump_time, m.is_found, m.stood, m.since = 0.0, 0.0, 1.0, CALM, 0.0
    for i in range(3):
        m.gyro_off[i] += error[i]
        m.turn[i] = time * error[i]
    forget_turns(m, 0.0)


@subroutine
def judge_accelerometer(
    m: WatchedImu, force: V3, w: V3, v: V3, up: V3, gravity: float, stands: bool, dt: float
) -> None:
    """Name it once its error has lasted, and take the error off.

    ``force``: what it reads, less what is taken off; ``v``: of the IMU by the feet, if they stand.
    """
    s, turning, share = m.speed, cross(w, triple(m.speed)), dt / SETTLING
    for k in range(3):
        s[k] += dt * (force[k] - turning[k] - gravity * up[k])
        if stands:
            m.excess[k] += share * ((s[k] - v[k]) / SETTLING - m.excess[k])
            s[k] += share * (v[k] - s[k])
    m.since += dt
    is_tilt = m.gyro_is_off > 0.0
    if m.stood < (CALM if is_tilt else LONG_CALM) or m.is_found > 0.0:
        put(v, s)
        m.excess[:] = 0.0
    is_fine = m.since < TILTED if is_tilt else m.force_is_off > 0.0
    excess, push = triple(m.excess), triple(m.push)
    amount, rise = np.sqrt(dot(excess, excess)), dot(excess, up)
    is_upwards = abs(rise) > UPWARDS * amount
    sideways, square = plus_scaled(excess, -rise, up), amount**2 - rise**2
    is_pushed = dot(push, sideways) > PUSHED * square
    is_pushed = is_pushed and dot(triple(m.lack), sideways) > (PUSHED - 1.0) * square
    if amount < max(FORCE_LIMIT * (FINER if is_fine else 1.0), STAYING * m.most_excess):
        m.force_time = m.most_excess = 0.0
    elif stands and (is_tilt or is_upwards or not is_pushed):
        m.force_time += dt
        m.most_excess = max(m.most_excess, amount)
    lasts = UPWARDS_LASTS if is_upwards and m.struck == 0.0 else FORCE_LASTS
    if is_tilt:
        lasts = TILT_LASTS
    if m.force_time > lasts and m.gyro_time == 0.0:
        m.force_time, m.is_found = 0.0, 1.0
        if is_tilt or (m.upset > 0.0 and not is_upwards):
            by, measured = cross(up, triple(m.excess)), TILT_SHARE if is_tilt else 1.0
            put(plus_scaled((0.0, 0.0, 0.0), 1.0 / (measured * gravity), by), m.turn)
        else:
            m.force_is_off = 1.0
            for k in range(3):
                m.force_off[k] += m.excess[k]
        put(v, s)
        m.excess[:] = 0.0
