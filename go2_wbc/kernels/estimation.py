"""One step of the state estimator; ``robot.estimator`` describes the filter.

What feet, gyro and accelerometer tell, and how far each is believed; estimates, their errors and
the filter's equations are those of ``kernels.filtering``.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.vectors import rotation_of
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.filtering import (
    E_FEET,
    E_GYRO_BIAS,
    ERROR,
    FEET,
    FORCE_BIAS,
    GYRO_BIAS,
    THETA,
    correct,
    learn_in_part,
    predict,
    put_turned,
    take_in,
    take_in_one,
    turn_world_about_robot,
)

MEMORY, READING = 26, 35
"""Lengths: of what is kept from tick to tick (the time [s] at rest, the ages [s] of the feet's
contacts, the gyro, the joints' smoothed speeds, the time [s] lying, the height [m] of the ground,
the time [s] for which it is not believed, the times [s] for which the estimate has been lost and
for which no biases are learnt, and whether the robot has tumbled), and of a reading (dt, gyro,
accelerometer, angles, speeds, forces)."""
_LYING, LEVEL, _DOUBT, _LOST, _UPSET, _TUMBLED = range(20, 26)
LEAST_TRUST = 1e-3
"""Trust in a foot in the air: its place drifts a thousand times as fast as a standing one's."""
_SMOOTHING = 0.05
"""Time constant [s] in which the joints' speeds are smoothed, to tell slow motion from noise."""
_FLIGHT, _ARM = 0.5, 0.1
"""Share of gravity that a trunk feels at least if something carries it, while in flight it feels
none; and the greatest distance [m] of the CoM from the IMU, by which one that turns feels w^2 r."""
_HEIGHT_GATE = 9.0
"""Square of the deviations by which a foot's height may be off that of flat ground; else it stands
on something else, and its height says nothing."""
KNOWN, TUMBLED, LOST = range(3)
"""Whether an estimate holds, or has to begin anew."""
_UPRIGHT = np.cos(np.radians(15.0))
"""Cosine of the angle between the accelerometer's up and the estimate's, at rest, if it is lost."""
_OVER, _CALM = np.cos(np.radians(50.0)), 1.0
"""Cosine of the tilt from which on a robot is tumbling, and for how long [s] after it has lain or
tumbled no biases are learnt: the trunk and what slides beside it tell wrong velocities."""
_RUNAWAY, _BIASES = 0.5, 5.0
"""Speed [m/s] that an estimate of a robot at rest has if it is lost, and by how many deviations a
bias is then off 0."""
_LEVEL_SHARE = 0.2
"""Share of a landing foot's height in that of the ground, while this is not believed."""


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8, f8[:,::1], f8[::1])")
def see_foot(leg, q, u, p_imu, w, radius, R, foot):
    """Fill what a leg measures, along the world's axes.

    Place of the foot's centre from the IMU (3), the velocity of the IMU if the foot rolls on the
    ground (3), that of the foot's centre then (3), and its speed along the trunk. ``leg`` is
    ``LegGeometry.row``, q and u are the angles and speeds of its joints, w the angular velocity of
    the base.
    """
    c1, s1, c2, s2 = np.cos(q[0]), np.sin(q[0]), np.cos(q[1]), np.sin(q[1])
    c3, s3, bend = np.cos(q[1] + q[2]), np.sin(q[1] + q[2]), u[1] + u[2]
    width, thigh, calf = leg[3], leg[4], leg[5]
    down = thigh * c2 + calf * c3
    longer = -thigh * s2 * u[1] - calf * s3 * bend
    x = leg[0] - thigh * s2 - calf * s3 - p_imu[0]
    y = leg[1] + width * c1 + down * s1 - p_imu[1]
    z = leg[2] + width * s1 - down * c1 - p_imu[2]
    dx = -thigh * c2 * u[1] - calf * c3 * bend
    dy = longer * s1 + (down * c1 - width * s1) * u[0]
    foot[9] = np.sqrt(dx * dx + dy * dy)
    dx += w[1] * z - w[2] * y
    dy += w[2] * x - w[0] * z
    dz = (width * c1 + down * s1) * u[0] - longer * c1 + w[0] * y - w[1] * x
    put_turned(R, x, y, z, foot, 0)
    put_turned(R, -dx, -dy, -dz, foot, 3)
    put_turned(R, w[0] + u[0], w[1] + c1 * bend, w[2] + s1 * bend, foot, 6)
    foot[6], foot[7], foot[8] = radius * foot[7], -radius * foot[6], 0.0  # w x (0, 0, r)
    foot[3] += foot[6]
    foot[4] += foot[7]


@subroutine("void(f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1], i8, f8, f8[::1])")
def take_in_leg(x, P, dx, column, foot, leg, place, velocity):
    """Take in what a leg measures, with these variances; velocities with 0 are left out.

    A turn of the estimate turns a leg's velocity with it, by theta x v. The estimate is put there
    for v, not what the leg measures: its noise would stand in the gain and in what that multiplies,
    and a mean of their product, which tilted a standing robot by a degree a minute.
    """
    places, shares = np.empty(4, np.int64), np.empty(4)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        # R s = f - p - theta x R s; the k-th number of the product has those at i and j
        places[0], places[1], places[2], places[3] = (
            E_FEET + 3 * leg + k,
            k,
            THETA + i,
            THETA + j,
        )
        shares[0], shares[1], shares[2], shares[3] = 1.0, -1.0, -foot[j], foot[i]
        off = foot[k] - x[FEET + 3 * leg + k] + x[k]
        take_in(P, dx, column, places, shares, 4, off, place)
        if velocity[k] > 0.0:
            places[1], shares[1] = 3 + k, 1.0
            shares[2], shares[3] = -x[3 + j], x[3 + i]
            off = foot[3 + k] - x[3 + k]
            take_in(P, dx, column, places[1:], shares[1:], 3, off, velocity[k])


@subroutine("f8(f8[::1], f8[:,::1], f8[::1], f8[::1], f8)")
def slip_factor(x, P, foot, variances, gate):
    """Factor on the variances of a foot that stands: above 1 if it moves as no standing one would.

    With chi^2 the square of the velocity's innovation over its variance, and the gate its greatest
    usual root: max(1, chi^2 / gate^2), so that an outlier counts by its size no longer (Huber,
    *Robust Statistics*, 1981).
    """
    chi = 0.0
    for k in range(3):
        off = foot[3 + k] - x[3 + k]
        chi += off * off / (P[3 + k, 3 + k] + variances[k])
    return max(1.0, chi / (gate * gate))


@subroutine("b1(f8[::1], f8[::1], f8[::1], f8, f8[::1])")
def is_at_rest(x, memory, reading, gravity, numbers):
    """Whether joints, gyro and accelerometer have read rest for long enough."""
    speed, turning, force = 0.0, 0.0, 0.0
    share = min(reading[0] / _SMOOTHING, 1.0)
    for n in range(12):
        memory[8 + n] += share * (reading[19 + n] - memory[8 + n])
        speed += memory[8 + n] ** 2 / 12.0
    for k in range(3):
        turning += (reading[1 + k] - x[GYRO_BIAS + k]) ** 2
        force += (reading[4 + k] - x[FORCE_BIAS + k]) ** 2
    is_still = (
        speed < numbers[STILL_JOINTS] ** 2
        and turning < numbers[STILL_TURNING] ** 2
        and abs(np.sqrt(force) - gravity) < numbers[STILL_FORCE]
    )
    memory[0] = memory[0] + reading[0] if is_still else 0.0
    return memory[0] >= numbers[STILL_TIME]


@subroutine("b1(f8[::1], f8[::1], f8[::1], b1, f8, f8[::1])")
def lies(x, memory, reading, is_carried, gravity, numbers):
    """Whether something else than the feet has carried the robot for long enough."""
    force, turning = 0.0, 0.0
    for k in range(3):
        force += (reading[4 + k] - x[FORCE_BIAS + k]) ** 2
        turning += (reading[1 + k] - x[GYRO_BIAS + k]) ** 2
    is_lying = not is_carried and np.sqrt(force) > _FLIGHT * gravity + _ARM * turning  # w^2 r
    memory[_LYING] = memory[_LYING] + reading[0] if is_lying else 0.0
    return memory[_LYING] >= numbers[LYING_TIME]


@subroutine("i8(f8[::1], f8[::1], f8[::1], f8[:,::1], f8, f8[::1])")
def begin_anew(x, memory, reading, R, gravity, numbers):
    """``KNOWN``, ``TUMBLED`` if a robot that did is at rest on its belly or feet, or ``LOST``.

    Lost is who has taken a trunk at rest, for long enough, for one that is tilted or moves. Rest is
    told by the readings alone: an estimate that is lost has lost the biases, too. Jolts, as of legs
    that are drawn in, are taken off the time at rest.
    """
    turning, force, upwards, speed, joints, most = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        turning += reading[1 + k] ** 2
        force += reading[4 + k] ** 2
        upwards += R[2, k] * reading[4 + k]
        speed += x[3 + k] ** 2
        most = max(most, abs(x[GYRO_BIAS + k]) / numbers[GYRO_BIAS_DEVIATION])
        most = max(most, abs(x[FORCE_BIAS + k]) / numbers[FORCE_BIAS_DEVIATION])
    for n in range(12):
        joints += memory[8 + n] ** 2 / 12.0
    force = np.sqrt(force)
    if R[2, 2] < _OVER:
        memory[_TUMBLED] = 1.0
    moves = speed > _RUNAWAY**2 and joints < numbers[STILL_JOINTS] ** 2
    is_lost = moves or upwards < _UPRIGHT * force or most > _BIASES
    if not (is_lost or (memory[_TUMBLED] > 0.0 and R[2, 2] > _OVER)):
        memory[_LOST] = 0.0
        return KNOWN
    is_still = turning < numbers[STILL_TURNING] ** 2 and abs(force - gravity) < numbers[STILL_FORCE]
    memory[_LOST] = max(memory[_LOST] + (reading[0] if is_still else -reading[0]), 0.0)
    if memory[_LOST] < numbers[STILL_TIME]:
        return KNOWN
    return LOST if is_lost else TUMBLED


@subroutine("b1(f8[::1], f8, b1, f8[:,::1])")
def is_upset(memory, dt, is_lying, R):
    """Whether the robot lies or is tilted far, or has been until a moment ago."""
    is_down = is_lying or R[2, 2] < _OVER
    memory[_UPSET] = _CALM if is_down else max(memory[_UPSET] - dt, 0.0)
    return memory[_UPSET] > 0.0


@subroutine("f8(f8[::1], f8)")
def learning(x, speed):
    """Share of their corrections that the biases take: 1 at rest, half at ``speed``."""
    ratio = (x[3] * x[3] + x[4] * x[4]) / (speed * speed)
    return 1.0 / (1.0 + ratio * ratio)


@subroutine("f8(f8[::1], f8, f8, f8[::1])")
def height_off(memory, ground, variance, numbers):
    """How far the ground is above ``ground`` [m], where a foot stands on it; inf if unknown.

    ``variance``: of that difference. Once a foot has come down on something else, the ground is
    not level: its height follows the feet, and says nothing of them for a while.
    """
    off = memory[LEVEL] - ground
    if abs(off) > numbers[UNEVEN] or off * off > _HEIGHT_GATE * variance:
        memory[_DOUBT] = numbers[UNEVEN_TIME]
    if memory[_DOUBT] > 0.0:
        memory[LEVEL] -= _LEVEL_SHARE * off
        return np.inf
    return off


@subroutine("void(f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], b1)")
def take_in_rest(x, P, dx, column, reading, numbers, is_carried):
    """Take in that nothing moves: no velocity, and a gyro that reads its bias.

    Of a robot that its feet carry the gyro's bias is learnt by these: slow turns of its trunk read
    as rest, too.
    """
    for k in range(3):
        take_in_one(P, dx, column, 3 + k, -x[3 + k], numbers[STILL_VELOCITY] ** 2)
        if not is_carried:
            off = reading[1 + k] - x[GYRO_BIAS + k]
            take_in_one(P, dx, column, E_GYRO_BIAS + k, off, numbers[STILL_GYRO] ** 2)


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1])")
def report(x, reading, w, p_imu, R, q, v):
    """Fill q (19,) and v (18,) of a ``RobotState`` from the motion of the IMU."""
    rotation_of(x[6], x[7], x[8], x[9], R)
    turning = (
        w[1] * p_imu[2] - w[2] * p_imu[1],
        w[2] * p_imu[0] - w[0] * p_imu[2],
        w[0] * p_imu[1] - w[1] * p_imu[0],
    )
    for i in range(3):
        q[i], v[i], v[3 + i] = x[i], -turning[i], w[i]
        for k in range(3):
            q[i] -= R[i, k] * p_imu[k]
            v[i] += R[k, i] * x[3 + k]
    q[3:7] = x[6:10]
    q[7:], v[6:] = reading[7:19], reading[19:31]


ACCELERATION, FOOT_DRIFT, PLACE, VELOCITY, HEIGHT, CONTACT, TRUSTED, REST = range(8)
GYRO, GYRO_WALK, FORCE_WALK, GATE, STILL_TIME, STILL_JOINTS, STILL_TURNING = range(8, 15)
STILL_FORCE, STILL_VELOCITY, STILL_DRIFT, RADIUS, GRAVITY = range(15, 20)
TOUCHDOWN_SLIP, TOUCHDOWN_TIME, VERTICAL, COMPLIANCE, STILL_GYRO = range(20, 25)
VERTICAL_SHARE, LYING_TIME, LEARNING_SPEED, DRIFT_SHARE, VELOCITY_SHARE = range(25, 30)
UNEVEN, UNEVEN_TIME, GYRO_BIAS_DEVIATION, FORCE_BIAS_DEVIATION = range(30, 34)
SETTLED_DRIFT, SETTLED_TIME = range(34, 36)
"""What ``numbers`` holds: those of ``EstimatorConfig``, foot radius [m] and gravity [m/s^2]."""


@subroutine("void(f8, f8[::1], f8[::1])")
def add_noise(dt, numbers, noise):
    """Fill the variances that a step adds to all but the feet."""
    for k in range(3):
        noise[k] = (0.5 * numbers[ACCELERATION] * dt * dt) ** 2
        noise[3 + k] = (numbers[ACCELERATION] * dt) ** 2
        noise[6 + k] = (numbers[GYRO] * dt) ** 2
        noise[9 + k] = numbers[GYRO_WALK] ** 2 * dt
        noise[12 + k] = numbers[FORCE_WALK] ** 2 * dt


@kernel("i8(f8[::1], f8[:,::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def estimate(x, P, memory, reading, legs, p_imu, numbers, q, v):
    """Take in a reading, ``reading[0]`` seconds after the last one, and fill the robot's state.

    Returns whether the estimate has to begin anew, and why; see ``begin_anew``.
    """
    dt, radius, gravity = reading[0], numbers[RADIUS], numbers[GRAVITY]
    w, mean, R, noise = np.empty(3), np.empty(3), np.empty((3, 3)), np.zeros(ERROR)
    feet, velocities, heights = np.empty((4, 10)), np.zeros((4, 3)), np.empty(4)
    dx, column = np.zeros(ERROR), np.empty(ERROR)
    for k in range(3):
        w[k] = reading[1 + k] - x[GYRO_BIAS + k]
        mean[k] = 0.5 * (reading[1 + k] + memory[5 + k]) - x[GYRO_BIAS + k]
        memory[5 + k] = reading[1 + k]
    add_noise(dt, numbers, noise)
    rests = is_at_rest(x, memory, reading, gravity, numbers)
    predict(x, P, dt, mean, reading, gravity, R, noise)
    rotation_of(x[6], x[7], x[8], x[9], R)
    vertical = numbers[VERTICAL] + numbers[VERTICAL_SHARE] * np.sqrt(x[3] * x[3] + x[4] * x[4])
    biases = slice(E_GYRO_BIAS, E_FEET)
    before, share_learnt = P[biases, biases].copy(), learning(x, numbers[LEARNING_SPEED])
    is_carried, memory[_DOUBT] = False, max(memory[_DOUBT] - dt, 0.0)
    for leg in range(4):
        foot = feet[leg]
        angles = slice(7 + 3 * leg, 10 + 3 * leg)
        speeds = slice(19 + 3 * leg, 22 + 3 * leg)
        force = reading[31 + leg]
        pressed = radius - 0.5 * numbers[COMPLIANCE] * force
        see_foot(legs[leg], reading[angles], reading[speeds], p_imu, w, pressed, R, foot)
        age = memory[1 + leg] if force > numbers[CONTACT] else -dt
        slip = numbers[TOUCHDOWN_SLIP] * np.exp(-max(age, 0.0) / numbers[TOUCHDOWN_TIME])
        share = (force - numbers[CONTACT]) / (numbers[TRUSTED] - numbers[CONTACT])
        trust = min(max(share, LEAST_TRUST), 1.0)
        memory[1 + leg] = age + dt
        creeping = numbers[SETTLED_DRIFT if age > numbers[SETTLED_TIME] else FOOT_DRIFT]
        level = creeping / trust + slip + numbers[DRIFT_SHARE] * foot[9]
        factor = 1.0
        if trust > LEAST_TRUST:
            is_carried = True
            creep = numbers[VELOCITY_SHARE] * foot[9]
            velocities[leg, :2] = (numbers[VELOCITY] / trust) ** 2 + slip * slip + creep * creep
            velocities[leg, 2] = velocities[leg, 0] + vertical * vertical
            factor = slip_factor(x, P, foot, velocities[leg], numbers[GATE])
            velocities[leg] *= factor
        for k in range(3):
            drift = level if k < 2 else level + vertical
            if rests:
                drift = numbers[STILL_DRIFT]
            P[E_FEET + 3 * leg + k, E_FEET + 3 * leg + k] += factor * (drift * dt) ** 2
            x[FEET + 3 * leg + k] += dt * foot[6 + k]
        z, heights[leg], settled = 2 + 3 * leg, np.inf, 3.0 * numbers[TOUCHDOWN_TIME]
        if age < settled <= age + dt:
            ground = x[FEET + z] - radius + numbers[COMPLIANCE] * force
            variance = P[E_FEET + z, E_FEET + z] + numbers[HEIGHT] ** 2
            heights[leg] = height_off(memory, ground, variance, numbers)
    place = numbers[PLACE] ** 2
    for leg in range(4):
        take_in_leg(x, P, dx, column, feet[leg], leg, place, velocities[leg])
        if heights[leg] != np.inf:
            off = heights[leg]
            take_in_one(P, dx, column, E_FEET + 2 + 3 * leg, off, numbers[HEIGHT] ** 2)
    is_lying = lies(x, memory, reading, is_carried, gravity, numbers)
    if is_upset(memory, dt, is_lying, R) and not rests:
        share_learnt = 0.0
    if rests:
        take_in_rest(x, P, dx, column, reading, numbers, is_carried)
    elif is_lying:
        for k in range(3):
            take_in_one(P, dx, column, 3 + k, -x[3 + k], numbers[REST] ** 2)
    learn_in_part(P, dx, before, share_learnt)
    turn_world_about_robot(P)
    correct(x, dx)
    for k in range(3):
        w[k] = reading[1 + k] - x[GYRO_BIAS + k]
    report(x, reading, w, p_imu, R, q, v)
    return begin_anew(x, memory, reading, R, gravity, numbers)
