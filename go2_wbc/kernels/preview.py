"""The planned forces of a gait as a kernel; ``planning.preview`` is its readable form.

Names and order follow the functions there. ``s`` is the planner's state (``layout.PLANNER``), ``c``
its numbers (``layout.LOCOMOTION``), ``m`` those of the MPC (``layout.MPC``), ``f`` what was planned
(``layout.FORCES``).
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.active_set import SOLVED
from go2_wbc.algebra.linear import solve_linear
from go2_wbc.algebra.vectors import cross, plus
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.elimination import STANCE
from go2_wbc.kernels.ground import ground_at, tilt
from go2_wbc.kernels.layout import (
    FORCES,
    LOCOMOTION,
    MPC,
    MPC_NODES,
    PLANNER,
    REFERENCE,
    SNAPSHOT,
)
from go2_wbc.kernels.locomotion import TIE, foothold, nominal_feet
from go2_wbc.kernels.mpc import solve_mpc
from go2_wbc.kernels.pose import advance_pose, pose_turn
from go2_wbc.kernels.vectors import vector

_N, _T, _S, _C = SNAPSHOT.start, REFERENCE.start, PLANNER.start, LOCOMOTION.start
_Q, _V, _R, _M = (_N[n] for n in ("q", "v", "R_world_base", "mass_matrix"))
_P_COM, _V_COM, _P_FEET = (_N[n] for n in ("p_world_com", "v_world_com", "p_world_feet"))
_SHIFT, _CARRIED = _N["com_shift"], _N["payload"]
_YAW, _POSITION, _VELOCITY = (_S[n] for n in ("yaw", "position", "velocity"))
_PHASE_TIME, _HEIGHT_OFFSET = _S["phase_time"], _S["height_offset"]
_PERIOD, _DUTY, _OFFSETS, _WIDTH = (_S[n] for n in ("period", "duty", "offsets", "width"))
_STEPPING, _SLOPE = _S["is_stepping"], _S["slope"]
_POSE, _POSE_RATE = _S["pose"], _S["pose_rate"]
_ACCELERATION, _HEIGHT, _RADIUS = (_C[n] for n in ("acceleration", "height", "foot_radius"))
_NOMINAL, _MARGIN = _C["p_base_feet_nominal"], _C["stride_margin"]
_STEP, _MASS, _GRAVITY = (MPC.start[n] for n in ("step", "mass", "gravity"))
_LEAST_SHARE, _INTERVAL, _PRIOR = (MPC.start[n] for n in ("least_share", "interval", "prior"))
_THROW_TIME, _THROW_SPEED = MPC.start["throw_time"], MPC.start["throw_speed"]
_NEXT, _PLANNED = FORCES.start["next"], FORCES.start["forces"]
_LEGS, _A, _DW = (_T[n] for n in ("legs", "a_world", "dw_world"))
_T_FORCES, _WEIGHT, _DISCOUNT = (
    _T[n] for n in ("f_world_feet", "force_weight", "orientation_discount")
)


@subroutine("void(f8[::1], f8[:,::1])")
def inertia_about_com(snapshot, inertia):
    """Fill the inertia (3, 3) about the CoM, world axes."""
    R = snapshot[_R : _R + 9].reshape(3, 3)
    M = snapshot[_M : _M + 324].reshape(18, 18)
    c, about = np.empty(3), np.empty((3, 3))
    for i in range(3):
        c[i] = 0.0
        for k in range(3):
            c[i] += R[k, i] * (snapshot[_P_COM + k] - snapshot[_Q + k])
    square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2]
    for i in range(3):
        for k in range(3):
            moved = -c[i] * c[k]
            if i == k:
                moved += square
            about[i, k] = M[3 + i, 3 + k] - M[0, 0] * moved
    for i in range(3):
        for k in range(3):
            inertia[i, k] = 0.0
            for a in range(3):
                for b in range(3):
                    inertia[i, k] += R[i, a] * about[a, b] * R[k, b]


@subroutine("void(f8[::1], f8, f8[::1])")
def turn_from(snapshot, yaw, turn):
    """Fill log(R R_ref') for the reference that is level and has the heading ``yaw``."""
    R = snapshot[_R : _R + 9].reshape(3, 3)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    E = np.empty((3, 3))
    for i in range(3):
        E[i, 0] = R[i, 0] * cosine - R[i, 1] * sine
        E[i, 1] = R[i, 0] * sine + R[i, 1] * cosine
        E[i, 2] = R[i, 2]
    turn[0] = (E[2, 1] - E[1, 2]) / 2
    turn[1] = (E[0, 2] - E[2, 0]) / 2
    turn[2] = (E[1, 0] - E[0, 1]) / 2
    length = np.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    angle = np.arctan2(length, (E[0, 0] + E[1, 1] + E[2, 2] - 1) / 2)
    # x / sin x = 1 + x^2 / 6 + ...
    turn *= angle / length if length > 1e-6 else 1.0 + angle * angle / 6


@subroutine("void(f8[::1], f8[::1], f8[::1], f8, f8[:,::1])")
def fill_goals(s, c, command, step, goals):
    """Pose and rate wanted at the end of each node: the command ramped and integrated."""
    velocity = s[_VELOCITY : _VELOCITY + 3].copy()
    yaw, x, y = s[_YAW], s[_POSITION], s[_POSITION + 1]
    a, b = tilt(s, c)
    steep = np.hypot(a, b)
    share = np.arctan(steep) / steep if steep > 0.0 else 1.0
    goals[:] = 0.0
    for k in range(MPC_NODES):
        for i in range(3):
            most = c[_ACCELERATION + i] * step
            velocity[i] += min(max(command[i] - velocity[i], -most), most)
        yaw += velocity[2] * step
        cosine, sine = np.cos(yaw), np.sin(yaw)
        goals[k, 9] = cosine * velocity[0] - sine * velocity[1]
        goals[k, 10] = sine * velocity[0] + cosine * velocity[1]
        x += goals[k, 9] * step
        y += goals[k, 10] * step
        goals[k, 2], goals[k, 8] = yaw - s[_YAW], velocity[2]
        goals[k, 3], goals[k, 4] = x, y
        goals[k, 0], goals[k, 1] = share * b, -share * a
        goals[k, 5] = ground_at(s, x, y) + c[_HEIGHT] + s[_HEIGHT_OFFSET]
        goals[k, 11] = s[_SLOPE] * goals[k, 9] + s[_SLOPE + 1] * goals[k, 10]


@subroutine("void(f8[::1], f8[::1], f8[::1], f8, f8[:,::1])")
def lean_goals(s, c, command, step, goals):
    """Add to the goals of a level trunk the pose on its way."""
    pose, rate = s[_POSE : _POSE + 4].copy(), s[_POSE_RATE : _POSE_RATE + 4].copy()
    turn, w = np.empty(3), np.empty(3)
    for k in range(MPC_NODES):
        advance_pose(pose, rate, c, command, step)
        pose_turn(s[_YAW] + goals[k, 2], pose, rate, turn, w)
        goals[k, 2] += pose[3] - s[_POSE + 3]
        goals[k, 5] += pose[0]
        goals[k, 11] += rate[0]
        for i in range(3):
            goals[k, i] += turn[i]
            goals[k, 6 + i] += w[i]


@subroutine("void(f8[::1], f8, f8[:,::1], f8[:,::1])")
def fill_contacts(s, step, share, landings):
    """Share of each node that each foot stands, and in how many strides it will have landed."""
    period, duty = s[_PERIOD], s[_DUTY]
    span = step / period
    for leg in range(4):
        first = (s[_PHASE_TIME] / period - s[_OFFSETS + leg] + TIE) % 1.0 - TIE
        for k in range(MPC_NODES):
            phase = first + k * span
            stride = np.floor(phase + TIE)
            inside = phase - stride
            standing = max(min(inside + span, duty) - inside, 0.0)
            again = max(min(inside + span - 1.0, duty), 0.0)
            share[k, leg] = min((standing + again) / span, 1.0)
            if not (inside < duty - TIE or duty >= 1.0):
                landings[k, leg] = stride + 1.0 - first
            elif stride == 0.0 or duty >= 1.0:
                landings[k, leg] = 0.0
            else:
                landings[k, leg] = stride - first


@subroutine("Tuple((f8, f8))(f8[::1], f8[::1], f8[::1])")
def excess_velocity(snapshot, s, c):
    """What the CoM has beyond the wanted velocity and the margin."""
    cosine, sine = np.cos(s[_YAW]), np.sin(s[_YAW])
    x = snapshot[_V_COM] - cosine * s[_VELOCITY] + sine * s[_VELOCITY + 1]
    y = snapshot[_V_COM + 1] - sine * s[_VELOCITY] - cosine * s[_VELOCITY + 1]
    speed = np.hypot(x, y)
    share = max(0.0, 1.0 - c[_MARGIN] / max(speed, TIE))
    return share * x, share * y


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1])")
def fill_arms(snapshot, s, c, m, goals, landings, arms):
    """From the CoM in the middle of each node to the contact points."""
    period, duty, step, fading = s[_PERIOD], s[_DUTY], m[_STEP], m[_THROW_TIME]
    com = vector(snapshot, _P_COM)
    base = plus(vector(snapshot, _Q), vector(snapshot, _SHIFT))
    nominal, goal, footholds = np.empty((4, 2)), np.empty(3), np.empty((4, 2))
    nominal_feet(snapshot, s, c, s[_WIDTH], nominal)
    for leg in range(4):
        remaining = max(landings[0, leg], 0.0) * period
        foothold(leg, snapshot, s, c, nominal, remaining, goal)
        footholds[leg] = goal[:2]
    before_x, before_y = s[_POSITION], s[_POSITION + 1]
    excess_x, excess_y = excess_velocity(snapshot, s, c)
    for k in range(MPC_NODES):
        left = np.exp(-(k + 0.5) * step / fading)
        thrown = fading * (1.0 - left)
        way_x = (before_x + goals[k, 3]) / 2 - s[_POSITION] + excess_x * thrown
        way_y = (before_y + goals[k, 4]) / 2 - s[_POSITION + 1] + excess_y * thrown
        before_x, before_y = goals[k, 3], goals[k, 4]
        rate = goals[k, 8]
        for leg in range(4):
            wait = landings[k, leg] * period
            arm = arms[k, leg]
            if landings[k, leg] == 0.0:
                foot = vector(snapshot, _P_FEET + 3 * leg)
                arm[0] = foot[0] - com[0] - way_x
                arm[1] = foot[1] - com[1] - way_y
                arm[2] = foot[2] - com[2] - c[_RADIUS]
            elif landings[k, leg] < 1.0 - duty + TIE:
                arm[0] = footholds[leg, 0] - com[0] - way_x
                arm[1] = footholds[leg, 1] - com[1] - way_y
                arm[2] = ground_at(s, footholds[leg, 0], footholds[leg, 1]) - com[2]
            else:
                yaw = s[_YAW] + rate * wait
                cosine, sine = np.cos(yaw), np.sin(yaw)
                x, y = c[_NOMINAL + 3 * leg], s[_WIDTH] * c[_NOMINAL + 3 * leg + 1]
                hip_x, hip_y = cosine * x - sine * y, sine * x + cosine * y
                early = duty * period / 2 + wait - (k + 0.5) * step
                v_x, v_y = goals[k, 9] + excess_x * left, goals[k, 10] + excess_y * left
                arm[0] = base[0] - com[0] + hip_x + (v_x - rate * hip_y) * early
                arm[1] = base[1] - com[1] + hip_y + (v_y + rate * hip_x) * early
                arm[2] = ground_at(s, com[0] + arm[0], com[1] + arm[1]) - com[2]


@subroutine("b1(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1])")
def plan_forces(snapshot, s, c, m, command, inertia, f):
    """Solve for the forces of the first node, while its feet stand; False without solution."""
    state, turn = np.empty(12), np.empty(3)
    turn_from(snapshot, s[_YAW] + s[_POSE + 3], turn)
    for i in range(3):
        state[i], state[3 + i] = turn[i], snapshot[_P_COM + i]
        state[6 + i], state[9 + i] = 0.0, snapshot[_V_COM + i]
        for k in range(3):
            state[6 + i] += snapshot[_R + 3 * i + k] * snapshot[_V + 3 + k]
    goals, share = np.empty((MPC_NODES, 12)), np.empty((MPC_NODES, 4))
    landings, arms = np.empty((MPC_NODES, 4)), np.empty((MPC_NODES, 4, 3))
    forces = np.empty((MPC_NODES, 4, 3))
    fill_goals(s, c, command, m[_STEP], goals)
    fill_contacts(s, m[_STEP], share, landings)
    fill_arms(snapshot, s, c, m, goals, landings, arms)
    numbers = m.copy()
    numbers[_MASS] += snapshot[_CARRIED]
    lean_goals(s, c, command, m[_STEP], goals)
    outcome = solve_mpc(numbers, state, goals, share, arms, inertia, forces)
    for leg in range(4):
        for i in range(3):
            f[_PLANNED + 3 * leg + i] = forces[0, leg, i] / max(share[0, leg], m[_LEAST_SHARE])
    return outcome == SOLVED


@kernel("void(f8[::1], f8, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def steer(snapshot, time, s, c, m, command, f, target):
    """Put the planned forces into a reference, with the accelerations that they make."""
    if s[_STEPPING] == 0.0:
        return
    inertia = np.empty((3, 3))
    inertia_about_com(snapshot, inertia)
    if time >= f[_NEXT] - TIE:
        if not plan_forces(snapshot, s, c, m, command, inertia, f):
            return
        f[_NEXT] = time + m[_INTERVAL]
    system, mass = np.zeros((3, 4)), m[_MASS] + snapshot[_CARRIED]
    system[:, :3] = inertia
    a = np.zeros(3)
    for leg in range(4):
        if target[_LEGS + leg] != STANCE:
            continue
        force, foot = vector(f, _PLANNED + 3 * leg), vector(snapshot, _P_FEET + 3 * leg)
        arm = (
            foot[0] - snapshot[_P_COM],
            foot[1] - snapshot[_P_COM + 1],
            foot[2] - c[_RADIUS] - snapshot[_P_COM + 2],
        )
        moment = cross(arm, force)
        for i in range(3):
            target[_T_FORCES + 3 * leg + i] = force[i]
            a[i] += force[i] / mass
            system[i, 3] += moment[i]
    solve_linear(system, 3)
    for i in range(3):
        target[_A + i], target[_DW + i] = a[i], system[i, 3]
    target[_A + 2] -= m[_GRAVITY]
    target[_WEIGHT] = m[_PRIOR]
    x, y = excess_velocity(snapshot, s, c)
    target[_DISCOUNT] = np.hypot(x, y) / m[_THROW_SPEED]
