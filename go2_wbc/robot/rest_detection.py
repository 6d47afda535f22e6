"""Whether a robot rests, lies or has tumbled, or its estimate is lost, by its sensor readings.

At rest the joints do not move, and the IMU measures gravity alone and no rotation. A lying robot is
told from one in flight by the gravity that its trunk measures, beyond the centripetal acceleration
that the IMU of a rotating robot measures beside the CoM. Each has to last: see ``EstimatorConfig``.
To the filter (``state_filter``) rest is a measurement of the velocity, and lying at rest one of the
gyro's bias, too.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.linear import dot, triple
from go2_wbc.compilation import subroutine
from go2_wbc.records import Array3, Array3x3, Array12, Record
from go2_wbc.robot.estimator_config import EstimatorConfig
from go2_wbc.robot.state import SensorReading
from go2_wbc.robot.state_filter import GYRO_BIAS, VELOCITY, Estimate, Filter, take_in_one

_SMOOTHING = 0.05
"""Time constant [s] in which the joints' speeds are smoothed, to tell slow motion from noise."""
_FLIGHT, _ARM = 0.5, 0.1
"""Share of gravity that a trunk feels at least if something carries it, while in flight it feels
none; and the greatest distance [m] of the CoM from the IMU, by which one that turns feels w^2 r."""
KNOWN, TUMBLED, LOST = range(3)  #: Whether an estimate holds, or has to begin anew
_UPRIGHT = np.cos(np.radians(15.0))
"""Cosine of the angle between the accelerometer's up and the estimate's, at rest, if it is lost."""
_OVER, _CALM = np.cos(np.radians(50.0)), 1.0
"""Cosine of the tilt from which on a robot is tumbling, and for how long [s] after it has lain or
tumbled no biases are learnt: the trunk and what slides beside it tell wrong velocities."""
_RUNAWAY, _BIASES = 0.5, 5.0
"""Speed [m/s] that an estimate of a robot at rest has if it is lost, and by how many deviations a
bias is then off 0."""


class Rest(Record):
    """What is remembered of it."""

    joint_speeds: Array12  #: smoothed [rad/s]
    still_time: float  #: for which all has been at rest [s]
    lying_time: float  #: for which something else than the feet has carried the robot [s]
    lost_time: float  #: for which the estimate has been lost [s]
    upset_time: float  #: for which no biases are learnt [s]
    tumbled: bool  #: whether the robot has


@subroutine
def squared(a: Array3, b: Array3) -> float:
    """|a - b|^2."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@subroutine
def has_still_joints(rest: Rest, c: EstimatorConfig) -> bool:
    """Whether the joints, smoothed, hardly move."""
    speed = 0.0
    for n in range(12):
        speed += rest.joint_speeds[n] ** 2 / 12.0
    return bool(speed < c.still_joints**2)


@subroutine
def is_at_rest(
    x: Estimate, rest: Rest, reading: SensorReading, dt: float, gravity: float, c: EstimatorConfig
) -> bool:
    """Whether joints, gyro and accelerometer have read rest for long enough."""
    share = min(dt / _SMOOTHING, 1.0)
    for n in range(12):
        rest.joint_speeds[n] += share * (reading.v_joints[n] - rest.joint_speeds[n])
    force = np.sqrt(squared(reading.accelerometer, x.force_bias))
    is_still = (
        has_still_joints(rest, c)
        and squared(reading.gyro, x.gyro_bias) < c.still_turning**2
        and abs(force - gravity) < c.still_force
    )
    rest.still_time = rest.still_time + dt if is_still else 0.0
    return bool(rest.still_time >= c.still_time)


@subroutine
def lies(
    x: Estimate,
    rest: Rest,
    reading: SensorReading,
    dt: float,
    is_carried: bool,
    gravity: float,
    c: EstimatorConfig,
) -> bool:
    """Whether something else than the feet has carried the robot for long enough."""
    force = np.sqrt(squared(reading.accelerometer, x.force_bias))
    turning = squared(reading.gyro, x.gyro_bias)
    is_lying = not is_carried and force > _FLIGHT * gravity + _ARM * turning  # w^2 r
    rest.lying_time = rest.lying_time + dt if is_lying else 0.0
    return bool(rest.lying_time >= c.lying_time)


@subroutine
def begin_anew(
    x: Estimate,
    rest: Rest,
    reading: SensorReading,
    dt: float,
    R: Array3x3,
    gravity: float,
    c: EstimatorConfig,
) -> int:
    """``KNOWN``, ``TUMBLED`` if a robot that did is at rest on its belly or feet, or ``LOST``.

    Lost is who has taken a trunk at rest, for long enough, for one that is tilted or moves. Rest is
    told by the readings alone: an estimate that is lost has lost the biases, too. Jolts, as of legs
    that are drawn in, are taken off the time at rest.
    """
    gyro, accelerometer, nothing = reading.gyro, reading.accelerometer, np.zeros(3)
    force, most = np.sqrt(squared(accelerometer, nothing)), 0.0
    for k in range(3):
        most = max(most, abs(x.gyro_bias[k]) / c.gyro_bias)
        most = max(most, abs(x.force_bias[k]) / c.accelerometer_bias)
    upwards = dot(triple(R[2]), triple(accelerometer))
    if R[2, 2] < _OVER:
        rest.tumbled = True
    moves = squared(x.v, nothing) > _RUNAWAY**2 and has_still_joints(rest, c)
    is_lost = moves or upwards < _UPRIGHT * force or most > _BIASES
    if not (is_lost or (rest.tumbled and R[2, 2] > _OVER)):
        rest.lost_time = 0.0
        return KNOWN
    is_turning = squared(gyro, nothing) >= c.still_turning**2
    is_still = not is_turning and abs(force - gravity) < c.still_force
    rest.lost_time = max(rest.lost_time + (dt if is_still else -dt), 0.0)
    if rest.lost_time < c.still_time:
        return KNOWN
    return LOST if is_lost else TUMBLED


@subroutine
def is_upset(rest: Rest, dt: float, is_lying: bool, R: Array3x3) -> bool:
    """Whether the robot lies or is tilted far, or has been until a moment ago."""
    is_down = is_lying or R[2, 2] < _OVER
    rest.upset_time = _CALM if is_down else max(rest.upset_time - dt, 0.0)
    return bool(rest.upset_time > 0.0)


@subroutine
def take_in_rest(f: Filter, reading: SensorReading, is_carried: bool, c: EstimatorConfig) -> None:
    """Take in that nothing moves: no velocity, and a gyro that reads its bias.

    Of a robot that its feet carry the gyro's bias is learnt by these: slow turns of its trunk read
    as rest, too.
    """
    for k in range(3):
        take_in_one(f, VELOCITY + k, -f.x.v[k], c.still_velocity**2)
        if not is_carried:
            off = reading.gyro[k] - f.x.gyro_bias[k]
            take_in_one(f, GYRO_BIAS + k, off, c.still_gyro**2)
