"""Which motor is broken: what it was asked for against what it gave.

Over the last fraction of a second, the share that a motor gives is the least squares' slope

    share = sum (asked given) / sum asked^2

It is judged while enough is asked, and what is asked stays within what the motor can give.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import Foreign, kernel
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.records import Record, packed
from go2_wbc.robot.motor import MotorModel, torque_range
from go2_wbc.robot.state import JointCommand, PartFault, RobotState

SETTLING = 0.1
"""Time constant [s] of the sums."""
ASKED = 3.0
"""Root mean square [N m] of what is asked, from which on a motor is judged."""
WEAK, DEAD = 0.62, 0.2
"""Share below which it is broken, and below which it is dead."""
LASTS = 0.06
"""For how long [s]; a command that acts late lowers the share, as a leg strikes the ground."""


class WatchedMotors(Record):
    """What is remembered from tick to tick.

    Attributes:
        both, asked: the sums of the slope [N^2 m^2].
        weak_time: for how long the share has been too low [s].
    """

    both: Float[np.ndarray, "12"]
    asked: Float[np.ndarray, "12"]
    weak_time: Float[np.ndarray, "12"]


@kernel
def watch_motors(
    s: WatchedMotors,
    tau: Foreign[Float[np.ndarray, "12"]],
    kp: Foreign[Float[np.ndarray, "12"]],
    kd: Foreign[Float[np.ndarray, "12"]],
    q_des: Foreign[Float[np.ndarray, "12"]],
    v_des: Foreign[Float[np.ndarray, "12"]],
    q: Foreign[Float[np.ndarray, "19"]],
    v: Foreign[Float[np.ndarray, "18"]],
    given: Foreign[Float[np.ndarray, "12"]],
    motor: MotorModel,
    dt: float,
) -> int:
    """Take in a tick; returns the first joint whose motor is broken, or -1.

    The first five are the command's; given [N m] is what was measured.
    """
    keep, found = np.exp(-dt / SETTLING), -1
    for j in range(12):
        asked = tau[j] + kp[j] * (q_des[j] - q[7 + j]) + kd[j] * (v_des[j] - v[6 + j])
        least, most = torque_range(motor, j, float(v[6 + j]))
        asked = min(max(asked, least), most)
        s.both[j] = keep * s.both[j] + (1.0 - keep) * asked * given[j]
        s.asked[j] = keep * s.asked[j] + (1.0 - keep) * asked * asked
        is_weak = s.asked[j] > ASKED * ASKED and s.both[j] < WEAK * s.asked[j]
        s.weak_time[j] = s.weak_time[j] + dt if is_weak else 0.0
        if s.weak_time[j] > LASTS and found < 0:
            found = j
    return found


class MotorWatch:
    """Judges the motors of one robot.

    Attributes:
        faults: what is broken, in the order in which it was noticed.
    """

    def __init__(self, motor: MotorModel) -> None:
        """Watch motors of this kind."""
        self._motor = packed(motor)
        self.faults: tuple[PartFault, ...] = ()
        self.restart()

    def restart(self) -> None:
        """Forget what was asked; what is broken stays so."""
        self._state = WatchedMotors()

    def update(self, command: JointCommand, state: RobotState, dt: float) -> None:
        """Take in what was asked in the tick that ended with ``state``."""
        asked = command.tau, command.kp, command.kd, command.q_des, command.v_des
        measured = state.q, state.v, state.tau
        joint = watch_motors(self._state, *asked, *measured, self._motor, dt)
        if joint < 0:
            return
        name = JOINT_NAMES[joint]
        share = float(self._state.both[joint] / self._state.asked[joint])
        self._state.weak_time[joint] = 0.0
        if all(fault.part != f"motor of {name}" for fault in self.faults):
            is_dead = share < DEAD
            what = "is dead" if is_dead else f"gives {100.0 * share:.0f} % of what is asked"
            fault = PartFault(f"motor of {name}", what, not is_dead, state.time)
            self.faults += (fault,)
