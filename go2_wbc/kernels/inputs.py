"""Whether the numbers of a tick can be computed with; ``wbc.inputs`` is the readable form."""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import REFERENCE

_F_MIN, _F_MAX = REFERENCE.start["normal_force_min"], REFERENCE.start["normal_force_max"]


@subroutine("b1(f8[::1], i8, i8)")
def is_finite(row, start, end):
    """Whether every number of row[start:end] is finite. Without branches it takes a fifth."""
    part, count = row[start:end], 0
    for i in range(len(part)):
        count += abs(part[i]) < np.inf
    return count == len(part)


@subroutine("b1(f8[::1], f8[::1])")
def are_valid(snapshot, target):
    """What ``wbc.inputs`` demands: finite numbers, bounds of forces that are open or finite."""
    for leg in range(4):
        if not (target[_F_MIN + leg] < np.inf and target[_F_MAX + leg] > -np.inf):
            return False
    return (
        is_finite(snapshot, 0, len(snapshot))
        and is_finite(target, 0, _F_MIN)
        and is_finite(target, _F_MAX + 4, len(target))
    )
