"""Replaces joint speeds and the gyro where they are mostly noise, by angles and time.

    speeds   e = (q - q_1) / dt - (v + v_1) / 2    noisy: v = (q - q_1) / dt
    gyro     e = (w - 2 w_1 + w_2) / sqrt(6)       noisy: w' = (w_read - w) / T

e is 0 for smooth motion, and as large as the noise, or 0.7 times that of the speeds. A signal is
noisy if the mean square of e is large. Other readings are passed on unchanged, to the bit.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.compilation import subroutine
from go2_wbc.records import Array3, Array12, Record
from go2_wbc.robot.state import SensorReading

MEASURING = 0.2  #: Time [s] over which the squares of e are averaged
NOISY_JOINTS, NOISY_GYRO = 0.8, 0.2
"""Root of that mean [rad/s] from which on they are noisy: of sound sensors, while late commands let
the robot land hard, it was 0.24 and 0.04 at most."""
MOST_JOINTS, MOST_GYRO = 6.0, 3.0
"""Most [rad/s] that one e, or sqrt(6) e of the gyro, counts: what is struck turns all at once."""
SMOOTHING = 0.008
"""Time constant [s] of a noisy gyro (T): on one that errs by 0.8 rad/s a trot fell with 25 ms."""


class SpeedNoise(Record):
    """What is remembered from reading to reading."""

    count: float  #: of readings
    joints: float  #: mean square of e [rad^2/s^2], of the joints
    gyro: float  #: the same, of the gyro
    v: Array12  #: the joints' last speeds, as they were passed on [rad/s]
    w: Array3  #: the gyro's last reading [rad/s]
    change: Array3  #: its last change [rad/s]
    smooth: Array3  #: smoothed readings of the gyro [rad/s]


@subroutine
def share_of(s: SpeedNoise, dt: float) -> float:
    """Of a reading in the means: of those since the start, and later of the last ones."""
    return max(1.0 - np.exp(-dt / MEASURING), 1.0 / max(s.count, 1.0))


@subroutine
def noise_of_gyro(s: SpeedNoise) -> float:
    """Root mean square [rad/s] of the noise of a gyro that is noisy, else 0."""
    return np.sqrt(s.gyro) if s.gyro > NOISY_GYRO**2 else 0.0


@subroutine
def calm_joints(s: SpeedNoise, r: SensorReading, turned: Array12, square: float, dt: float) -> None:
    """Take ``turned``, by what the angles have changed [rad/s], for speeds that are noisy.

    ``square``: mean of those of e [rad^2/s^2].
    """
    s.count += 1.0
    s.joints += share_of(s, dt) * (square - s.joints)
    if s.joints > NOISY_JOINTS**2:
        r.v_joints[:] = turned


@subroutine
def calm_gyro(s: SpeedNoise, r: SensorReading, dt: float) -> None:
    """Smooth a gyro that is noisy."""
    square, share = 0.0, dt / (dt + SMOOTHING)
    for k in range(3):
        change = r.gyro[k] - s.w[k]
        square += min((change - s.change[k]) ** 2, MOST_GYRO**2) / 18.0
        s.w[k], s.change[k] = r.gyro[k], change
        s.smooth[k] += share * (r.gyro[k] - s.smooth[k])
    s.gyro += share_of(s, dt) * (square - s.gyro)
    if noise_of_gyro(s) > 0.0:
        r.gyro[:] = s.smooth
