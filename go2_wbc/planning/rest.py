"""How a walk comes to rest: when it may stop stepping, on which feet, where the trunk goes then.

A step helps as long as it brings the feet nearer to below their hips. On some robots it does not:
with other joint friction, high damping or late commands the same two feet land 20 to 28 mm beside
their footholds again and again, and a robot that waits for a square stance steps for ever. So after
a few landings without a command any stance is accepted that holds the robot:

- its feet are within reach of their hips, and with them the joints within their limits;
- the capture point (Pratt et al., Capture Point, Humanoids 2006), ``p + v / omega`` with
  ``omega = sqrt(g / h)``, lies well inside the support polygon: there the robot comes to rest over
  it.

At first the trunk's target is where it comes to rest by itself. The reference may be elsewhere, by
the leash at most, and is approached slowly, as far as the feet allow: followed at once it made a
robot that had just reported to rest move at 40 mm/s. The target stays fixed relative to the stance
feet: the estimator, which learns 0.3 s after the last step that the robot rests, may move it by 9
mm.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.compilation import kernel, subroutine
from go2_wbc.contacts import TIE
from go2_wbc.planning.footholds import nominal_feet
from go2_wbc.planning.gait_clock import foot_phase, restart
from go2_wbc.planning.trunk import follow_position, is_settled
from go2_wbc.planning.walk import Planner, Walk
from go2_wbc.robot.state import Snapshot

PATIENCE = 4
"""Landings without a command that may bring the feet below their hips; each takes 0.18 s."""
REST_REACH = 0.08
"""Distance [m] of a foot from below its hip within which a stance is held. Legs bear 0.22."""
REST_MARGIN = 0.05
"""Distance [m] of the capture point inside the feet's polygon; amid square feet it is 0.14."""
SHIFT = 0.02  #: Distance [m] from the feet's middle within which the trunk comes to rest
SHIFT_SPEED = 0.01  #: Speed [m/s] at which it goes there
_AROUND = (0, 2, 3, 1)  #: The legs counter-clockwise: FL, RL, RR, FR


@kernel
def worst_foot(now: Snapshot, s: Planner, c: Walk) -> float:
    """Greatest distance [m] of a foot from the nominal rectangle, which may be off: the body moves.

    With the rectangle is meant the one whose middle is that of the feet.
    """
    offsets, mean, worst = np.empty((4, 2)), np.zeros(2), 0.0
    nominal_feet(now, s, c, c.cadence.rest.width, offsets)
    for leg in range(4):
        for i in range(2):
            offsets[leg, i] = now.p_world_feet[leg, i] - offsets[leg, i]
            mean[i] += offsets[leg, i] / 4
    for leg in range(4):
        worst = max(worst, np.hypot(offsets[leg, 0] - mean[0], offsets[leg, 1] - mean[1]))
    return worst


@kernel
def is_square(now: Snapshot, s: Planner, c: Walk) -> bool:
    """Whether the feet form the nominal rectangle; their mean may be off."""
    return worst_foot(now, s, c) < c.config.square_tolerance


@subroutine
def capture_point(now: Snapshot, c: Walk) -> tuple[float, float]:
    """The place [m] ``p + v / sqrt(g / h)`` on the level."""
    time = np.sqrt(c.height / c.gravity)
    p, v = now.p_world_com, now.v_world_com
    return p[0] + time * v[0], p[1] + time * v[1]


@subroutine
def middle_of(now: Snapshot, i: int) -> float:
    """Mean of the feet along an axis of the world [m]."""
    p = now.p_world_feet
    return (p[0, i] + p[1, i] + p[2, i] + p[3, i]) / 4


@subroutine
def must_step(now: Snapshot, c: Walk) -> bool:
    """Whether the capture point is too far from the feet's middle."""
    x, y = capture_point(now, c)
    return np.hypot(x - middle_of(now, 0), y - middle_of(now, 1)) > c.config.capture_margin


@kernel
def capture_inside(now: Snapshot, c: Walk) -> float:
    """Distance [m] of the capture point inside the polygon of the feet; negative outside."""
    x, y = capture_point(now, c)
    least = np.inf
    for k in range(4):
        here, there = now.p_world_feet[_AROUND[k]], now.p_world_feet[_AROUND[(k + 1) % 4]]
        way_x, way_y = there[0] - here[0], there[1] - here[1]
        area = way_x * (y - here[1]) - way_y * (x - here[0])
        least = min(least, area / max(np.hypot(way_x, way_y), TIE))
    return least


@subroutine
def is_held(now: Snapshot, s: Planner, c: Walk) -> bool:
    """Whether the robot comes to rest on its feet as they stand."""
    return worst_foot(now, s, c) < REST_REACH and capture_inside(now, c) > REST_MARGIN


@subroutine
def is_landing(s: Planner) -> bool:
    """Whether feet touch down at this tick and no other one is in the air."""
    has_landed = False
    for leg in range(4):
        stance, _, _ = foot_phase(s.clock, leg)
        was_stance = s.feet[leg].contact.was_stance
        if not (stance or was_stance):
            return False
        if stance and not was_stance:
            has_landed = True
    return has_landed


@subroutine
def may_rest(now: Snapshot, s: Planner, c: Walk) -> bool:
    """Whether a robot without a command may stop stepping at this tick; counts its landings."""
    if not is_settled(s.trunk):
        s.rest.landings = 0.0
        return False
    if not is_landing(s):
        return False
    s.rest.landings += 1.0
    if s.rest.landings > PATIENCE:
        return is_held(now, s, c)
    slow = np.hypot(now.v_world_com[0], now.v_world_com[1]) < c.config.settle_speed
    return slow and is_square(now, s, c)


@subroutine
def come_to_rest(now: Snapshot, s: Planner, c: Walk) -> None:
    """Stop stepping; the trunk is wanted where it comes to rest by itself, and then near before."""
    s.is_stepping = False
    middle = s.rest.middle
    for i in range(3):
        middle[i] = middle_of(now, i)
    x, y = s.trunk.position[0] - middle[0], s.trunk.position[1] - middle[1]
    share = min(1.0, SHIFT / max(np.hypot(x, y), SHIFT))
    s.rest.place[0], s.rest.place[1] = middle[0] + share * x, middle[1] + share * y
    s.trunk.position[0], s.trunk.position[1] = capture_point(now, c)


@subroutine
def rest_in_place(now: Snapshot, s: Planner, leash: float, dt: float) -> None:
    """Bring the reference of a resting robot nearer to its place; whoever moves it takes both."""
    stay_with_feet(now, s)
    position, place = s.trunk.position, s.rest.place
    x, y = place[0] - position[0], place[1] - position[1]
    share = min(1.0, SHIFT_SPEED * dt / max(np.hypot(x, y), TIE))
    position[0] += share * x
    position[1] += share * y
    x, y = position[0], position[1]
    follow_position(s.trunk, now, leash, dt)
    place[0] += position[0] - x
    place[1] += position[1] - y


@subroutine
def stay_with_feet(now: Snapshot, s: Planner) -> None:
    """Carry what is known of the ground, and where the trunk is wanted, along with the feet.

    They do not move, but where they are taken to be may.
    """
    moved = np.empty(3)
    for i in range(3):
        middle = middle_of(now, i)
        moved[i] = middle - s.rest.middle[i]
        s.rest.middle[i] = middle
    for i in range(2):
        s.trunk.position[i] += moved[i]
        s.rest.place[i] += moved[i]
    s.ground.height += moved[2]
    for leg in range(4):
        for i in range(3):
            s.ground.p_met[leg, i] += moved[i]


@subroutine
def start_stepping(s: Planner, c: Walk) -> None:
    """Begin the first stride."""
    s.is_stepping = True
    s.rest.landings = 0.0
    restart(s.clock, c.cadence)


def why_not_resting(now: Snapshot, s: Planner, c: Walk) -> str:
    """Why a robot without a command does not rest yet, in plain words; "" if it does."""
    if not s.is_stepping:
        return ""
    if not is_settled(s.trunk):
        return "it still slows down"
    worst, inside = worst_foot(now, s, c), capture_inside(now, c)
    if worst >= REST_REACH:
        return f"a foot is {1000 * worst:.0f} mm beside its place (at most {1000 * REST_REACH:.0f})"
    if inside <= REST_MARGIN:
        told = f"{1000 * inside:.0f} mm inside the feet (at least {1000 * REST_MARGIN:.0f})"
        return f"it would come to rest {told}"
    return "its next feet have not landed"
