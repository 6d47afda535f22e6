"""Which motor is broken: commanded against measured torque.

Over the last fraction of a second, the share that a motor gives is

    share^2 = sum given^2 / sum asked^2

which late commands do not lower. It is judged while the commanded torque is large enough, and
within what the motor can give.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.compilation import Foreign, kernel
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.records import Array12, Array18, Array19, Record, packed
from go2_wbc.robot.motor import MotorModel, torque_range
from go2_wbc.robot.state import JointCommand, PartFault, RobotState

SETTLING = 0.1  #: Time constant [s] of the sums
ASKED = 0.06  #: Root mean square [N m] of what is asked, from which on a motor is judged
NOISY_SPEED, SPEED_SHARE = 1.0, 0.1
"""Error of a joint's speed [rad/s], and share of it by which it errs besides: it is read with
noise, and changes within a tick if the robot is flung. Times the damping gain it is torque that
seems to be asked for: of half of it sound motors were named in `recover`."""
WEAK, DEAD = 0.65, 0.25  #: Share below which it is broken, and below which, since then, it is dead
LASTS = 0.12  #: For how long [s]: of sound motors, in the worlds of the tables, 0.02 at most


class WatchedMotors(Record):
    """What is remembered from tick to tick."""

    given: Array12  #: the sum of what was given [N^2 m^2]
    asked: Array12  #: the sum of what was asked [N^2 m^2]
    weak_time: Array12  #: for how long the share has been too low [s]
    weak_given: Array12  #: ``given`` over that time [N^2 m^2]
    weak_asked: Array12  #: ``asked`` over that time [N^2 m^2]


@kernel
def watch_motors(
    s: WatchedMotors,
    tau: Foreign[Array12],
    kp: Foreign[Array12],
    kd: Foreign[Array12],
    q_des: Foreign[Array12],
    v_des: Foreign[Array12],
    q: Foreign[Array19],
    v: Foreign[Array18],
    given: Foreign[Array12],
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
        s.given[j] = keep * s.given[j] + (1.0 - keep) * given[j] * given[j]
        s.asked[j] = keep * s.asked[j] + (1.0 - keep) * asked * asked
        least_asked = ASKED + kd[j] * (NOISY_SPEED + SPEED_SHARE * abs(v[6 + j]))
        is_weak = s.asked[j] > least_asked * least_asked and s.given[j] < WEAK * WEAK * s.asked[j]
        since = 1.0 if is_weak else 0.0
        s.weak_time[j] = since * (s.weak_time[j] + dt)
        s.weak_given[j] = since * (s.weak_given[j] + given[j] * given[j])
        s.weak_asked[j] = since * (s.weak_asked[j] + asked * asked)
        if s.weak_time[j] > LASTS and found < 0:
            found = j
    return found


class MotorWatch:
    """Judges the motors of one robot.

    Attributes:
        faults: what is broken, in the order in which it was noticed.
    """

    def __init__(self, motor: MotorModel) -> None:
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
        asked_since = max(float(self._state.weak_asked[joint]), ASKED**2)
        share = float(np.sqrt(self._state.weak_given[joint] / asked_since))
        self._state.weak_time[joint] = 0.0
        if all(fault.part != f"motor of {name}" for fault in self.faults):
            is_dead = share < DEAD
            what = "is dead" if is_dead else f"gives {100.0 * share:.0f} % of what is asked"
            fault = PartFault(f"motor of {name}", what, not is_dead, state.time)
            self.faults += (fault,)
