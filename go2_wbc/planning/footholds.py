"""Where feet are put down: below the hips, ahead by half of what the trunk travels meanwhile.

Raibert (Legged Robots That Balance, 1986, ch. 2): a foot that is put down ``v T / 2`` ahead of its
hip is below it in the middle of the stance time ``T``, so it neither speeds the trunk up nor slows
it down; ``k (v - v_ref)`` more takes out the velocity error.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.planning.gait_clock import foot_phase
from go2_wbc.planning.ground import ground_at
from go2_wbc.planning.swing import cubic
from go2_wbc.planning.trunk import Trunk, gained, heading, world_velocity
from go2_wbc.planning.walk import Planner, Walk
from go2_wbc.robot.state import Snapshot

LEAST_GAP = 0.06
"""Distance [m] that the feet of one side, or of one end, keep from each other: a calf's width more
than a foot's."""
FAST = 2.5
"""Speed [m/s] from which on feet need all their reach and time: of 10 robots at 3 m/s on their own
sensors 1 fell whose hind feet, near the front ones there, were put back, and whose gait hurried."""
_TINY = 1e-9  #: Length [m] that stands in for zero where one divides by it


@subroutine
def nominal_feet(
    now: Snapshot, s: Planner, c: Walk, width: float, feet: Float[np.ndarray, "4 2"]
) -> None:
    """Fill the points [m] on the ground below the hips of a level trunk with the measured heading.

    A payload moves them as it does the CoM, which so stays above the feet's middle.
    """
    yaw = heading(now) - s.trunk.pose[3]
    cosine, sine = np.cos(yaw), np.sin(yaw)
    for leg in range(4):
        x, y = c.p_base_feet_nominal[leg, 0], width * c.p_base_feet_nominal[leg, 1]
        feet[leg, 0] = now.q[0] + cosine * x - sine * y + now.com_shift[0]
        feet[leg, 1] = now.q[1] + sine * x + cosine * y + now.com_shift[1]


@subroutine
def speeding_up(trunk: Trunk, remaining: float, stance: float, fall: float) -> tuple[float, float]:
    """How far [m] a foothold lies ahead as the command is ramped, in the world.

    The hip comes by s(t + T / 2) farther until the middle of the stance, and a trunk that speeds up
    by a needs the force m a, whose moment about the CoM the feet balance (h / g) a behind; ``fall``
    is h / g [s^2], ``stance`` T [s].
    """
    cosine, sine = np.cos(trunk.yaw), np.sin(trunk.yaw)
    way_x, way_y = 0.0, 0.0
    for axis in range(2):
        _, way = gained(trunk, axis, remaining + 0.5 * stance)
        before, _ = gained(trunk, axis, remaining)
        after, _ = gained(trunk, axis, remaining + stance)
        way -= fall * (after - before) / max(stance, _TINY)
        way_x += way * (cosine if axis == 0 else -sine)
        way_y += way * (sine if axis == 0 else cosine)
    return way_x, way_y


@subroutine
def way_by(trunk: Trunk, time: float) -> tuple[float, float]:
    """How far [m] the ramp of the command carries the robot within a ``time`` [s], in the world."""
    cosine, sine = np.cos(trunk.yaw), np.sin(trunk.yaw)
    _, ahead = gained(trunk, 0, time)
    _, left = gained(trunk, 1, time)
    return cosine * ahead - sine * left, sine * ahead + cosine * left


@subroutine
def excess_velocity(now: Snapshot, s: Planner, c: Walk) -> tuple[float, float]:
    """What the CoM has beyond the wanted velocity and the margin [m/s]."""
    cosine, sine, v = np.cos(s.trunk.yaw), np.sin(s.trunk.yaw), s.trunk.velocity
    x = now.v_world_com[0] - cosine * v[0] + sine * v[1]
    y = now.v_world_com[1] - sine * v[0] - cosine * v[1]
    speed = np.hypot(x, y)
    share = max(0.0, 1.0 - c.config.stride_margin / max(speed, TIE))
    return share * x, share * y


@subroutine
def is_thrown(now: Snapshot, s: Planner, c: Walk) -> bool:
    """Whether it goes its way faster than it is wanted to, by more than the margin.

    Such a robot sinks, and its feet meet level ground early, as they would meet a step: a trot that
    was pushed aside took it for rough ground for 2 s.
    """
    ref_x, ref_y = world_velocity(s.trunk)
    x, y = now.v_world_com[0], now.v_world_com[1]
    speed = max(np.hypot(x, y), TIE)
    return speed - (x * ref_x + y * ref_y) / speed > c.config.stride_margin


@subroutine
def is_easy(s: Planner) -> bool:
    """Whether the way is level, and slow: legs get straight on stairs, and of fast robots."""
    x, y = s.trunk.velocity[0], s.trunk.velocity[1]
    return not (s.clock.is_rough or s.clock.is_seen) and x * x + y * y <= FAST * FAST


@subroutine
def goes_as_told(now: Snapshot, s: Planner, c: Walk) -> bool:
    """Whether the way is easy, and the velocity the commanded one: nothing has thrown the robot."""
    return is_easy(s) and excess_velocity(now, s, c) == (0.0, 0.0)


@subroutine
def foothold(
    leg: int,
    now: Snapshot,
    s: Planner,
    c: Walk,
    nominal: Float[np.ndarray, "4 2"],
    remaining: float,
    goal: Float[np.ndarray, "3"],
) -> None:
    """Fill the touchdown point [m]: ``p_hip + v t + v T / 2 + k (v - v_ref) - (h / g) w x v_ref``.

    ``t`` is the ``remaining`` time [s] of the swing, in which the hip moves on, ``T`` the stance
    time. Besides with ``v``, that of the CoM, the hips move on circles about the base, by ``w t``
    and ``w T / 2``: along their tangents the feet of a turn at 6 rad/s went 5 cm outside of them in
    mid-swing. In a curve a trunk of height ``h`` needs the force ``m w x v_ref``, whose moment
    about the CoM the feet balance that much farther outside. The last three terms together are
    clipped to ``foothold_reach``, as is, on an easy way, where they leave the foot at the end of
    its stance.
    """
    ref_x, ref_y = world_velocity(s.trunk)
    rate, gain = s.trunk.velocity[2], c.config.velocity_feedback
    arm_x, arm_y = nominal[leg, 0] - now.q[0], nominal[leg, 1] - now.q[1]
    v_x, v_y, half = now.v_world_com[0], now.v_world_com[1], s.clock.duty * s.clock.period / 2
    cosine, sine = np.cos(rate * remaining), np.sin(rate * remaining)
    hip_x, hip_y = cosine * arm_x - sine * arm_y, sine * arm_x + cosine * arm_y
    cosine, sine = np.cos(rate * half), np.sin(rate * half)
    lean = rate * c.height / c.gravity
    x = cosine * hip_x - sine * hip_y - hip_x + v_x * half
    y = sine * hip_x + cosine * hip_y - hip_y + v_y * half
    x += gain * (v_x - ref_x) + lean * ref_y
    y += gain * (v_y - ref_y) - lean * ref_x
    ahead_x, ahead_y = speeding_up(s.trunk, remaining, 2.0 * half, c.height / c.gravity)
    x, y = x + ahead_x, y + ahead_y
    if is_easy(s):
        behind_x, behind_y = way_by(s.trunk, remaining + 2.0 * half)
        end_x, end_y = x - 2.0 * half * v_x - behind_x, y - 2.0 * half * v_y - behind_y
        share = min(1.0, c.config.foothold_reach / max(np.hypot(end_x, end_y), _TINY))
        x, y = x - (1.0 - share) * end_x, y - (1.0 - share) * end_y
    share = min(1.0, c.config.foothold_reach / max(np.hypot(x, y), _TINY))
    goal[0] = now.q[0] + hip_x + x * share + v_x * remaining
    goal[1] = now.q[1] + hip_y + y * share + v_y * remaining
    keep_apart(leg, now, s, c, remaining, goal)
    goal[2] = ground_at(s.ground, goal[0], goal[1]) + c.foot_radius


@subroutine
def keep_apart(
    leg: int,
    now: Snapshot,
    s: Planner,
    c: Walk,
    remaining: float,
    goal: Float[np.ndarray, "3"],
) -> None:
    """Move a touchdown point [m] so that the foot does not come down beyond its neighbour.

    The neighbours are the other foot of its side, ahead or behind, and that of its end, aside. One
    that still stands, or has just left, cannot swing through a leg that came down behind it: at
    each turn from 2 m/s ahead to 2 back, and from 1 m/s left to 1 right, legs hit each other (0.5 %
    of ticks; one run in 20 fell of it). While both are in the air each goes its share of a
    stride; they are nearest in the middle of that time. A robot that is thrown must cross its legs.
    """
    stands, elapsed, _ = foot_phase(s.clock, leg)
    if stands or not goes_as_told(now, s, c):
        return
    yaw = s.trunk.yaw + s.trunk.velocity[2] * remaining
    cosine, sine, (v_x, v_y) = np.cos(yaw), np.sin(yaw), world_velocity(s.trunk)
    for axis in range(2):
        other = leg ^ (2 if axis == 0 else 1)
        side = 1.0 if leg < other else -1.0
        n_x, n_y = (side * cosine, side * sine) if axis == 0 else (-side * sine, side * cosine)
        stands, since, left = foot_phase(s.clock, other)
        if not stands and since > left:
            continue
        p = now.p_world_feet[other] if stands else s.feet[other].swing.start
        both = remaining - left if stands else remaining + since
        gone, _, _ = cubic(min(max(0.5 * both / (elapsed + remaining), 0.0), 0.5))
        speed = abs(n_x * v_x + n_y * v_y)
        gap = LEAST_GAP - 2.0 * gone * speed * s.clock.period
        missing = max(gap - n_x * (goal[0] - p[0]) - n_y * (goal[1] - p[1]), 0.0)
        goal[0] += missing * n_x
        goal[1] += missing * n_y
