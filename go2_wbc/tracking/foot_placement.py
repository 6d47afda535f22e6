"""Where the feet of a trot come down while the CoM is off its plan, and how firmly they are led.

Two feet give no moment about the line between them. Across it the CoM is an inverted pendulum, and
its error e grows by itself; what it comes to is told by the error of the divergent component of
motion, e + v / omega (Takenaka, Matsumoto & Yoshiike, *Real time motion generation and control for
biped robot*, IROS 2009). Feet that land aside by that stand below the CoM again as it was planned.
The two lines of a trot are both nearer to the way ahead than to the way aside, so that without
this a trot has next to no stiffness aside: the friction of a rolling trunk's joints took it 46 mm.

The same friction holds the feet off their way, up to 19 mm at the touchdown where the trunk yaws
fast. Their gains are therefore raised to those of legs that follow joints, which leaves 12.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.records import Array6
from go2_wbc.reference import STANCE, SWING, Target
from go2_wbc.robot.state import Snapshot

FALLING = 0.17
"""Time constant 1 / omega [s] of the pendulum: sqrt(z / g) of a CoM at 0.29 m, as a Go2's is. At
0.25 it is 0.16, at 0.35 0.19."""
MOST_ASIDE = 0.008
"""Distance [m] by which feet are placed aside at most: half of what an author notices of a foot
that has landed. While they stand, for 0.2 s, it moves the CoM by three quarters of that."""
STIFFNESS, DAMPING = 400.0, 14.0
"""What is added to the gains of swinging feet [1/s^2], [1/s]: to those of ``WbcConfig.swing_foot``
by default it gives those of ``WbcConfig.leg_posture``."""


@subroutine
def swinging_pair(target: Target) -> tuple[int, int]:
    """The two feet that swing while the two others stand; -1 and -1 if it is not so."""
    first, second, standing = -1, -1, 0
    for leg in range(4):
        if target.legs[leg] == STANCE:
            standing += 1
        elif target.legs[leg] == SWING:
            first, second = second, leg
    return (first, second) if standing == 2 and first >= 0 else (-1, -1)


@subroutine
def place_feet(now: Snapshot, error: Array6, target: Target) -> None:
    """Move the goals of two swinging feet across the line between them, if two others stand.

    And hold them to their way. Solved parts of a plan, whose forces and feedback are their own,
    keep their footholds.

    ``error``: from the measured place of the tracked point to that of the target [m], and more.
    """
    first, second = swinging_pair(target)
    if first < 0 or not target.is_com or target.force_weight != 0.0:
        return
    p, v, v_plan = target.p_world_feet, now.v_world_com, target.v_world
    x, y = p[second, 0] - p[first, 0], p[second, 1] - p[first, 1]
    length = max(np.hypot(x, y), TIE)
    x, y = -y / length, x / length  # from along the line to across it
    off_x = FALLING * (v[0] - v_plan[0]) - error[0]
    off_y = FALLING * (v[1] - v_plan[1]) - error[1]
    aside = min(max(x * off_x + y * off_y, -MOST_ASIDE), MOST_ASIDE)
    for leg in (first, second):
        p[leg, 0] += aside * x
        p[leg, 1] += aside * y
        for i in range(3):
            late = target.v_world_feet[leg, i] - now.v_world_feet[leg, i]
            off = p[leg, i] - now.p_world_feet[leg, i]
            target.a_world_feet[leg, i] += STIFFNESS * off + DAMPING * late
