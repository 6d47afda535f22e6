"""The attitude of a trunk that stands ready to walk, or walks: part of ``locomotion.plan``.

``planning.trunk`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.vectors import cross
from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import LOCOMOTION, PLANNER, REFERENCE, SNAPSHOT
from go2_wbc.kernels.playing import exp_rotation

_OFFSET, _STEPPING = PLANNER.start["lean_offset"], PLANNER.start["is_stepping"]
_NUMBERS, _R = LOCOMOTION.start["levelling"], SNAPSHOT.start["R_world_base"]
_WANTED = REFERENCE.start["R_world_base"]


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8, f8[::1])")
def level(snapshot, contact, s, c, dt, target):
    """Integrate what is left of the lean, and turn the trunk's reference by that."""
    is_stepping = s[_STEPPING] != 0.0
    n = _NUMBERS + 3 if is_stepping else _NUMBERS
    rate, window, limit = c[n], c[n + 1], c[n + 2]
    wanted = target[_WANTED : _WANTED + 9].reshape(3, 3)
    if is_stepping or contact.all():
        measured = snapshot[_R + 2], snapshot[_R + 5], snapshot[_R + 8]
        error = cross(measured, (wanted[0, 2], wanted[1, 2], wanted[2, 2]))
        for i in range(2):
            counted = min(max(error[i], -window), window)
            s[_OFFSET + i] = min(max(s[_OFFSET + i] + rate * dt * counted, -limit), limit)
    turn, before = np.empty((3, 3)), wanted.copy()
    exp_rotation(np.array([s[_OFFSET], s[_OFFSET + 1], 0.0]), turn)
    for i in range(3):
        for k in range(3):
            wanted[i, k] = (
                turn[i, 0] * before[0, k] + turn[i, 1] * before[1, k] + turn[i, 2] * before[2, k]
            )
