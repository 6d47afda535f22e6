"""One tick of the locomotion planner as a kernel; ``planning.locomotion`` is its readable form.

Names and order follow the methods there. ``s`` is the planner's state (``layout.PLANNER``), ``c``
its numbers (``layout.LOCOMOTION``), ``snapshot`` and ``target`` are the rows of a snapshot and of
the reference that is filled.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.vectors import cross
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.contact import follow_contact, loaded_time
from go2_wbc.kernels.ground import (
    carry_ground,
    ground_at,
    learn_ground,
    level_friction,
    note_stumble,
    tilt,
)
from go2_wbc.kernels.layout import LOCOMOTION, PLANNER, REFERENCE, SNAPSHOT
from go2_wbc.kernels.levelling import level
from go2_wbc.kernels.pose import advance_pose, lean_rotation, pose_turn
from go2_wbc.kernels.slip import observe_slip
from go2_wbc.kernels.swing import begin_swing, resume_swing, swing

TIE = 1e-9
"""As ``contacts.TIE``."""
TINY = 1e-9
RESOLUTION = 1e12
"""Of phases, that adding and dividing may have blurred, in steps a turn."""

_N, _T, _S, _C = SNAPSHOT.start, REFERENCE.start, PLANNER.start, LOCOMOTION.start
_Q, _P_COM, _V_COM, _P_FEET = (_N[n] for n in ("q", "p_world_com", "v_world_com", "p_world_feet"))
_SHIFT = _N["com_shift"]
_YAW, _POSITION, _VELOCITY = (_S[n] for n in ("yaw", "position", "velocity"))
_STEPPING, _PHASE_TIME, _TIME = (_S[n] for n in ("is_stepping", "phase_time", "time"))
_GROUND, _SLOPE, _HEIGHT_OFFSET = (_S[n] for n in ("ground", "slope", "height_offset"))
_POSE, _POSE_RATE = _S["pose"], _S["pose_rate"]
_WAS_STANCE, _AWAITED = _S["was_stance"], _S["is_awaited"]
_PERIOD, _DUTY, _OFFSETS, _WIDTH = (_S[n] for n in ("period", "duty", "offsets", "width"))
_GOAL = _S["goal_offsets"]
_GAIT, _REST, _STRIDE, _RATES = (_C[n] for n in ("period", "rest_period", "stride", "adaptation"))
_HEIGHT, _MARGIN = _C["height"], _C["stride_margin"]
_ACCELERATION, _FEEDBACK = _C["acceleration"], _C["velocity_feedback"]
_LEASH, _YAW_LEASH, _REACH = (_C[n] for n in ("position_leash", "yaw_leash", "foothold_reach"))
_F_MIN, _F_MAX, _RAMP = (_C[n] for n in ("normal_force_min", "normal_force_max", "load_ramp"))
_SETTLE_SPEED, _SETTLED = _C["settle_speed"], _C["settled_command"]
_CAPTURE, _SQUARE = _C["capture_margin"], _C["square_tolerance"]
_MID_SWING = _C["mid_swing"]
_RATE, _WINDOW, _LIMIT = (
    _C[n] for n in ("correction_rate", "correction_window", "correction_limit")
)
_GRAVITY, _RADIUS, _NOMINAL = (_C[n] for n in ("gravity", "foot_radius", "p_base_feet_nominal"))
_IS_COM, _BODY_P, _BODY_V = (_T[n] for n in ("is_com", "p_world", "v_world"))
_BODY_R, _BODY_W = _T["R_world_base"], _T["w_world"]
_LEGS, _T_F_MIN, _T_F_MAX = (_T[n] for n in ("legs", "normal_force_min", "normal_force_max"))
_FOOT_P, _FOOT_V, _FOOT_A = (_T[n] for n in ("p_world_feet", "v_world_feet", "a_world_feet"))
_JOINT_Q, _T_FRICTION = _T["q_joints"], _T["friction"]


@subroutine("f8(f8[::1])")
def yaw_of(q):
    """Heading of the quaternion in a configuration."""
    x, y, z, w = q[3], q[4], q[5], q[6]
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@subroutine("Tuple((b1, f8, f8))(f8, f8, f8, f8)")
def foot_phase(t, offset, period, duty):
    """Whether a foot is in stance at ``t`` of a gait, since when, and for how long yet [s]."""
    if duty >= 1.0:
        return True, np.inf, np.inf
    stance_time = duty * period
    elapsed = (t - offset * period + TIE) % period - TIE
    if elapsed < stance_time - TIE:
        return True, max(elapsed, 0.0), stance_time - elapsed
    return False, max(elapsed - stance_time, 0.0), period - elapsed


@subroutine("void(f8[::1], f8[::1], f8[::1], f8, f8[:,::1])")
def nominal_feet(snapshot, s, c, width, feet):
    """Points below the hips of a level trunk with the measured heading, moved by ``com_shift``."""
    q = snapshot[_Q : _Q + 19]
    yaw = yaw_of(q) - s[_POSE + 3]
    cosine, sine = np.cos(yaw), np.sin(yaw)
    for leg in range(4):
        x, y = c[_NOMINAL + 3 * leg], width * c[_NOMINAL + 3 * leg + 1]
        feet[leg, 0] = q[0] + cosine * x - sine * y + snapshot[_SHIFT]
        feet[leg, 1] = q[1] + sine * x + cosine * y + snapshot[_SHIFT + 1]


@kernel("b1(f8[::1], f8[::1], f8[::1])")
def is_square(snapshot, s, c):
    """Whether the feet form the nominal rectangle, wherever its middle is."""
    offsets, mean = np.empty((4, 2)), np.zeros(2)
    nominal_feet(snapshot, s, c, c[_REST + 6], offsets)
    for leg in range(4):
        for i in range(2):
            offsets[leg, i] = snapshot[_P_FEET + 3 * leg + i] - offsets[leg, i]
            mean[i] += offsets[leg, i] / 4
    for leg in range(4):
        if not np.hypot(offsets[leg, 0] - mean[0], offsets[leg, 1] - mean[1]) < c[_SQUARE]:
            return False
    return True


@subroutine("b1(f8[::1], f8[::1])")
def must_step(snapshot, c):
    """Whether the capture point is too far from the feet's middle."""
    omega = np.sqrt(c[_GRAVITY] / c[_HEIGHT])
    offset = np.empty(2)
    for i in range(2):
        middle = 0.0
        for leg in range(4):
            middle += snapshot[_P_FEET + 3 * leg + i] / 4
        offset[i] = snapshot[_P_COM + i] + snapshot[_V_COM + i] / omega - middle
    return np.hypot(offset[0], offset[1]) > c[_CAPTURE]


@subroutine("b1(f8[::1])")
def is_landing(s):
    """Whether feet touch down at this tick and no other one is in the air."""
    has_landed = False
    for leg in range(4):
        stance, _, _ = foot_phase(s[_PHASE_TIME], s[_OFFSETS + leg], s[_PERIOD], s[_DUTY])
        was_stance = s[_WAS_STANCE + leg] != 0.0
        if not (stance or was_stance):
            return False
        has_landed |= stance and not was_stance
    return has_landed


@subroutine("b1(f8[::1], f8[::1])")
def is_settled(s, c):
    """Whether the ramped command has arrived at zero."""
    x, y, turn = abs(s[_VELOCITY]), abs(s[_VELOCITY + 1]), abs(s[_VELOCITY + 2])
    return x < c[_SETTLED] and y < c[_SETTLED] and turn < c[_SETTLED]


@subroutine("b1(f8[::1], f8[::1], f8[::1])")
def may_stop(snapshot, s, c):
    """Whether the robot is slow, no longer commanded, and stands squarely."""
    slow = np.hypot(snapshot[_V_COM], snapshot[_V_COM + 1]) < c[_SETTLE_SPEED]
    return is_settled(s, c) and slow and is_square(snapshot, s, c)


@subroutine("void(f8[::1], f8[::1], f8[::1], f8, f8[::1])")
def advance_phase(snapshot, s, c, dt, command):
    """Start, go on, or come to rest."""
    is_zero = command[0] == 0.0 and command[1] == 0.0 and command[2] == 0.0
    if s[_STEPPING] != 0.0:
        s[_PHASE_TIME] += dt
        if is_zero and is_landing(s) and may_stop(snapshot, s, c):
            s[_STEPPING] = 0.0
    elif not is_zero or must_step(snapshot, c):
        s[_STEPPING], s[_PHASE_TIME] = 1.0, 0.0
        s[_PERIOD : _PERIOD + 7] = c[_REST : _REST + 7]
        s[_GOAL : _GOAL + 4] = c[_REST + 2 : _REST + 6]


@subroutine("void(f8[::1], f8[::1])")
def align(s, goal):
    """Name the phases of now so that they are near to the ``goal``, as ``aligned``."""
    ways = np.empty(4)
    for leg in range(4):
        ways[leg] = (goal[leg] - s[_OFFSETS + leg]) % 1.0
    ways.sort()
    widest, last = 0.0, 3
    for k in range(4):
        gap = ways[k + 1] - ways[k] if k < 3 else 1.0 - (ways[3] - ways[0])
        gap = np.floor(gap * RESOLUTION + 0.5)
        if gap > widest:
            widest, last = gap, k
    shift = ways[(last + 1) % 4] + (1.0 - widest / RESOLUTION) / 2.0
    for leg in range(4):
        turns = np.floor((s[_OFFSETS + leg] + shift) * RESOLUTION + 0.5) / RESOLUTION
        s[_OFFSETS + leg] = turns % 1.0 % 1.0
        s[_GOAL + leg] = goal[leg]
    s[_PHASE_TIME] = (s[_PHASE_TIME] + shift * s[_PERIOD]) % s[_PERIOD]


@subroutine("void(f8[::1], f8[::1], f8[::1], f8, f8[::1])")
def adapt_gait(snapshot, s, c, dt, command):
    """Bring the gait's form towards that wanted; the phases of the feet do not jump."""
    wanted = np.empty(7)
    wanted[:] = c[_GAIT : _GAIT + 7]
    rise, fall, is_thrown = c[_RATES + 1], c[_RATES + 1], False
    is_zero = command[0] == 0.0 and command[1] == 0.0 and command[2] == 0.0
    if is_zero and is_settled(s, c):
        wanted[:] = c[_REST : _REST + 7]
    elif c[_STRIDE] > 0.0:
        arm = np.hypot(c[_NOMINAL], c[_NOMINAL + 1])
        speed = np.hypot(s[_VELOCITY], s[_VELOCITY + 1])
        thrown = np.hypot(snapshot[_V_COM], snapshot[_V_COM + 1]) - c[_MARGIN]
        if thrown > speed:
            speed, fall, is_thrown = thrown, c[_RATES + 3], True
        speed += arm * abs(s[_VELOCITY + 2])
        stance = min(max(c[_STRIDE] / max(speed, TINY), c[_STRIDE + 1]), c[_STRIDE + 2])
        wanted[0] = stance + c[_STRIDE + 3] + c[_STRIDE + 4] * (speed - 1.0)
        wanted[1] = stance / wanted[0]
    if (wanted[2:6] != s[_GOAL : _GOAL + 4]).any():
        align(s, wanted[2:6])
    left = abs(s[_PERIOD] - wanted[0]) / c[_RATES]
    if left > 0.0 and not is_thrown and (wanted[2:6] != s[_OFFSETS : _OFFSETS + 4]).any():
        rise = fall = min(fall, abs(wanted[1] - s[_DUTY]) / left)
    if wanted[0] != s[_PERIOD]:
        most = c[_RATES] * dt
        period = s[_PERIOD] + min(max(wanted[0] - s[_PERIOD], -most), most)
        s[_PHASE_TIME] = s[_PHASE_TIME] % s[_PERIOD] * period / s[_PERIOD]
        s[_PERIOD] = period
    s[_DUTY] += min(max(wanted[1] - s[_DUTY], -fall * dt), rise * dt)
    most = c[_RATES + 4] * dt
    s[_WIDTH] += min(max(wanted[6] - s[_WIDTH], -most), most)
    share = dt / left if left > dt else 1.0
    for leg in range(4):
        if wanted[2 + leg] != s[_OFFSETS + leg]:
            way = (wanted[2 + leg] - s[_OFFSETS + leg] + 0.5) % 1.0 - 0.5
            most = min(c[_RATES + 2] * dt, abs(way) * share)
            if abs(way) <= most:
                s[_OFFSETS + leg] = wanted[2 + leg]
            else:
                s[_OFFSETS + leg] = (s[_OFFSETS + leg] + (most if way > 0.0 else -most)) % 1.0 % 1.0


@subroutine("void(f8[::1], f8[::1], f8[::1], f8, f8[::1])")
def integrate(snapshot, s, c, dt, command):
    """Ramp velocity and pose, integrate to the place, apply the leash, correct the height."""
    advance_pose(s[_POSE : _POSE + 4], s[_POSE_RATE : _POSE_RATE + 4], c, command, dt)
    for i in range(3):
        most = c[_ACCELERATION + i] * dt
        s[_VELOCITY + i] += min(max(command[i] - s[_VELOCITY + i], -most), most)
    s[_YAW] += s[_VELOCITY + 2] * dt
    difference = s[_YAW] + s[_POSE + 3] - yaw_of(snapshot[_Q : _Q + 19])
    lead = np.arctan2(np.sin(difference), np.cos(difference))
    s[_YAW] += min(max(lead, -c[_YAW_LEASH]), c[_YAW_LEASH]) - lead
    cosine, sine = np.cos(s[_YAW]), np.sin(s[_YAW])
    s[_POSITION] += (cosine * s[_VELOCITY] - sine * s[_VELOCITY + 1]) * dt
    s[_POSITION + 1] += (sine * s[_VELOCITY] + cosine * s[_VELOCITY + 1]) * dt
    x, y = s[_POSITION] - snapshot[_P_COM], s[_POSITION + 1] - snapshot[_P_COM + 1]
    distance = np.hypot(x, y)
    if distance > c[_LEASH]:
        s[_POSITION] = snapshot[_P_COM] + x * c[_LEASH] / distance
        s[_POSITION + 1] = snapshot[_P_COM + 1] + y * c[_LEASH] / distance
    carry_ground(snapshot, s)
    sag = s[_GROUND] + c[_HEIGHT] + s[_POSE] - snapshot[_P_COM + 2]
    counted = min(max(sag, -c[_WINDOW]), c[_WINDOW])
    offset = s[_HEIGHT_OFFSET] + c[_RATE] * dt * counted
    s[_HEIGHT_OFFSET] = min(max(offset, -c[_LIMIT]), c[_LIMIT])


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], b1[::1], f8[::1])")
def note_liftoffs(snapshot, contact, s, c, stance, progress):
    """Remember where feet leave the ground; learn of it where they meet it, or stumble."""
    met, stumbles = np.zeros(4, dtype=np.bool_), np.zeros(4, dtype=np.bool_)
    for leg in range(4):
        was_stance = s[_WAS_STANCE + leg] != 0.0
        if was_stance and not stance[leg]:
            begin_swing(leg, snapshot, s, c)
        if not stance[leg]:
            s[_AWAITED + leg] = 0.0
            is_middle = abs(progress[leg] - 0.5) <= c[_MID_SWING] + TIE
            stumbles[leg] = is_middle and contact[leg] != 0.0
        elif not was_stance:
            s[_AWAITED + leg] = 1.0
        if s[_AWAITED + leg] != 0.0 and contact[leg] != 0.0:
            met[leg] = True
            s[_AWAITED + leg] = 0.0
        s[_WAS_STANCE + leg] = 1.0 if stance[leg] else 0.0
    learn_ground(snapshot, s, c, met)
    if stumbles.any():
        note_stumble(s, c)
    for leg in range(4):
        if stumbles[leg]:
            resume_swing(leg, snapshot, s, c, progress[leg])


@subroutine("void(i8, f8[::1], f8[::1], f8[::1], f8[:,::1], f8, f8[::1])")
def foothold(leg, snapshot, s, c, nominal, remaining, goal):
    """Touchdown point: as ``_footholds`` there, the offset from the way of the hip within reach."""
    cosine, sine = np.cos(s[_YAW]), np.sin(s[_YAW])
    ref_x = cosine * s[_VELOCITY] - sine * s[_VELOCITY + 1]
    ref_y = sine * s[_VELOCITY] + cosine * s[_VELOCITY + 1]
    arm_x, arm_y = nominal[leg, 0] - snapshot[_Q], nominal[leg, 1] - snapshot[_Q + 1]
    v_x, v_y, half = snapshot[_V_COM], snapshot[_V_COM + 1], s[_DUTY] * s[_PERIOD] / 2
    cosine, sine = np.cos(s[_VELOCITY + 2] * remaining), np.sin(s[_VELOCITY + 2] * remaining)
    hip_x, hip_y = cosine * arm_x - sine * arm_y, sine * arm_x + cosine * arm_y
    cosine, sine = np.cos(s[_VELOCITY + 2] * half), np.sin(s[_VELOCITY + 2] * half)
    lean = s[_VELOCITY + 2] * c[_HEIGHT] / c[_GRAVITY]
    x = cosine * hip_x - sine * hip_y - hip_x + v_x * half
    y = sine * hip_x + cosine * hip_y - hip_y + v_y * half
    x += c[_FEEDBACK] * (v_x - ref_x) + lean * ref_y
    y += c[_FEEDBACK] * (v_y - ref_y) - lean * ref_x
    share = min(1.0, c[_REACH] / max(np.hypot(x, y), TINY))
    goal[0] = snapshot[_Q] + hip_x + x * share + v_x * remaining
    goal[1] = snapshot[_Q + 1] + hip_y + y * share + v_y * remaining
    goal[2] = ground_at(s, goal[0], goal[1]) + c[_RADIUS]


@subroutine("void(f8[::1], f8[::1], f8[::1])")
def fill_body(s, c, target):
    """The trunk's reference: integrated pose, commanded velocity, along the ground."""
    cosine, sine = np.cos(s[_YAW]), np.sin(s[_YAW])
    target[_IS_COM] = 1.0
    target[_BODY_P], target[_BODY_P + 1] = s[_POSITION], s[_POSITION + 1]
    target[_BODY_P + 2] = ground_at(s, s[_POSITION], s[_POSITION + 1])
    target[_BODY_P + 2] += c[_HEIGHT] + s[_HEIGHT_OFFSET] + s[_POSE]
    v_x = cosine * s[_VELOCITY] - sine * s[_VELOCITY + 1]
    v_y = sine * s[_VELOCITY] + cosine * s[_VELOCITY + 1]
    target[_BODY_V], target[_BODY_V + 1] = v_x, v_y
    target[_BODY_V + 2] = s[_SLOPE] * v_x + s[_SLOPE + 1] * v_y + s[_POSE_RATE]
    a, b = tilt(s, c)
    rise = a * cosine + b * sine
    length, steep = np.sqrt(1.0 + rise * rise), np.sqrt(1.0 + a * a + b * b)
    x = cosine / length, sine / length, rise / length
    z = -a / steep, -b / steep, 1.0 / steep
    y = cross(z, x)
    for i in range(3):
        target[_BODY_R + 3 * i] = x[i]
        target[_BODY_R + 3 * i + 1] = y[i]
        target[_BODY_R + 3 * i + 2] = z[i]
    pose, turn = s[_POSE : _POSE + 4], np.empty(3)
    lean_rotation(pose, target[_BODY_R : _BODY_R + 9].reshape(3, 3))
    w = target[_BODY_W : _BODY_W + 3]
    pose_turn(s[_YAW], pose, s[_POSE_RATE : _POSE_RATE + 4], turn, w)
    w[2] += s[_VELOCITY + 2]


@subroutine("void(f8[::1], f8[::1], f8[::1], b1[::1], b1[::1], f8[::1], f8[::1], f8[::1])")
def fill_feet(snapshot, s, c, stance, stands, elapsed, remaining, target):
    """What each leg does, its load, and the way of a foot in the air."""
    nominal, goal = np.empty((4, 2)), np.empty(3)
    nominal_feet(snapshot, s, c, s[_WIDTH], nominal)
    for leg in range(4):
        target[_LEGS + leg] = 0.0 if stands[leg] else 1.0
        for i in range(3):
            target[_FOOT_P + 3 * leg + i] = snapshot[_P_FEET + 3 * leg + i]
        share = 0.0
        if stands[leg]:
            loaded = loaded_time(s, leg, stance[leg], elapsed[leg], remaining[leg])
            share = min(loaded / max(c[_RAMP], TIE), 1.0)
        else:
            foothold(leg, snapshot, s, c, nominal, remaining[leg], goal)
            progress = elapsed[leg] / (elapsed[leg] + remaining[leg])
            swing(leg, s, c, progress, goal, target)
        target[_T_F_MIN + leg], target[_T_F_MAX + leg] = c[_F_MIN] * share, c[_F_MAX] * share


@kernel("void(f8[::1], f8, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def plan(snapshot, time, contact, tau, s, c, command, target):
    """Bring the state to ``time`` and fill the reference of this tick.

    ``contact`` is not 0 for the feet in measured contact, ``tau`` the measured torques.
    """
    dt = time - s[_TIME]
    s[_TIME] = time
    advance_phase(snapshot, s, c, dt, command)
    integrate(snapshot, s, c, dt, command)
    if s[_STEPPING] != 0.0:
        adapt_gait(snapshot, s, c, dt, command)
    stance = np.ones(4, dtype=np.bool_)
    elapsed, remaining = np.full(4, np.inf), np.full(4, np.inf)
    if s[_STEPPING] != 0.0:
        for leg in range(4):
            stance[leg], elapsed[leg], remaining[leg] = foot_phase(
                s[_PHASE_TIME], s[_OFFSETS + leg], s[_PERIOD], s[_DUTY]
            )
    stands, progress = np.ones(4, dtype=np.bool_), np.zeros(4)
    for leg in range(4):
        if not stance[leg]:
            progress[leg] = elapsed[leg] / (elapsed[leg] + remaining[leg])
        touches, share = contact[leg] != 0.0, progress[leg]
        stands[leg] = follow_contact(snapshot, s, c, leg, touches, stance[leg], share, dt)
    observe_slip(snapshot, contact, tau, s, c, stands, dt)
    note_liftoffs(snapshot, contact, s, c, stance, progress)
    target[:] = 0.0
    target[_T_FRICTION] = level_friction(s, c)
    fill_body(s, c, target)
    level(snapshot, contact, s, c, dt, target)
    fill_feet(snapshot, s, c, stance, stands, elapsed, remaining, target)
    for n in range(12):
        target[_JOINT_Q + n] = snapshot[_Q + 7 + n]
