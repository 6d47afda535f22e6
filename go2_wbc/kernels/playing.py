"""One tick of a motion that is played, as kernels: the plan's row, and where it is followed.

``planned`` is the plan's reference at an instant, in the motion's frame; ``motions.plan`` is its
readable form. ``follow`` places it in the world, notes how far the robot is off it and adds the
steady-state correction; ``follow_steps`` also lets its feet land when they meet the ground
(``landing``). ``planning.playback`` is their readable form.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.vectors import rotation_of
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.landing import JOINTS, STANCE, TIE, land
from go2_wbc.kernels.layout import CORRECTION, PLAN_CURVES, PLAYBACK, REFERENCE, SNAPSHOT
from go2_wbc.kernels.supervision import sag_and_lean

_N, _T, _S, _C = SNAPSHOT.start, REFERENCE.start, PLAYBACK.start, CORRECTION.start
_Q, _R, _P_COM = _N["q"], _N["R_world_base"], _N["p_world_com"]
_IS_COM, _BODY_P, _BODY_V, _BODY_A = (_T[n] for n in ("is_com", "p_world", "v_world", "a_world"))
_BODY_R, _BODY_W, _BODY_DW, _LEGS = (_T[n] for n in ("R_world_base", "w_world", "dw_world", "legs"))
_F_MIN, _F_MAX = _T["normal_force_min"], _T["normal_force_max"]
_FOOT_P, _FOOT_V, _FOOT_A = (_T[n] for n in ("p_world_feet", "v_world_feet", "a_world_feet"))
_JOINT_Q, _JOINT_V, _JOINT_A = (_T[n] for n in ("q_joints", "v_joints", "a_joints"))
_FORCES = _T["f_world_feet"]
_OFFSET, _PLACE, _ATTITUDE, _OFF_JOINTS = (_S[n] for n in ("offset", "place", "attitude", "joints"))
_TICKS, _RAISED_TICKS = _S["ticks"], _S["raised_ticks"]
_SAG, _LEAN, _ANCHOR = _S["sag"], _S["lean"], _S["anchor"]
_RATE, _WINDOW, _LIMIT = _C["rate"], _C["window"], _C["limit"]
_HANDED_OVER, _CARRIED = _C["handed_over"], _S["carried"]
_M, _PAYLOAD, _SHIFT = (_N[n] for n in ("mass_matrix", "payload", "com_shift"))

_TABLE, _LIST = "Array(f8, 2, 'A', readonly=True)", "Array(f8, 1, 'A', readonly=True)"


# --- the plan ---------------------------------------------------------------------------------


@kernel(f"void(f8, f8[:,::1], {_LIST}, f8[::1], f8, f8, f8[::1])")
def planned(is_com, curves, tasks, share, least, greatest, row):
    """Fill the reference of a body (x, y, z, roll, pitch, yaw) and four legs.

    ``curves`` (3, 30): values, rates and accelerations of body, joints and feet; ``tasks``: values
    of ``LegTask``. Angular velocity of Z-Y-X angles: Craig, Introduction to Robotics, 3rd ed., eq.
    5.44.
    """
    row[:] = 0.0
    row[_IS_COM] = is_com
    for i in range(3):
        row[_BODY_P + i] = curves[0, i]
        row[_BODY_V + i] = curves[1, i]
        row[_BODY_A + i] = curves[2, i]
    cr, sr = np.cos(curves[0, 3]), np.sin(curves[0, 3])
    cp, sp = np.cos(curves[0, 4]), np.sin(curves[0, 4])
    cy, sy = np.cos(curves[0, 5]), np.sin(curves[0, 5])
    row[_BODY_R + 0] = cy * cp
    row[_BODY_R + 1] = cy * sp * sr - sy * cr
    row[_BODY_R + 2] = cy * sp * cr + sy * sr
    row[_BODY_R + 3] = sy * cp
    row[_BODY_R + 4] = sy * sp * sr + cy * cr
    row[_BODY_R + 5] = sy * sp * cr - cy * sr
    row[_BODY_R + 6] = -sp
    row[_BODY_R + 7] = cp * sr
    row[_BODY_R + 8] = cp * cr
    dr, dp, dy = curves[1, 3], curves[1, 4], curves[1, 5]
    ddr, ddp, ddy = curves[2, 3], curves[2, 4], curves[2, 5]
    row[_BODY_W] = cy * cp * dr - sy * dp
    row[_BODY_W + 1] = sy * cp * dr + cy * dp
    row[_BODY_W + 2] = dy - sp * dr
    row[_BODY_DW] = cy * cp * ddr - sy * ddp - (sy * dy * cp + cy * sp * dp) * dr - cy * dy * dp
    row[_BODY_DW + 1] = sy * cp * ddr + cy * ddp + (cy * dy * cp - sy * sp * dp) * dr - sy * dy * dp
    row[_BODY_DW + 2] = ddy - sp * ddr - cp * dp * dr
    for leg in range(4):
        row[_LEGS + leg] = tasks[leg]
        row[_F_MIN + leg], row[_F_MAX + leg] = least * share[leg], greatest * share[leg]
    for n in range(12):
        row[_JOINT_Q + n] = curves[0, 6 + n]
        row[_JOINT_V + n] = curves[1, 6 + n]
        row[_JOINT_A + n] = curves[2, 6 + n]
        row[_FOOT_P + n] = curves[0, 18 + n]
        row[_FOOT_V + n] = curves[1, 18 + n]
        row[_FOOT_A + n] = curves[2, 18 + n]


@kernel(
    f"void({_LIST}, Array(f8, 3, 'A', readonly=True), {_LIST}, {_TABLE}, {_TABLE}, {_TABLE}, "
    "f8, f8, f8, f8, f8[::1])"
)
def planned_at(knots, pieces, events, tasks, since, until, ramp, least, greatest, t, row):
    """Fill the reference of splines and a contact schedule at ``t`` seconds.

    ``pieces`` (4, n, 30): coefficients of the cubics between ``knots``, the cube's first.
    ``tasks``, ``since``, ``until`` (m, 4): from each event on, what the legs do, and when each
    foot's contact changed last and changes next. The ends are held.
    """
    end = knots[-1]
    inside = min(max(t, 0.0), end)
    piece = min(np.searchsorted(knots, inside, side="right"), len(knots) - 1) - 1
    s = inside - knots[piece]
    curves = np.zeros((3, PLAN_CURVES))
    for k in range(PLAN_CURVES):
        a, b, c = pieces[0, piece, k], pieces[1, piece, k], pieces[2, piece, k]
        curves[0, k] = ((a * s + b) * s + c) * s + pieces[3, piece, k]
        if inside == t:
            curves[1, k] = (3 * a * s + 2 * b) * s + c
            curves[2, k] = 6 * a * s + 2 * b
    event = max(np.searchsorted(events, t + TIE, side="right") - 1, 0)
    share = np.zeros(4)
    for leg in range(4):
        if tasks[event, leg] == STANCE:
            nearest = min(max(t - since[event, leg], 0.0), until[event, leg] - t)
            share[leg] = min(max(nearest / max(ramp, TIE), 0.0), 1.0)
    planned(1.0, curves, tasks[event], share, least, greatest, row)


# --- where it is followed -------------------------------------------------------------------


@subroutine("void(f8[:,::1], f8[::1])")
def quaternion_of(R, q):
    """Fill the quaternion x y z w of ``R``, from its largest component (Shepperd 1978)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    largest, i = trace, 3
    for k in range(3):
        if R[k, k] > largest:
            largest, i = R[k, k], k
    if i == 3:
        q[0], q[1], q[2] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
        q[3] = 1.0 + trace
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q[i] = 1.0 + 2.0 * R[i, i] - trace
        q[j], q[k] = R[i, j] + R[j, i], R[i, k] + R[k, i]
        q[3] = R[k, j] - R[j, k]
    q /= np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)


@subroutine("void(f8[:,::1], f8[::1])")
def log_rotation(R, vector):
    """Fill the rotation vector of ``R``, of length 0 to pi."""
    q = np.empty(4)
    quaternion_of(R, q)
    if q[3] < 0.0:
        q *= -1.0
    sine = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2)
    # 2 arcsin(x) / x = 2 + x^2 / 3 + ...
    factor = 2.0 * np.arctan2(sine, q[3]) / sine if sine > 1e-6 else 2.0 + sine * sine / 3.0
    for i in range(3):
        vector[i] = factor * q[i]


@subroutine("void(f8[::1], f8[:,::1])")
def exp_rotation(vector, R):
    """Fill the rotation by a rotation vector."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    factor = np.sin(angle / 2) / angle if angle > 1e-6 else 0.5 - angle * angle / 48
    x, y, z = factor * vector[0], factor * vector[1], factor * vector[2]
    rotation_of(x, y, z, np.cos(angle / 2), R)


@subroutine("void(f8[::1], f8[::1], f8[::1])")
def place(plan, anchor, row):
    """Fill ``row`` with ``plan`` in the world: turned by the anchor's yaw and moved to its place.

    ``anchor``: x, y, z [m], yaw [rad].
    """
    row[:] = plan
    cosine, sine = np.cos(anchor[3]), np.sin(anchor[3])
    for k in range(3):  # columns of the attitude
        x, y = plan[_BODY_R + k], plan[_BODY_R + 3 + k]
        row[_BODY_R + k], row[_BODY_R + 3 + k] = cosine * x - sine * y, sine * x + cosine * y
    for begin in (_BODY_P, _BODY_V, _BODY_A, _BODY_W, _BODY_DW):
        x, y = plan[begin], plan[begin + 1]
        row[begin], row[begin + 1] = cosine * x - sine * y, sine * x + cosine * y
    for begin in (_FOOT_P, _FOOT_V, _FOOT_A, _FORCES):
        for leg in range(4):
            k = begin + 3 * leg
            row[k] = cosine * plan[k] - sine * plan[k + 1]
            row[k + 1] = sine * plan[k] + cosine * plan[k + 1]
    for i in range(3):
        row[_BODY_P + i] += anchor[i]
        for leg in range(4):
            row[_FOOT_P + 3 * leg + i] += anchor[i]


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1])")
def note(row, snapshot, error, state):
    """Bring the averages of how far the robot is off its plan up to this tick."""
    state[_TICKS] += 1.0
    off = np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    state[_PLACE] += (off - state[_PLACE]) / state[_TICKS]
    off = np.sqrt(error[3] ** 2 + error[4] ** 2 + error[5] ** 2)
    state[_ATTITUDE] += (off - state[_ATTITUDE]) / state[_TICKS]
    worst, is_raised = 0.0, False
    for leg in range(4):
        if row[_LEGS + leg] == JOINTS:
            is_raised = True
            for n in range(3 * leg, 3 * leg + 3):
                worst = max(worst, abs(row[_JOINT_Q + n] - snapshot[_Q + 7 + n]))
    if is_raised:
        state[_RAISED_TICKS] += 1.0
        state[_OFF_JOINTS] += (worst - state[_OFF_JOINTS]) / state[_RAISED_TICKS]


@subroutine("b1(f8[::1])")
def is_in_flight(row):
    """Whether no foot stands."""
    stands = False
    for leg in range(4):
        stands |= row[_LEGS + leg] == STANCE
    return not stands


@subroutine("void(f8[::1], f8[::1], f8[::1])")
def hand_over(snapshot, correction, state):
    """Take out of the correction what is known of the payload since the last tick.

    In ``state`` the load is kept in the heading frame: upward [m], about x and about y [rad].
    """
    share = correction[_HANDED_OVER : _HANDED_OVER + 3]
    mass, weight = snapshot[_PAYLOAD], snapshot[_PAYLOAD + 1]
    gravity = weight / mass if mass > 0.0 else 0.0
    x, y = snapshot[_R], snapshot[_R + 3]
    length = max(np.hypot(x, y), TIE)
    cosine, sine = x / length, y / length
    moment = snapshot[_M] * gravity
    x, y = moment * snapshot[_SHIFT], moment * snapshot[_SHIFT + 1]
    now, change = np.empty(3), np.empty(3)
    now[0] = share[0] * weight
    now[1] = share[1] * (cosine * y - sine * x)
    now[2] = -share[2] * (cosine * x + sine * y)
    for i in range(3):
        change[i] = now[i] - state[_CARRIED + i] if state[_TICKS] > 1.0 else 0.0
        state[_CARRIED + i] = now[i]
    about_x, about_y = change[1], change[2]
    change[1], change[2] = cosine * about_x - sine * about_y, sine * about_x + cosine * about_y
    for i in range(3):
        k = _OFFSET + 2 + i
        held = state[k]
        state[k] -= max(min(change[i], max(held, 0.0)), min(held, 0.0))


@subroutine("void(f8[::1], f8, f8[::1], f8[::1], f8[::1])")
def correct(snapshot, dt, correction, state, row):
    """Note how far the robot is off ``row``, and correct it after ``dt`` seconds of that error."""
    state[_SAG], state[_LEAN] = sag_and_lean(row, snapshot)
    measured = snapshot[_P_COM : _P_COM + 3] if row[_IS_COM] != 0.0 else snapshot[_Q : _Q + 3]
    R, wanted = snapshot[_R : _R + 9].reshape(3, 3), row[_BODY_R : _BODY_R + 9].reshape(3, 3)
    error, turn = np.empty(6), np.empty((3, 3))
    for i in range(3):
        error[i] = row[_BODY_P + i] - measured[i]
        for k in range(3):
            turn[i, k] = wanted[i, 0] * R[k, 0] + wanted[i, 1] * R[k, 1] + wanted[i, 2] * R[k, 2]
    log_rotation(turn, error[3:])
    note(row, snapshot, error, state)
    hand_over(snapshot, correction, state)
    offset, flies = state[_OFFSET : _OFFSET + 6], is_in_flight(row)
    for i in range(6):
        window, limit = correction[_WINDOW + i], correction[_LIMIT + i]
        counted = min(max(error[i], -window), window)
        change = 0.0 if flies else correction[_RATE] * dt * counted
        offset[i] = min(max(offset[i] + change, -limit), limit)
    exp_rotation(offset[3:], turn)
    planned_attitude = wanted.copy()
    for i in range(3):
        row[_BODY_P + i] += offset[i]
        for k in range(3):
            wanted[i, k] = (
                turn[i, 0] * planned_attitude[0, k]
                + turn[i, 1] * planned_attitude[1, k]
                + turn[i, 2] * planned_attitude[2, k]
            )


@kernel("void(f8[::1], f8[::1], f8, f8[::1], f8[::1], f8[::1])")
def follow(plan, snapshot, dt, correction, state, row):
    """Fill the corrected reference in the world, ``dt`` seconds after the last one."""
    place(plan, state[_ANCHOR : _ANCHOR + 4], row)
    correct(snapshot, dt, correction, state, row)


@kernel(
    f"void(f8[::1], f8[::1], f8, f8, f8[::1], {_LIST}, {_TABLE}, {_TABLE}, {_TABLE}, "
    "f8[::1], f8[::1], f8[::1], f8[::1])"
)
def follow_steps(
    plan, snapshot, t, dt, contact, events, since, until, unloads, landing, correction, state, row
):
    """The same for a plan whose feet step.

    ``t``: how far into the plan; ``contact`` (4,): feet with a measured contact. ``events``,
    ``since``, ``until``: of the plan's contacts; ``unloads``: of ``Footsteps``; ``landing``:
    numbers of ``layout.LANDING``.
    """
    place(plan, state[_ANCHOR : _ANCHOR + 4], row)
    land(t, contact, events, since, until, unloads, snapshot, landing, state, row)
    correct(snapshot, dt, correction, state, row)
