"""Telemetry: every tick recorded in a ring, and peaks over the whole run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import CommandError
from go2_wbc.geometry import moving_support_margins
from go2_wbc.recording import Recording
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot


class Telemetry:
    """Records ticks; the oldest are dropped when the ring is full.

    Attributes:
        qp_failures: ticks in which the QP had no solution, over the whole run.
        relaxed_ticks: ticks in which constraints of the QP had to give way.
        grave_ticks: those of them in which they gave way by more than ``wbc.relaxation.LIMITS``.
        missed_deadlines: ticks that were not done when the next was due, at the wall clock's pace.
    """

    def __init__(self, model: RobotModel, capacity: int) -> None:
        """Args: capacity: number of ticks that the ring holds."""
        self._model = model
        self._capacity = capacity
        self._time = np.empty(capacity)
        self._q, self._v = np.empty((capacity, 19)), np.empty((capacity, 18))
        self._tau, self._forces = np.empty((capacity, 12)), np.empty((capacity, 4))
        self._stance = np.empty((capacity, 4), dtype=bool)
        self._com, self._feet = np.empty((capacity, 3)), np.empty((capacity, 4, 3))
        self._labels = np.empty(capacity, dtype=object)
        self._count = 0
        self._peak_torque, self._peak_speed = np.zeros(12), np.zeros(12)
        self.qp_failures = self.relaxed_ticks = self.grave_ticks = self.missed_deadlines = 0

    def record(self, snapshot: Snapshot, stance: Bool[np.ndarray, "4"], label: str) -> None:
        """Add one tick."""
        i = self._count % self._capacity
        state = snapshot.state
        self._time[i], self._q[i], self._v[i] = state.time, state.q, state.v
        self._tau[i], self._forces[i] = state.tau, state.foot_forces
        self._stance[i], self._labels[i] = stance, label
        self._com[i], self._feet[i] = snapshot.p_world_com, snapshot.p_world_feet
        self._count += 1
        np.maximum(self._peak_torque, np.abs(state.tau), out=self._peak_torque)
        np.maximum(self._peak_speed, np.abs(state.v[6:]), out=self._peak_speed)

    @property
    def peak_torque_ratio(self) -> float:
        """Greatest |tau| / limit of any joint so far."""
        return float(np.max(self._peak_torque / self._model.torque_limits))

    @property
    def peak_speed_ratio(self) -> float:
        """Greatest |joint velocity| / limit of any joint so far."""
        return float(np.max(self._peak_speed / self._model.speed_limits))

    def samples(self, rate: float = 100.0, since: float = -math.inf) -> Samples:
        """What the ring holds from ``since`` [s] on, thinned to about ``rate`` samples a second.

        Raises:
            CommandError: if ``rate`` is not a positive number.
        """
        if not rate > 0.0:
            raise CommandError(f"rate must be positive, got {rate}")
        order = np.arange(max(0, self._count - self._capacity), self._count)
        rows = order % self._capacity
        rows = rows[np.searchsorted(self._time[rows], since) :]
        if len(rows) > 1:
            span = float(self._time[rows[-1]] - self._time[rows[0]])
            rows = rows[:: max(1, round((len(rows) - 1) / max(rate * span, 1.0)))]
        labels = tuple(str(label) for label in self._labels[rows])
        recording = Recording(
            time=self._time[rows].copy(),
            q=self._q[rows],
            v=self._v[rows],
            tau=self._tau[rows],
            foot_forces=self._forces[rows],
            stance=self._stance[rows],
            p_world_com=self._com[rows],
            support_margin=np.full(len(rows), np.nan),
            labels=labels,
        )
        return Samples(recording, self._feet[rows])


@dataclass(frozen=True, slots=True)
class Samples:
    """Copied ticks whose support margins are still to be computed, away from the control loop.

    Attributes:
        unfinished: the recording, its support margins nan.
        p_world_feet: (n, 4, 3) foot centres [m].
    """

    unfinished: Recording
    p_world_feet: Float[np.ndarray, "n 4 3"]

    def recording(self) -> Recording:
        """The finished recording."""
        stance, p_com = self.unfinished.stance, self.unfinished.p_world_com[:, :2]
        margins = np.full(len(stance), np.nan)
        for feet in (mode for mode in np.unique(stance, axis=0) if mode.sum() >= 3):
            rows = (stance == feet).all(axis=1)
            p_feet = self.p_world_feet[rows][:, feet, :2]
            margins[rows] = moving_support_margins(p_feet, p_com[rows])
        return replace(self.unfinished, support_margin=margins)
