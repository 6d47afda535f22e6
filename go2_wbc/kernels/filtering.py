"""Error-state Kalman filter of the state estimator: predict, take measurements in, correct.

An estimate is a row of ``STATE`` numbers: position and velocity of the IMU in the world, the
quaternion x y z w, the biases of gyro and accelerometer, the feet's centres. Its error is a row of
``ERROR`` numbers, the same with a rotation vector along the world's axes in place of the
quaternion: R_true = exp(theta) R. Measurements are taken in one number after the other, which for
independent ones is the same as all at once (Bierman, *Factorization Methods for Discrete Sequential
Estimation*, 1977, ch. II), and needs no matrix inverse.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.vectors import rotation_of
from go2_wbc.kernels.compilation import subroutine

STATE, ERROR = 28, 27
QUATERNION, GYRO_BIAS, FORCE_BIAS, FEET = 6, 10, 13, 16
"""Where they are in an estimate; the velocity is at 3."""
THETA, HEADING, E_GYRO_BIAS, E_FORCE_BIAS, E_FEET = 6, 8, 9, 12, 15
"""Where they are in its error; the heading's is the last one of theta."""


@subroutine("void(f8[::1], f8, f8, f8, b1)")
def turn(x, a, b, c, in_world):
    """Turn the quaternion of an estimate by a vector along the world's axes or its own."""
    angle = np.sqrt(a * a + b * b + c * c)
    factor = 0.5 if angle < 1e-9 else np.sin(0.5 * angle) / angle
    e0, e1, e2, e3 = factor * a, factor * b, factor * c, np.cos(0.5 * angle)
    q0, q1, q2, q3 = x[6], x[7], x[8], x[9]
    sign = 1.0 if in_world else -1.0  # e q or q e: the vectors' cross product changes its sign
    x[6] = e3 * q0 + q3 * e0 + sign * (e1 * q2 - e2 * q1)
    x[7] = e3 * q1 + q3 * e1 + sign * (e2 * q0 - e0 * q2)
    x[8] = e3 * q2 + q3 * e2 + sign * (e0 * q1 - e1 * q0)
    x[9] = e3 * q3 - e0 * q0 - e1 * q1 - e2 * q2
    length = np.sqrt(x[6] * x[6] + x[7] * x[7] + x[8] * x[8] + x[9] * x[9])
    for i in range(6, 10):
        x[i] /= length


@subroutine("void(f8[:,::1], f8, f8, f8, f8[::1], i8)")
def put_turned(R, a, b, c, row, start):
    """Put R (a, b, c) into its place in a row."""
    for i in range(3):
        row[start + i] = R[i, 0] * a + R[i, 1] * b + R[i, 2] * c


@subroutine("void(f8[:,::1], f8, f8[:,::1], f8[::1], f8[::1])")
def mix(P, dt, R, force, row):
    """One side of F P F': adds to the rows of P what the errors of the state bring about.

    d theta = -R d bias dt; dv = (theta x f - R d bias) dt with f the force in the world.
    """
    for j in range(ERROR):
        t0, t1, t2 = P[THETA, j], P[THETA + 1, j], P[THETA + 2, j]
        row[0] = t1 * force[2] - t2 * force[1]
        row[1] = t2 * force[0] - t0 * force[2]
        row[2] = t0 * force[1] - t1 * force[0]
        for i in range(3):
            turning = 0.0
            for k in range(3):
                row[i] -= R[i, k] * P[E_FORCE_BIAS + k, j]
                turning += R[i, k] * P[E_GYRO_BIAS + k, j]
            P[i, j] += dt * P[3 + i, j] + 0.5 * dt * dt * row[i]
            P[3 + i, j] += dt * row[i]
            P[THETA + i, j] -= dt * turning


@subroutine("void(f8[::1], f8[:,::1], f8, f8[::1], f8[::1], f8, f8[:,::1], f8[::1])")
def predict(x, P, dt, w, reading, gravity, R, noise):
    """Move the estimate on by ``dt``: turned by w, driven by the accelerometer.

    ``noise``: variances that the step adds to each number of the error. R is work space.
    P is made symmetric: what rounding leaves grows tenfold in half a minute of measurements, and in
    five minutes the gains were wrong by so much that a robot on its sensors fell in any motion.
    """
    force, row = np.empty(3), np.empty(3)
    turn(x, 0.5 * dt * w[0], 0.5 * dt * w[1], 0.5 * dt * w[2], False)
    rotation_of(x[6], x[7], x[8], x[9], R)
    a, b, c = (
        reading[4] - x[FORCE_BIAS],
        reading[5] - x[FORCE_BIAS + 1],
        reading[6] - x[FORCE_BIAS + 2],
    )
    put_turned(R, a, b, c, force, 0)
    for i in range(3):
        acceleration = force[i] - (gravity if i == 2 else 0.0)
        x[i] += dt * x[3 + i] + 0.5 * dt * dt * acceleration
        x[3 + i] += dt * acceleration
    turn(x, 0.5 * dt * w[0], 0.5 * dt * w[1], 0.5 * dt * w[2], False)
    mix(P, dt, R, force, row)
    for i in range(ERROR):
        for j in range(i):
            P[i, j], P[j, i] = P[j, i], P[i, j]
    mix(P, dt, R, force, row)
    for i in range(ERROR):
        P[i, i] += noise[i]
        for j in range(i):
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i])


@subroutine("void(f8[:,::1], f8[::1], f8[::1], i8[::1], f8[::1], i8, f8, f8)")
def take_in(P, dx, column, places, shares, count, innovation, variance):
    """Take in a number that is a sum of ``count`` numbers of the error, at ``places``.

    ``innovation``: what was measured beyond the prediction. dx is the error as found so far,
    ``column`` work space.
    """
    expected, spread = 0.0, variance
    for i in range(ERROR):
        column[i] = 0.0
    for n in range(count):
        row, share = P[places[n]], shares[n]
        expected += share * dx[places[n]]
        for i in range(ERROR):
            column[i] += share * row[i]
    for n in range(count):
        spread += shares[n] * column[places[n]]
    gain = (innovation - expected) / spread
    for i in range(ERROR):
        dx[i] += gain * column[i]
        scaled = column[i] / spread
        for j in range(ERROR):
            P[i, j] -= scaled * column[j]


@subroutine("void(f8[:,::1], f8[::1], f8[::1], i8, f8, f8)")
def take_in_one(P, dx, column, place, innovation, variance):
    """Take in a measurement of one number of the error."""
    places, shares = np.full(1, place), np.ones(1)
    take_in(P, dx, column, places, shares, 1, innovation, variance)


@subroutine("void(f8[:,::1], f8[::1], f8[:,::1], f8)")
def learn_in_part(P, dx, before, share):
    """Take back all but a ``share`` of what corrects the biases; ``before``: their part of P.

    Brink, *Partial-update Schmidt-Kalman filter*, J. Guidance, Control, and Dynamics 40 (2017):
    the rest of the error stays as uncertain as if nothing had been measured.
    """
    left = (1.0 - share) ** 2
    for i in range(6):
        dx[E_GYRO_BIAS + i] *= share
        for j in range(6):
            m, n = E_GYRO_BIAS + i, E_GYRO_BIAS + j
            P[m, n] += left * (before[i, j] - P[m, n])


@subroutine("void(f8[:,::1])")
def turn_world_about_robot(P):
    """Let an error of the heading turn the world about the robot, no more about where it began.

    All places share an error that goes with the heading's, by the whole way walked since: what
    tells of the heading would move them, and a robot that is to stay where it stands would follow
    over its feet. That error is kept in P, as one that is independent of the heading.
    """
    variance = P[HEADING, HEADING]
    if variance <= 0.0:
        return
    gains, heading = np.zeros(ERROR), P[HEADING].copy()
    for k in range(2):
        gain = heading[k] / variance
        gains[k] = gain
        for foot in range(4):
            gains[E_FEET + 3 * foot + k] = gain
    for i in range(ERROR):
        for j in range(ERROR):
            both = gains[i] * gains[j] * variance
            P[i, j] += 2.0 * both - gains[i] * heading[j] - heading[i] * gains[j]


@subroutine("void(f8[::1], f8[::1])")
def correct(x, dx):
    """Put the error that was found into the estimate."""
    for i in range(6):
        x[i] += dx[i]
    turn(x, dx[THETA], dx[THETA + 1], dx[THETA + 2], True)
    for i in range(E_GYRO_BIAS, ERROR):
        x[i + 1] += dx[i]
