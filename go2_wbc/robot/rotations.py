"""Rotations: the few functions of SO(3) that the engine needs, without allocations to spare."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.compilation import kernel
from go2_wbc.records import Array3, Array3x3, Array4, ArrayNx3, ArrayNx3x3


def log_rotation(R: Array3x3) -> Array3:
    """Rotation vector [rad] of ``R``."""
    return pin.log3(R)


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Array3x3:
    """R = Rz(yaw) Ry(pitch) Rx(roll), angles in rad."""
    return pin.rpy.rpyToMatrix(roll, pitch, yaw)


def rpy_from_rotation(R: Array3x3) -> Array3:
    """Roll, pitch, yaw [rad] of ``R``."""
    return pin.rpy.matrixToRpy(R)


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Array4:
    """Quaternion x y z w of Rz(yaw) Ry(pitch) Rx(roll), angles in rad."""
    return pin.Quaternion(rotation_from_rpy(roll, pitch, yaw)).coeffs()


def rotation_from_quaternion(quaternion: Array4) -> Array3x3:
    """Rotation matrix of a unit quaternion x y z w."""
    x, y, z, w = quaternion.tolist()
    R: Array3x3 = pin.Quaternion(w, x, y, z).toRotationMatrix()
    return R


def rpy_from_quaternion(quaternion: Array4) -> Array3:
    """Roll, pitch, yaw [rad] of a quaternion x y z w that is not 0; its length does not count."""
    unit = quaternion / np.linalg.norm(quaternion)
    return rpy_from_rotation(pin.Quaternion(unit).toRotationMatrix())


@kernel(nogil=True)
def rotations_from_rpy(rpy: ArrayNx3, R: ArrayNx3x3) -> None:
    """Fill R = Rz(yaw) Ry(pitch) Rx(roll) of every row."""
    for i in range(len(rpy)):
        sr, sp, sy = np.sin(rpy[i, 0]), np.sin(rpy[i, 1]), np.sin(rpy[i, 2])
        cr, cp, cy = np.cos(rpy[i, 0]), np.cos(rpy[i, 1]), np.cos(rpy[i, 2])
        R[i, 0, 0], R[i, 0, 1], R[i, 0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
        R[i, 1, 0], R[i, 1, 1], R[i, 1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
        R[i, 2, 0], R[i, 2, 1], R[i, 2, 2] = -sp, cp * sr, cp * cr


@kernel(nogil=True)
def quaternions_from_rpy(rpy: ArrayNx3, xyzw: Float[np.ndarray, "n 4"]) -> None:
    """Fill the quaternions x y z w of the same rotations."""
    for i in range(len(rpy)):
        r, p, y = 0.5 * rpy[i, 0], 0.5 * rpy[i, 1], 0.5 * rpy[i, 2]
        sr, sp, sy = np.sin(r), np.sin(p), np.sin(y)
        cr, cp, cy = np.cos(r), np.cos(p), np.cos(y)
        xyzw[i, 0] = cy * cp * sr - sy * sp * cr
        xyzw[i, 1] = cy * sp * cr + sy * cp * sr
        xyzw[i, 2] = sy * cp * cr - cy * sp * sr
        xyzw[i, 3] = cy * cp * cr + sy * sp * sr


def yaw_rotation(yaw: float) -> Array3x3:
    """R = Rz(yaw), angle in rad."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def turned(
    vectors: Float[np.ndarray, "n 2"], angles: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n 2"]:
    """Each of the vectors turned by its angle [rad]."""
    (x, y), cosine, sine = vectors.T, np.cos(angles), np.sin(angles)
    return np.column_stack([cosine * x - sine * y, sine * x + cosine * y])


def wrap_angle(angle: float) -> float:
    """``angle`` in (-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))
