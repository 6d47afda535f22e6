"""Feet of a plan that land where and when they meet the ground: part of ``playing.follow_steps``.

``planning.landing`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import LANDING, PLAYBACK, REFERENCE, SNAPSHOT

TIE = 1e-9
"""As ``contacts.TIE``."""
STANCE, SWING, JOINTS = 0.0, 1.0, 2.0
"""Values of ``reference.LegTask``."""

_N, _T, _S, _L = SNAPSHOT.start, REFERENCE.start, PLAYBACK.start, LANDING.start
_P_COM, _V_COM, _P_FEET = (_N[n] for n in ("p_world_com", "v_world_com", "p_world_feet"))
_BODY_P, _BODY_V, _LEGS = (_T[n] for n in ("p_world", "v_world", "legs"))
_F_MIN, _F_MAX = _T["normal_force_min"], _T["normal_force_max"]
_FOOT_P, _FOOT_V, _FOOT_A = (_T[n] for n in ("p_world_feet", "v_world_feet", "a_world_feet"))
_ANCHOR, _ORIGIN, _PLANNED = (_S[n] for n in ("anchor", "origin", "planned"))
_IS_IN_AIR, _IS_AWAITED = _S["is_in_air"], _S["is_awaited"]
_TOUCHDOWN, _MISSED, _ERROR = _S["touchdown"], _S["missed"], _S["landing_error"]
_EARLIEST, _TIME_OUT, _SHARE = (_L[n] for n in ("earliest", "time_out", "ground_share"))
_SPEED, _DEPTH, _RADIUS = (_L[n] for n in ("press_speed", "press_depth", "foot_radius"))
_NEAR = _L["near"]
_RAMP, _LEAST, _GREATEST = (_L[n] for n in ("ramp", "normal_force_min", "normal_force_max"))


@subroutine("void(i8, f8, f8, f8, f8[::1], f8[::1], f8[::1], f8[::1])")
def notice(leg, t, start, end, contact, snapshot, numbers, state):
    """Bring up to this tick whether the foot is in the air, from what is planned and measured."""
    planned = state[_PLANNED + leg]
    may_land = planned == STANCE or t - start >= numbers[_EARLIEST] * (end - start)
    if may_land and contact[leg] != 0.0:
        ground = snapshot[_P_FEET + 3 * leg + 2] - numbers[_RADIUS]
        state[_ANCHOR + 2] += numbers[_SHARE] * (ground - state[_ANCHOR + 2])
    elif planned == STANCE and t - start > numbers[_TIME_OUT]:
        state[_MISSED] += 1.0
    else:
        return
    state[_IS_IN_AIR + leg] = 0.0
    state[_TOUCHDOWN + leg] = t


@subroutine("void(i8, f8, f8[::1], f8[::1], f8[::1])")
def press(leg, late, numbers, row, state):
    """Let a foot that should stand go on downwards, ``late`` seconds after it should have."""
    depth = numbers[_SPEED] * late
    k = 3 * leg
    for i in range(3):
        row[_FOOT_V + k + i] = row[_FOOT_A + k + i] = 0.0
    if depth < numbers[_DEPTH]:
        row[_FOOT_V + k + 2] = -numbers[_SPEED]
    row[_FOOT_P + k + 2] -= min(depth, numbers[_DEPTH])


@subroutine("void(i8, f8[::1], f8[::1], f8[::1])")
def judge(leg, row, snapshot, state):
    """Note how far from its place, as planned at first, a foot has landed."""
    state[_IS_AWAITED + leg] = 0.0
    off = 0.0
    for i in range(2):
        moved = state[_ANCHOR + i] - state[_ORIGIN + i]
        off += (snapshot[_P_FEET + 3 * leg + i] - row[_FOOT_P + 3 * leg + i] + moved) ** 2
    state[_ERROR] = max(state[_ERROR], np.sqrt(off))


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1])")
def carry(row, snapshot, numbers, state):
    """Move the plan to where the CoM is, but for what the legs can make up for."""
    away = np.hypot(snapshot[_P_COM] - row[_BODY_P], snapshot[_P_COM + 1] - row[_BODY_P + 1])
    share = 1.0 - numbers[_NEAR] / max(away, numbers[_NEAR])
    for i in range(2):
        off = share * (snapshot[_P_COM + i] - row[_BODY_P + i])
        state[_ANCHOR + i] += off
        row[_BODY_P + i] += off
        faster = share * (snapshot[_V_COM + i] - row[_BODY_V + i])
        for leg in range(4):
            row[_FOOT_P + 3 * leg + i] += off
            row[_FOOT_V + 3 * leg + i] += faster


@subroutine(
    "void(f8, f8[::1], Array(f8, 1, 'A', readonly=True), Array(f8, 2, 'A', readonly=True), "
    "Array(f8, 2, 'A', readonly=True), Array(f8, 2, 'A', readonly=True), "
    "f8[::1], f8[::1], f8[::1], f8[::1])"
)
def land(t, contact, events, since, until, unloads, snapshot, numbers, state, row):
    """Change ``row``, a plan in the world, to what the feet's measured contacts make of it."""
    event = max(np.searchsorted(events, t + TIE, side="right") - 1, 0)
    stands = False
    for leg in range(4):
        start, end, planned = since[event, leg], until[event, leg], row[_LEGS + leg]
        if planned == JOINTS:
            state[_IS_IN_AIR + leg] = state[_IS_AWAITED + leg] = 0.0
            state[_TOUCHDOWN + leg] = -np.inf
        elif planned == SWING and state[_PLANNED + leg] != SWING:
            state[_IS_IN_AIR + leg] = state[_IS_AWAITED + leg] = 1.0
        state[_PLANNED + leg] = planned
        if planned == JOINTS:
            continue
        if state[_IS_IN_AIR + leg] != 0.0:
            notice(leg, t, start, end, contact, snapshot, numbers, state)
        if state[_IS_IN_AIR + leg] != 0.0:
            row[_LEGS + leg] = SWING
            row[_F_MIN + leg] = row[_F_MAX + leg] = 0.0
            if planned == STANCE:
                press(leg, t - start, numbers, row, state)
            continue
        stands = True
        row[_LEGS + leg] = STANCE
        if state[_TOUCHDOWN + leg] > -np.inf:
            left = unloads[event, leg] - t if planned == STANCE else np.inf
            nearest = min(t - state[_TOUCHDOWN + leg], left)
            share = min(max(nearest / max(numbers[_RAMP], TIE), 0.0), 1.0)
            row[_F_MIN + leg] = numbers[_LEAST] * share
            row[_F_MAX + leg] = numbers[_GREATEST] * share
        if planned == STANCE and state[_IS_AWAITED + leg] != 0.0:
            judge(leg, row, snapshot, state)
    if not stands:
        carry(row, snapshot, numbers, state)
