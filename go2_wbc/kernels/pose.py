"""The trunk's pose on top of walking: part of ``locomotion.plan`` and ``preview.steer``.

``planning.pose`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import COMMAND, LOCOMOTION

_PATH, _ASKED = LOCOMOTION.start["pose_path"], COMMAND.start["pose"]


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8)")
def advance_pose(pose, rate, c, command, dt):
    """Bring pose and rate nearer to what is asked for, in ``dt`` seconds."""
    sharpness = c[_PATH + 2]
    for i in range(4):
        most = c[_PATH] if i == 0 else c[_PATH + 1]
        wanted = min(max(sharpness * (command[_ASKED + i] - pose[i]), -most), most)
        change = sharpness * most * dt
        rate[i] += min(max(wanted - rate[i], -change), change)
        pose[i] += rate[i] * dt


@subroutine("void(f8[::1], f8[:,::1])")
def lean_rotation(pose, R):
    """Turn the rotation of a trunk that walks level by that of the pose: R Rz Ry Rx."""
    sr, cr = np.sin(pose[1]), np.cos(pose[1])
    sp, cp = np.sin(pose[2]), np.cos(pose[2])
    sy, cy = np.sin(pose[3]), np.cos(pose[3])
    for i in range(3):
        x, y, z = R[i, 0], R[i, 1], R[i, 2]
        R[i, 0] = (x * cy + y * sy) * cp - z * sp
        R[i, 1] = (x * cy + y * sy) * sp * sr + (y * cy - x * sy) * cr + z * cp * sr
        R[i, 2] = (x * cy + y * sy) * sp * cr - (y * cy - x * sy) * sr + z * cp * cr


@subroutine("void(f8, f8[::1], f8[::1], f8[::1], f8[::1])")
def pose_turn(yaw, pose, rate, turn, w):
    """Fill what roll, pitch and yaw of a pose add to a level trunk of that heading."""
    cosine, sine = np.cos(yaw + pose[3]), np.sin(yaw + pose[3])
    sp, cp = np.sin(pose[2]), np.cos(pose[2])
    w[0] = cosine * cp * rate[1] - sine * rate[2]
    w[1] = sine * cp * rate[1] + cosine * rate[2]
    w[2] = rate[3] - sp * rate[1]
    sr, cr, sp, cp = (
        np.sin(pose[1] / 2),
        np.cos(pose[1] / 2),
        np.sin(pose[2] / 2),
        np.cos(pose[2] / 2),
    )
    x, y, z = cp * sr, sp * cr, -sp * sr
    length = np.sqrt(x * x + y * y + z * z)
    share = 2.0 * np.arctan2(length, cp * cr) / length if length > 0.0 else 2.0
    turn[0] = share * (cosine * x - sine * y)
    turn[1] = share * (sine * x + cosine * y)
    turn[2] = share * z
