"""How late commands act, and where the robot will be when the next one does.

A command that is given now acts ``d`` control periods later. The measured torques of the motors are
those commanded ``d + 1`` ticks before, so ``d`` is the lag at which the two differ least:

    e_d' = (|tau - tau_asked[d]|^2 - e_d) / T,      d = argmin e_d

As long as torques hardly change all lags fit alike and the last one found stays: another must fit
better by a share of how much the torques themselves have changed. Motors that do not follow their
commands tell no lag.

For the commands that have not acted yet, the whole-body controller has also predicted the
accelerations. The state is propagated by them, v_i+1 = v_i + dt a_i, and the next torques are
computed for the robot as it will be then (Smith, Closer control of loops with dead time, 1957, with
the model of the QP for the plant). On the flat a trot on a friction of 0.3 or less fell within a
second with 10 ms, as one on 0.6 did with 20. Commands that act at once leave the state as it is,
bit by bit.

A foot that lands early or late is not predicted. The motors know their joints at once; beside its
torques a late command therefore carries a servo about the angles and speeds that are predicted for
the middle of the period in which it acts (as Kim et al., Highly dynamic quadruped locomotion via
whole-body impulse control and model predictive control, 2019), which adds nothing as long as all
goes as predicted:

    tau + kp (q + v dt / 2 - q_measured) + kd (v + a dt / 2 - v_measured)
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.linear import rotation_of
from go2_wbc.compilation import Foreign, kernel
from go2_wbc.records import Array18, Record
from go2_wbc.robot.state import JointCommand, RobotState, Snapshot
from go2_wbc.robot.state_filter import turn

LAGS = 11  #: Control periods by which a command may be late, none included: up to 20 ms at 500 Hz
MEMORY = 0.8
"""Time [s] over which misfits are averaged. Where commands act 0 to 18 ms late, drawn anew every 20
ms, the lag found with 0.2 s went from 4 to 14 ms and back, and 3 of 5 robots fell in reversals of 2
m/s; with this it stays in the middle, and none did."""
BETTER = 0.01  #: Share of the torques' own change by which another lag must fit better
READ = 1.0  #: Lag that is none of the commands: by so much readings may be old
WORST_FIT = 0.5
"""Share of that change up to which a lag may be off: motors that do not obey tell of none."""
LEAST_CHANGE = 1e-3  #: Mean square [N^2 m^2] of that change below which it says nothing

KP, KD = 20.0, 1.0
"""Gains [N m/rad, N m s/rad] of the servo of late commands. On its own sensors, 1 m/s, 0 to 18 ms
late, 32 of 40 robots crossed waves of 11 and 13 cm and stairs of 11 and 14, 16 with no servo; on
blocks and slopes as many. In 30 other runs 17 did (none: 8); with twice or half of either 12 to 16.
"""


class Lag(Record):
    """What is known of how late commands act."""

    tau_asked: Float[np.ndarray, "11 12"]  #: torques of the last commands [N m], the newest first
    qdd: Float[np.ndarray, "11 18"]  #: accelerations that they were to make [m/s^2, rad/s^2]
    known: float  #: how many of them there are without a break
    misfit: Float[np.ndarray, "11"]
    """Mean square [N^2 m^2] of what was measured less what was asked, of each lag."""
    change: float  #: the same of the torques asked for, from the first lag to the last
    ticks: float  #: the lag that fits, in control periods
    acted: float  #: the one that fits this tick alone, if commands are late


@kernel
def note_command(
    s: Lag, tau: Foreign[Float[np.ndarray, "12"]], qdd: Foreign[Float[np.ndarray, "18"]]
) -> None:
    """Remember what has just been asked for."""
    for d in range(LAGS - 1, 0, -1):
        s.tau_asked[d] = s.tau_asked[d - 1]
        s.qdd[d] = s.qdd[d - 1]
    for n in range(12):
        s.tau_asked[0, n] = tau[n]
    for n in range(18):
        s.qdd[0, n] = qdd[n]
    s.known = min(s.known + 1.0, LAGS)


@kernel
def observe_lag(s: Lag, tau: Foreign[Float[np.ndarray, "12"]], dt: float) -> None:
    """Compare the torques measured now with those that were asked for."""
    s.acted = s.ticks
    if s.known < LAGS:
        return
    share, change, least, nearest = min(dt / MEMORY, 1.0), 0.0, np.inf, 0
    for d in range(LAGS):
        square = 0.0
        for n in range(12):
            square += (tau[n] - s.tau_asked[d, n]) ** 2 / 12
            if d == LAGS - 1:
                change += (s.tau_asked[0, n] - s.tau_asked[d, n]) ** 2 / 12
        s.misfit[d] += share * (square - s.misfit[d])
        if square < least:
            least, nearest = square, d
    if s.ticks > READ:
        s.acted = nearest
    s.change += share * (change - s.change)
    best = 0
    for d in range(LAGS):
        if s.misfit[d] < s.misfit[best]:
            best = d
    gained = s.misfit[int(s.ticks)] - s.misfit[best]
    fits = s.misfit[best] < WORST_FIT * s.change
    if s.change > LEAST_CHANGE and fits and gained > BETTER * s.change:
        s.ticks = best


@kernel
def carry_on(s: Lag, dt: float, q: Float[np.ndarray, "19"], v: Float[np.ndarray, "18"]) -> None:
    """Bring a state to when the next command acts, by what those before it are to make."""
    R = np.empty((3, 3))
    for d in range(int(min(s.ticks, s.known)) - 1, -1, -1):
        v += 0.5 * dt * s.qdd[d]
        rotation_of(q[3], q[4], q[5], q[6], R)
        for i in range(3):
            q[i] += dt * (R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2])
        turn(q[3:7], (dt * v[3], dt * v[4], dt * v[5]), False)
        for n in range(12):
            q[7 + n] += dt * v[6 + n]
        v += 0.5 * dt * s.qdd[d]


@final
class Latency:
    """Finds out how late the commands act, and looks ahead by that."""

    def __init__(self, period: float) -> None:
        """Of commands that are given every ``period`` seconds; at first they act at once."""
        self._period, self._lag = period, Lag()

    @property
    def ticks(self) -> int:
        """Control periods after which a command acts, as far as it is known."""
        return int(self._lag.ticks)

    @property
    def delay(self) -> float:
        """Time [s] after which a command acts, as far as it is known."""
        return self.ticks * self._period

    @property
    def acted(self) -> int:
        """How many control periods before now that command was given which has just acted."""
        return int(self._lag.acted)

    def note(self, tau: Float[np.ndarray, "12"], qdd: Float[np.ndarray, "18"]) -> None:
        """The torques [N m] that have just been asked for, and what they are to make."""
        note_command(self._lag, tau, qdd)

    def with_servo(self, command: JointCommand, qdd: Array18, ahead: Snapshot) -> JointCommand:
        """The command just noted; a late one with the servo about what it makes of ``ahead``."""
        if not READ < self._lag.ticks < self._lag.known:  # else nothing was predicted
            return command
        half, v = 0.5 * self._period, ahead.v[6:]
        servo = JointCommand.servo(ahead.q[7:] + half * v, v + half * qdd[6:], KP, KD)
        return replace(servo, tau=command.tau)

    def forget(self) -> None:
        """Something else has been asked for, of which nothing is foretold."""
        self._lag.known = 0.0

    def ahead(self, state: RobotState) -> RobotState:
        """The state when the next command acts; ``state`` itself if that is now."""
        observe_lag(self._lag, state.tau, self._period)
        if not self._lag.ticks:
            return state
        q, v = state.q.copy(), state.v.copy()
        carry_on(self._lag, self._period, q, v)
        return replace(state, q=q, v=v)
