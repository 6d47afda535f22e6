"""The contact forces of a gait, planned by the MPC from the planned trunk motion and footholds.

The MPC (``planning.mpc``) uses the command as it will be ramped, the present footholds of stance
feet, and the planned footholds of those that will land. Lever arms are taken from the measured CoM
along its desired path: taken from the reference, which may run ahead of the robot, they make it
drift sideways. A robot that a push has made too fast is predicted to keep its speed and slow down
gradually. At 3.7 m/s, predicted as one that trots at 0.5, it would have its next footholds 0.4 m
too far ahead, and be tipped by forces planned for these. Between two solutions the forces of the
first node are kept, and the trunk's acceleration in the reference of the whole-body controller is
what they make with the present stance feet.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.active_set import SOLVED
from go2_wbc.algebra.linear import cross, plus, solve_linear, triple
from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.planning.footholds import excess_velocity, foothold, nominal_feet
from go2_wbc.planning.gait_clock import Clock
from go2_wbc.planning.ground import EASE, ground_at, haste, is_rough, on_leash, tilt
from go2_wbc.planning.mpc import INTERVAL, NODES, STEP, Horizon, solve_mpc
from go2_wbc.planning.trunk import Command, advance_pose, pose_turn, ramp
from go2_wbc.planning.walk import Planner, Walk, carried_height
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.state import Snapshot


@subroutine
def inertia_about_com(now: Snapshot, inertia: Float[np.ndarray, "3 3"]) -> None:
    """Fill the inertia [kg m^2] of the robot as it is, about its CoM, world axes."""
    R, M = now.R_world_base, now.mass_matrix
    c, about = np.empty(3), np.empty((3, 3))
    for i in range(3):
        c[i] = 0.0
        for k in range(3):
            c[i] += R[k, i] * (now.p_world_com[k] - now.q[k])
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


@subroutine
def turn_from(now: Snapshot, yaw: float, turn: Float[np.ndarray, "3"]) -> None:
    """Fill log(R R_ref') for the reference that is level and has the heading ``yaw``."""
    R, E = now.R_world_base, np.empty((3, 3))
    cosine, sine = np.cos(yaw), np.sin(yaw)
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


@subroutine
def fill_goals(s: Planner, c: Walk, command: Command) -> None:
    """Pose and rate wanted at the end of each node: the command ramped and integrated."""
    config, velocity, goals = c.config, s.trunk.velocity.copy(), s.horizon.goals
    yaw, x, y = s.trunk.yaw, s.trunk.position[0], s.trunk.position[1]
    a, b = tilt(s.ground)
    steep = np.hypot(a, b)
    as_angle = np.arctan(steep) / steep if steep > 0.0 else 1.0
    share = haste(s.ground, config.rough, s.slip.friction, s.delay, s.trunk.velocity)
    linear = share * config.linear_acceleration
    goals[:] = 0.0
    for k in range(NODES):
        ramp(velocity, command, linear, config.angular_acceleration, STEP)
        yaw += velocity[2] * STEP
        cosine, sine = np.cos(yaw), np.sin(yaw)
        goals[k, 9] = cosine * velocity[0] - sine * velocity[1]
        goals[k, 10] = sine * velocity[0] + cosine * velocity[1]
        x += goals[k, 9] * STEP
        y += goals[k, 10] * STEP
        goals[k, 2], goals[k, 8] = yaw - s.trunk.yaw, velocity[2]
        goals[k, 3], goals[k, 4] = x, y
        goals[k, 0], goals[k, 1] = as_angle * b, -as_angle * a
        goals[k, 5] = ground_at(s.ground, x, y) + carried_height(s, c)
        goals[k, 5] += s.trunk.height_offset
        goals[k, 11] = s.ground.slope[0] * goals[k, 9] + s.ground.slope[1] * goals[k, 10]


@subroutine
def lean_goals(s: Planner, c: Walk, command: Command) -> None:
    """Add to the goals of a level trunk the pose on its way."""
    pose, rate = s.trunk.pose.copy(), s.trunk.pose_rate.copy()
    turn, w, goals = np.empty(3), np.empty(3), s.horizon.goals
    for k in range(NODES):
        advance_pose(pose, rate, c.config.pose, command.pose, STEP)
        pose_turn(s.trunk.yaw + goals[k, 2], pose, rate, turn, w)
        goals[k, 2] += pose[3] - s.trunk.pose[3]
        goals[k, 5] += pose[0]
        goals[k, 11] += rate[0]
        for i in range(3):
            goals[k, i] += turn[i]
            goals[k, 6 + i] += w[i]


@subroutine
def fill_contacts(clock: Clock, h: Horizon) -> None:
    """Share of each node that each foot stands, and in how many strides it will have landed for it.

    The latter is at most 0 for a foot that stands there now.
    """
    period, duty, share, landings = clock.period, clock.duty, h.share, h.landings
    span = STEP / period
    for leg in range(4):
        first = (clock.time / period - clock.offsets[leg] + TIE) % 1.0 - TIE
        for k in range(NODES):
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


@subroutine
def fill_arms(now: Snapshot, s: Planner, c: Walk) -> None:
    """From the CoM in the middle of each node to the contact points [m].

    A foot that comes down once more is then below its hip in the middle of its stance.
    """
    period, duty, h = s.clock.period, s.clock.duty, s.horizon
    goals, landings = h.goals, h.landings
    fading, com = c.config.mpc.throw_time, triple(now.p_world_com)
    base = plus((now.q[0], now.q[1], now.q[2]), triple(now.com_shift))
    nominal, goal, footholds = np.empty((4, 2)), np.empty(3), np.empty((4, 2))
    nominal_feet(now, s, c, s.clock.width, nominal)
    for leg in range(4):
        remaining = max(landings[0, leg], 0.0) * period
        foothold(leg, now, s, c, nominal, remaining, goal)
        footholds[leg] = s.feet[leg].step.goal[:2] if s.feet[leg].step.is_sighted else goal[:2]
    here_x, here_y = s.trunk.position[0], s.trunk.position[1]
    before_x, before_y = here_x, here_y
    excess_x, excess_y = excess_velocity(now, s, c)
    for k in range(NODES):
        left = np.exp(-(k + 0.5) * STEP / fading)
        thrown = fading * (1.0 - left)
        way_x = (before_x + goals[k, 3]) / 2 - here_x + excess_x * thrown
        way_y = (before_y + goals[k, 4]) / 2 - here_y + excess_y * thrown
        before_x, before_y = goals[k, 3], goals[k, 4]
        rate = goals[k, 8]
        for leg in range(4):
            wait = landings[k, leg] * period
            arm = h.arms[k, leg]
            if landings[k, leg] == 0.0:
                foot = now.p_world_feet[leg]
                arm[0] = foot[0] - com[0] - way_x
                arm[1] = foot[1] - com[1] - way_y
                arm[2] = foot[2] - com[2] - c.foot_radius
            elif landings[k, leg] < 1.0 - duty + TIE:
                arm[0] = footholds[leg, 0] - com[0] - way_x
                arm[1] = footholds[leg, 1] - com[1] - way_y
                arm[2] = ground_at(s.ground, footholds[leg, 0], footholds[leg, 1]) - com[2]
                if s.feet[leg].step.is_sighted:
                    arm[2] = s.feet[leg].step.goal[2] - c.foot_radius - com[2]
            else:
                yaw = s.trunk.yaw + rate * wait
                cosine, sine = np.cos(yaw), np.sin(yaw)
                x = c.p_base_feet_nominal[leg, 0]
                y = s.clock.width * c.p_base_feet_nominal[leg, 1]
                hip_x, hip_y = cosine * x - sine * y, sine * x + cosine * y
                early = duty * period / 2 + wait - (k + 0.5) * STEP
                v_x, v_y = goals[k, 9] + excess_x * left, goals[k, 10] + excess_y * left
                last, next = max(k - 1, 0), min(k + 1, NODES - 1)
                fall = c.height / c.gravity / (STEP * (next - last))
                lean_x = fall * (goals[next, 9] - goals[last, 9])
                lean_y = fall * (goals[next, 10] - goals[last, 10])
                arm[0] = base[0] - com[0] + hip_x + (v_x - rate * hip_y) * early - lean_x
                arm[1] = base[1] - com[1] + hip_y + (v_y + rate * hip_x) * early - lean_y
                arm[2] = ground_at(s.ground, com[0] + arm[0], com[1] + arm[1]) - com[2]


@subroutine
def look_ahead(now: Snapshot, s: Planner, c: Walk, command: Command) -> None:
    """Fill what the MPC looks at."""
    turn, w, state = np.empty(3), now.v[3:6], s.horizon.state
    turn_from(now, s.trunk.yaw + s.trunk.pose[3], turn)
    for i in range(3):
        state[i], state[3 + i] = turn[i], now.p_world_com[i]
        state[6 + i], state[9 + i] = 0.0, now.v_world_com[i]
        for k in range(3):
            state[6 + i] += now.R_world_base[i, k] * w[k]
    fill_goals(s, c, command)
    fill_contacts(s.clock, s.horizon)
    fill_arms(now, s, c)
    lean_goals(s, c, command)
    for k in range(NODES):
        s.horizon.goals[k, 5] = on_leash(s.ground, s.horizon.goals[k, 5], now)


@subroutine
def plan_forces(now: Snapshot, s: Planner, c: Walk, command: Command, friction: float) -> bool:
    """Solve for the forces of the first node, while its feet stand; False without solution."""
    look_ahead(now, s, c, command)
    h, mpc = s.horizon, c.config.mpc
    h.mass, h.gravity, h.friction = c.mass + now.payload[0], c.gravity, friction
    outcome = solve_mpc(mpc, h)
    for leg in range(4):
        for i in range(3):
            stood = max(h.share[0, leg], mpc.least_share)
            s.planned.f_world_feet[leg, i] = h.forces[0, leg, i] / stood
    return outcome == SOLVED


@subroutine
def apply_force_plan(now: Snapshot, s: Planner, c: Walk, command: Command, target: Target) -> None:
    """Put the planned forces into a reference, with the accelerations that they make."""
    mpc = c.config.mpc
    inertia_about_com(now, s.horizon.inertia)
    if s.time >= s.planned.next - TIE:
        if not plan_forces(now, s, c, command, min(mpc.friction, target.friction)):
            return
        s.planned.next = s.time + INTERVAL
    system, mass, a = np.zeros((3, 4)), c.mass + now.payload[0], np.zeros(3)
    system[:, :3] = s.horizon.inertia
    for leg in range(4):
        if target.legs[leg] != STANCE:
            continue
        force, foot = triple(s.planned.f_world_feet[leg]), triple(now.p_world_feet[leg])
        arm = (
            foot[0] - now.p_world_com[0],
            foot[1] - now.p_world_com[1],
            foot[2] - c.foot_radius - now.p_world_com[2],
        )
        moment = cross(arm, force)
        for i in range(3):
            target.f_world_feet[leg, i] = force[i]
            a[i] += force[i] / mass
            system[i, 3] += moment[i]
    solve_linear(system, 3)
    for i in range(3):
        target.a_world[i], target.dw_world[i] = a[i], system[i, 3]
    target.a_world[2] -= c.gravity
    target.force_weight = mpc.prior_weight
    x, y = excess_velocity(now, s, c)
    ease = EASE if is_rough(s.ground) else 0.0
    target.orientation_discount = max(np.hypot(x, y) / mpc.throw_speed, ease)
