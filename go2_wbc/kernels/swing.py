"""The swings of a gait's feet: part of ``locomotion.plan``.

``planning.swing`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.ground import apex_raise, delay
from go2_wbc.kernels.layout import LOCOMOTION, PLANNER, REFERENCE, SNAPSHOT

TIE = 1e-9
"""As ``swing.TIE``."""

_P_FEET = SNAPSHOT.start["p_world_feet"]
_S, _C, _T = PLANNER.start, LOCOMOTION.start, REFERENCE.start
_LIFTOFF, _PERIOD, _DUTY = (_S[n] for n in ("liftoff", "period", "duty"))
_RAISED, _DELAY, _BEGUN = (_S[n] for n in ("swing_raised", "swing_delay", "swing_begun"))
_APEX, _DEPTH, _FULL_WAY = (_C[n] for n in ("apex", "touchdown_depth", "full_depth_way"))
_FOOT_P, _FOOT_V, _FOOT_A = (_T[n] for n in ("p_world_feet", "v_world_feet", "a_world_feet"))


@subroutine("void(i8, f8[::1], f8[::1], f8[::1])")
def begin_swing(leg, snapshot, s, c):
    """A foot leaves the ground."""
    for i in range(3):
        s[_LIFTOFF + 3 * leg + i] = snapshot[_P_FEET + 3 * leg + i]
    s[_RAISED + leg], s[_DELAY + leg], s[_BEGUN + leg] = apex_raise(s, c), delay(s, c), 0.0


@subroutine("void(i8, f8[::1], f8[::1], f8[::1], f8)")
def resume_swing(leg, snapshot, s, c, progress):
    """A foot has been stopped; it goes on from there, once in a swing."""
    if s[_BEGUN + leg] == 0.0:
        for i in range(3):
            s[_LIFTOFF + 3 * leg + i] = snapshot[_P_FEET + 3 * leg + i]
        s[_RAISED + leg], s[_DELAY + leg], s[_BEGUN + leg] = 0.0, delay(s, c), progress


@subroutine("Tuple((f8, f8, f8))(f8)")
def cubic(x):
    """As ``curves.Ease.CUBIC``."""
    return x * x * (3 - 2 * x), 6 * x * (1 - x), 6 - 12 * x


@subroutine("void(i8, f8[::1], f8[::1], f8, f8[::1], f8[::1])")
def swing(leg, s, c, progress, goal, target):
    """As ``planning.swing.Swing.at``, to ``goal`` (3,)."""
    share = 1.0 - s[_BEGUN + leg]
    progress = (progress - s[_BEGUN + leg]) / share
    duration = share * (1.0 - s[_DUTY]) * s[_PERIOD]
    start = s[_LIFTOFF + 3 * leg : _LIFTOFF + 3 * leg + 3]
    k = 3 * leg
    late = s[_DELAY + leg]
    span = duration * (1.0 - late)
    x, dx, ddx = 0.0, 0.0, 0.0
    if progress >= late - TIE:
        x, dx, ddx = cubic((progress - late) / (1.0 - late))
    for i in range(2):
        delta = goal[i] - start[i]
        target[_FOOT_P + k + i] = start[i] + x * delta
        target[_FOOT_V + k + i] = dx / span * delta
        target[_FOOT_A + k + i] = ddx / span**2 * delta
    apex = max(start[2], goal[2]) + share * (c[_APEX] + s[_RAISED + leg])
    is_rising = progress < 0.5 - TIE
    way = np.hypot(goal[0] - start[0], goal[1] - start[1])
    depth = c[_DEPTH] * min(1.0, c[_FULL_WAY] / max(way, TIE)) ** 2
    begin = start[2] if is_rising else apex
    delta = (apex if is_rising else goal[2] - depth) - begin
    x, dx, ddx = cubic(2.0 * progress - (0.0 if is_rising else 1.0))
    target[_FOOT_P + k + 2] = begin + x * delta
    target[_FOOT_V + k + 2] = dx * delta * 2.0 / duration
    target[_FOOT_A + k + 2] = ddx * delta * 4.0 / duration**2
