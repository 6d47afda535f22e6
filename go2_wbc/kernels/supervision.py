"""``reference.sag_and_lean`` of rows, as ``kernels.playing`` has them."""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import REFERENCE, SNAPSHOT

_N, _T = SNAPSHOT.start, REFERENCE.start
_Q, _R, _P_COM = (_N[n] for n in ("q", "R_world_base", "p_world_com"))
_IS_COM, _BODY_P, _BODY_R = (_T[n] for n in ("is_com", "p_world", "R_world_base"))


@subroutine("Tuple((f8, f8))(f8[::1], f8[::1])")
def sag_and_lean(target, snapshot):
    """Depth of the tracked point below where it shall be, and the angle between the verticals."""
    measured = snapshot[_P_COM + 2] if target[_IS_COM] != 0.0 else snapshot[_Q + 2]
    cosine = 0.0
    for i in range(3):
        cosine += target[_BODY_R + 6 + i] * snapshot[_R + 6 + i]
    return target[_BODY_P + 2] - measured, np.arccos(min(max(cosine, -1.0), 1.0))
