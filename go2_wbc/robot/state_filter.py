"""Error-state Kalman filter of the state estimator: predict, take measurements in, correct.

The state x (28) and its error (27), which has a rotation vector along the world's axes in the place
of the quaternion, R_true = exp(theta) R:

    x     = (p, v, quaternion, b_g, b_f, f_1 .. f_4)
    error = (dp, dv, theta, db_g, db_f, df_1 .. df_4)

p and v are those of the IMU, b_g and b_f the biases of gyro and accelerometer, f_i the feet's
centres. With w the turning and a the force that the IMU measures, less their biases:

    x:  p += dt v + dt^2/2 (R a - g),  v += dt (R a - g),  R <- R exp(dt w)     R: midway
    F:  dp += dt dv + dt^2/2 e,  dv += dt e,  theta -= dt R db_g,    e = theta x R a - R db_f
    Q:  diagonal, see ``process_noise``; what feet and biases drift is independent of all else

A measurement is a number that is a sum h of a few of the error's, and noise of variance r:

    s = h P h' + r,  K = P h' / s,  error += K (innovation - h error),  P -= K h P

Numbers are taken in one after the other, which for independent ones is the same as all at once
(Bierman, *Factorization Methods for Discrete Sequential Estimation*, 1977, ch. II), and needs no
matrix inverse.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.algebra.linear import put, rotation_of, turned
from go2_wbc.compilation import subroutine
from go2_wbc.records import V3, Array3, Array3x3, Array4, Array4x3, Record, layout_of
from go2_wbc.robot.estimator_config import EstimatorConfig


class Estimate(Record):
    """The state."""

    p: Array3  #: position [m] of the IMU in the world
    v: Array3  #: velocity [m/s] of the IMU in the world
    quaternion: Array4  #: x y z w, of the trunk
    gyro_bias: Array3  #: [rad/s] in the base frame
    force_bias: Array3  #: of the accelerometer [m/s^2]
    p_feet: Array4x3  #: centres of the feet in the world [m]


class EstimateError(Record):
    """Its error, or its deviations; the places of its parts are those of rows and columns of P."""

    p: Array3
    v: Array3
    theta: Array3
    gyro_bias: Array3
    force_bias: Array3
    p_feet: Array4x3


_, VELOCITY, THETA, GYRO_BIAS, FORCE_BIAS, FEET = (
    field.start for field in layout_of(EstimateError).fields.values()
)
"""Where the parts of the error begin."""
HEADING = THETA + 2
ERROR = layout_of(EstimateError).size
Covariance = Float[np.ndarray, "27 27"]


class Filter(Record):
    """The filter between two ticks, and what a tick works with."""

    x: Estimate  #: the state
    P: Covariance  #: of its error
    error: Float[np.ndarray, "27"]  #: as found so far in this tick
    column: Float[np.ndarray, "27"]  #: work space, P h'


@subroutine
def turn(quaternion: Array4, by: V3, in_world: bool) -> None:
    """Turn a quaternion by a rotation vector [rad] along the world's axes or its own."""
    a, b, c = by
    angle = np.sqrt(a * a + b * b + c * c)
    factor = 0.5 if angle < 1e-9 else np.sin(0.5 * angle) / angle
    e0, e1, e2, e3 = factor * a, factor * b, factor * c, np.cos(0.5 * angle)
    q0, q1, q2, q3 = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    sign = 1.0 if in_world else -1.0  # e q or q e: the vectors' cross product changes its sign
    x = e3 * q0 + q3 * e0 + sign * (e1 * q2 - e2 * q1)
    y = e3 * q1 + q3 * e1 + sign * (e2 * q0 - e0 * q2)
    z = e3 * q2 + q3 * e2 + sign * (e0 * q1 - e1 * q0)
    w = e3 * q3 - e0 * q0 - e1 * q1 - e2 * q2
    length = np.sqrt(x * x + y * y + z * z + w * w)
    quaternion[0], quaternion[1] = x / length, y / length
    quaternion[2], quaternion[3] = z / length, w / length


@subroutine
def rotation_of_estimate(x: Estimate, R: Array3x3) -> None:
    """Fill the rotation matrix of the trunk."""
    q = x.quaternion
    rotation_of(q[0], q[1], q[2], q[3], R)


@subroutine
def process_noise(c: EstimatorConfig, dt: float, noise: Float[np.ndarray, "27"]) -> None:
    """Fill the variances Q that a step adds to all but the feet."""
    noise[:] = 0.0
    for k in range(3):
        noise[k] = (0.5 * c.acceleration * dt * dt) ** 2
        noise[VELOCITY + k] = (c.acceleration * dt) ** 2
        noise[THETA + k] = (c.gyro * dt) ** 2
        noise[GYRO_BIAS + k] = c.gyro_bias_walk**2 * dt
        noise[FORCE_BIAS + k] = c.accelerometer_bias_walk**2 * dt


@subroutine
def mix(P: Covariance, dt: float, R: Array3x3, force: Array3, row: Array3) -> None:
    """One side of F P F': adds to the rows of P what the errors of the state bring about.

    ``force`` is R a; ``row`` is work space.
    """
    for j in range(ERROR):
        t0, t1, t2 = P[THETA, j], P[THETA + 1, j], P[THETA + 2, j]
        row[0] = t1 * force[2] - t2 * force[1]
        row[1] = t2 * force[0] - t0 * force[2]
        row[2] = t0 * force[1] - t1 * force[0]
        for i in range(3):
            turning = 0.0
            for k in range(3):
                row[i] -= R[i, k] * P[FORCE_BIAS + k, j]
                turning += R[i, k] * P[GYRO_BIAS + k, j]
            P[i, j] += dt * P[VELOCITY + i, j] + 0.5 * dt * dt * row[i]
            P[VELOCITY + i, j] += dt * row[i]
            P[THETA + i, j] -= dt * turning


@subroutine
def predict(
    f: Filter,
    dt: float,
    w: Array3,
    accelerometer: Array3,
    gravity: float,
    R: Array3x3,
    noise: Float[np.ndarray, "27"],
) -> None:
    """Move the estimate on by ``dt``: turned by w, driven by the accelerometer.

    ``noise``: the variances Q. R is work space.
    P is made symmetric: what rounding leaves grows tenfold in half a minute of measurements, and in
    five minutes the gains were wrong by so much that a robot on its sensors fell in any motion.
    """
    x, P, force, row = f.x, f.P, np.empty(3), np.empty(3)
    half = 0.5 * dt * w[0], 0.5 * dt * w[1], 0.5 * dt * w[2]
    turn(x.quaternion, half, False)
    rotation_of_estimate(x, R)
    a, bias = accelerometer, x.force_bias
    put(turned(R, (a[0] - bias[0], a[1] - bias[1], a[2] - bias[2])), force)
    for i in range(3):
        acceleration = force[i] - (gravity if i == 2 else 0.0)
        x.p[i] += dt * x.v[i] + 0.5 * dt * dt * acceleration
        x.v[i] += dt * acceleration
    turn(x.quaternion, half, False)
    mix(P, dt, R, force, row)
    for i in range(ERROR):
        for j in range(i):
            P[i, j], P[j, i] = P[j, i], P[i, j]
    mix(P, dt, R, force, row)
    for i in range(ERROR):
        P[i, i] += noise[i]
        for j in range(i):
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i])


@subroutine
def take_in(
    f: Filter,
    places: Int[np.ndarray, " k"],
    shares: Float[np.ndarray, " k"],
    count: int,
    innovation: float,
    variance: float,
) -> None:
    """Take in a number that is a sum of ``count`` numbers of the error, at ``places``.

    ``shares`` are those of h; ``innovation``: what was measured beyond the prediction.
    """
    P, error, column = f.P, f.error, f.column
    expected, spread = 0.0, variance
    for i in range(ERROR):
        column[i] = 0.0
    for n in range(count):
        row, share = P[places[n]], shares[n]
        expected += share * error[places[n]]
        for i in range(ERROR):
            column[i] += share * row[i]
    for n in range(count):
        spread += shares[n] * column[places[n]]
    gain = (innovation - expected) / spread
    for i in range(ERROR):
        error[i] += gain * column[i]
        scaled = column[i] / spread
        for j in range(ERROR):
            P[i, j] -= scaled * column[j]


@subroutine
def take_in_one(f: Filter, place: int, innovation: float, variance: float) -> None:
    """Take in a measurement of one number of the error."""
    places, shares = np.full(1, place), np.ones(1)
    take_in(f, places, shares, 1, innovation, variance)


@subroutine
def learn_in_part(f: Filter, before: Float[np.ndarray, "6 6"], share: float) -> None:
    """Take back all but a ``share`` of what corrects the biases; ``before``: their part of P.

    Brink, *Partial-update Schmidt-Kalman filter*, J. Guidance, Control, and Dynamics 40 (2017):
    the rest of the error stays as uncertain as if nothing had been measured.
    """
    P, left = f.P, (1.0 - share) ** 2
    for i in range(6):
        f.error[GYRO_BIAS + i] *= share
        for j in range(6):
            m, n = GYRO_BIAS + i, GYRO_BIAS + j
            P[m, n] += left * (before[i, j] - P[m, n])


@subroutine
def turn_world_about_robot(P: Covariance) -> None:
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
            gains[FEET + 3 * foot + k] = gain
    for i in range(ERROR):
        for j in range(ERROR):
            both = gains[i] * gains[j] * variance
            P[i, j] += 2.0 * both - gains[i] * heading[j] - heading[i] * gains[j]


@subroutine
def correct(f: Filter) -> None:
    """Put the error that was found into the estimate."""
    x, error = f.x, f.error
    for k in range(3):
        x.p[k] += error[k]
        x.v[k] += error[VELOCITY + k]
        x.gyro_bias[k] += error[GYRO_BIAS + k]
        x.force_bias[k] += error[FORCE_BIAS + k]
        for leg in range(4):
            x.p_feet[leg, k] += error[FEET + 3 * leg + k]
    turn(x.quaternion, (error[THETA], error[THETA + 1], error[THETA + 2]), True)
