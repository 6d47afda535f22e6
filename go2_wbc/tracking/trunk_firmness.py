"""Holds the trunk to its plan against the dry friction of the joints.

With the feet fixed, every motion of the trunk moves the joints of all stance legs, each with its
friction. A task of the QP is an acceleration, so its stiffness is the moved inertia times the gain:
in roll, 0.07 kg m^2 times 200 /s^2, 15 N m/rad. Friction of 0.2 N m in each joint adds up to 1.2 N
m about that axis, and so holds the trunk up to 4.6 deg off; 1.0 deg in pitch, 1.7 in yaw. Half of
the friction is fed forward (``robot.motor``), by the speed of the joints, which is zero while the
trunk is stuck.

So the gains on the trunk are higher than in a walk, and the friction is learned. Along each axis of
the base, with the error e of position and attitude, and the planned speed v,

    a = .. + K e + D e',      c' = rate * s * e,      s = tanh(v / slow),      |c| <= limit

and ``c s`` is added to the target. This is adaptive compensation of Coulomb friction (Friedland &
Park, IEEE Trans. Automatic Control 37(10), 1992) with the sign of the planned speed instead of the
measured one: it reverses with the plan, before the robot is stuck, is zero at rest, and does not
excite a robot without friction, for which c becomes negative. The integral of ``planning.trunk``
has to unwind at every reversal instead, and is for constant disturbances.

In a stride, on two feet or just after, the gains are lower and nothing is learned. No joint gives a
moment about the line between two feet, so what is asked for against friction moves the CoM instead.
A trunk that rolled by 63 deg in 0.35 s lagged by 9 deg without these gains, by 5 with them.

Solved parts of a plan, jumps above all, keep their targets: a trunk that lands late is not held by
friction, and hops were 25 mm off with what they learned from it, instead of 15.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.compilation import subroutine
from go2_wbc.records import Array6
from go2_wbc.reference import Target
from go2_wbc.robot.state import Snapshot

STIFFNESS = (0.0, 0.0, 150.0, 1300.0, 300.0, 320.0)
DAMPING = (0.0, 0.0, 6.0, 50.0, 12.0, 15.0)
"""K [1/s^2] and D [1/s], beside the gains of the tasks: of ahead, left, up, roll, pitch, yaw. By
them friction of 0.2 N m leaves 0.6 deg of roll and less of the others; commands may be 12 ms late.
Ahead and aside a push is to move a robot that then steps as it did."""
IN_STRIDE = 0.25
"""Share of them in a stride. With what is learned a trot was twice as far beside its plan."""
LEARNING = 10.0  #: Rate [1/s]
SLOW_WAY, SLOW_TURN = 0.003, 0.01
"""Planned speed [m/s], [rad/s] from which on c counts; 1 deg in 1.2 s is 0.02 rad/s at most."""
MOST_WAY, MOST_TURN = 0.009, 0.03
"""Limit [m], [rad]: twice what 0.2 N m of every joint leaves."""


@subroutine
def hold_firmly(
    now: Snapshot,
    error: Array6,
    offset: Array6,
    dt: float,
    learned: Array6,
    target: Target,
    in_stride: bool,
) -> Array6:
    """Add K e + D e' to the target's accelerations; returns ``c s``, in the world.

    Args:
        now: what is measured.
        error: of place [m] and attitude [rad] from the target, in the world.
        offset: what else is added to the target, likewise.
        dt: since the last tick [s].
        learned: c, along the axes of the base, which is changed.
        target: what is asked for.
        in_stride: whether only two feet stand, or have stood just now.
    """
    R, lead, share = now.R_world_base, np.zeros(6), 1.0
    if in_stride:
        dt, share = 0.0, IN_STRIDE
    for n in range(6):
        i, first = n % 3, n - n % 3
        off, held, wanted, moving = 0.0, 0.0, 0.0, now.v[n]
        if n < 3 and target.is_com:
            moving = 0.0
        for k in range(3):
            off += R[k, i] * error[first + k]
            held += R[k, i] * offset[first + k]
            if n >= 3:
                wanted += R[k, i] * target.w_world[k]
            else:
                wanted += R[k, i] * target.v_world[k]
                if target.is_com:
                    moving += R[k, i] * now.v_world_com[k]
        sign = np.tanh(wanted / (SLOW_WAY if n < 3 else SLOW_TURN))
        most = MOST_WAY if n < 3 else MOST_TURN
        learned[n] = min(max(learned[n] + LEARNING * dt * sign * off, -most), most)
        ahead = 0.0 if in_stride else learned[n] * sign
        more = share * (STIFFNESS[n] * (off + held + ahead) + DAMPING[n] * (wanted - moving))
        for k in range(3):
            lead[first + k] += R[k, i] * ahead
            if n >= 3:
                target.dw_world[k] += R[k, i] * more
            else:
                target.a_world[k] += R[k, i] * more
    return lead
