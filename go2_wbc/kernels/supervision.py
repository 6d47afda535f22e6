"""What is looked at in every tick to notice a fall, or a state that is none, as kernels.

``robot.safety`` says what counts as a fall.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import kernel
from go2_wbc.kernels.layout import REFERENCE, SNAPSHOT

_N, _T = SNAPSHOT.start, REFERENCE.start
_Q, _R, _P_COM, _P_FEET = (_N[n] for n in ("q", "R_world_base", "p_world_com", "p_world_feet"))
_IS_COM, _BODY_P, _BODY_R = (_T[n] for n in ("is_com", "p_world", "R_world_base"))
_NUMBERS = "Array(f8, 1, 'A', readonly=True)"


@kernel(f"b1({_NUMBERS}, {_NUMBERS}, {_NUMBERS}, {_NUMBERS}, f8)")
def is_plausible(q, v, tau, forces, tolerance):
    """Whether every number is finite and the quaternion of ``q`` of length 1."""
    for values in (q, v, tau, forces):
        for value in values:
            if not np.isfinite(value):
                return False
    length = np.sqrt(q[3] ** 2 + q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
    return abs(length - 1.0) < tolerance


@kernel(f"Tuple((f8, f8))({_NUMBERS}, Array(f8, 2, 'C', readonly=True), f8)")
def heights(snapshot, underside, foot_radius):
    """Heights of the base over the lowest foot's centre, and of the trunk over the ground."""
    lowest, height = np.inf, snapshot[_Q + 2]
    for leg in range(4):
        lowest = min(lowest, snapshot[_P_FEET + 3 * leg + 2])
    clearance = np.inf
    for point in range(underside.shape[0]):
        z = 0.0
        for i in range(3):
            z += snapshot[_R + 6 + i] * underside[point, i]
        clearance = min(clearance, z)
    return height - lowest, height + clearance - lowest + foot_radius


@kernel(f"Tuple((f8, f8))({_NUMBERS}, {_NUMBERS})")
def sag_and_lean(target, snapshot):
    """Depth of the tracked point below where it shall be, and the angle between the verticals."""
    measured = snapshot[_P_COM + 2] if target[_IS_COM] != 0.0 else snapshot[_Q + 2]
    cosine = 0.0
    for i in range(3):
        cosine += target[_BODY_R + 6 + i] * snapshot[_R + 6 + i]
    return target[_BODY_P + 2] - measured, np.arccos(min(max(cosine, -1.0), 1.0))
