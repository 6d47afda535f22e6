"""Which feet of a gait stand: part of ``locomotion.plan``.

``planning.contact`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.ground import ground_at
from go2_wbc.kernels.layout import LOCOMOTION, PLANNER, SNAPSHOT

TIE = 1e-9
"""As ``contacts.TIE``."""

_P_FEET = SNAPSHOT.start["p_world_feet"]
_EARLY, _SINCE = PLANNER.start["is_early"], PLANNER.start["since"]
_RADIUS, _CONTACT = LOCOMOTION.start["foot_radius"], LOCOMOTION.start["contact"]
_EARLIEST, _STEP = _CONTACT, _CONTACT + 1


@subroutine("b1(f8[::1], f8[::1], f8[::1], i8, b1, b1, f8, f8)")
def follow_contact(snapshot, s, c, leg, touches, planned, progress, dt):
    """Bring a foot to this tick; returns whether it stands."""
    if planned:
        s[_EARLY + leg] = 0.0
    elif s[_EARLY + leg] == 0.0:
        k = _P_FEET + 3 * leg
        above = snapshot[k + 2] - c[_RADIUS] - ground_at(s, snapshot[k], snapshot[k + 1])
        s[_SINCE + leg] = np.inf
        if touches and above > c[_STEP] and progress >= c[_EARLIEST] - TIE:
            s[_EARLY + leg], s[_SINCE + leg] = 1.0, 0.0
    s[_SINCE + leg] += dt
    return planned or s[_EARLY + leg] != 0.0


@subroutine("f8(f8[::1], i8, b1, f8, f8)")
def loaded_time(s, leg, planned, elapsed, remaining):
    """Time to the nearest change of a standing foot's contact, since when it came down."""
    begun = s[_SINCE + leg] if s[_SINCE + leg] < np.inf else elapsed
    return min(begun, remaining) if planned else begun
