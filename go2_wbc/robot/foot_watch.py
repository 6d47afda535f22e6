"""Which foot is held: in the air, by the plan, it stays elsewhere though its leg pushes it there.

It feels no ground meanwhile: what stumbles, on boxes or at the face of a step, is not held.

What holds it takes the leg's load later on: its sensor, taken for dead then, has a second to show
that it lives.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.records import Array4
from go2_wbc.robot.state import PartFault, RobotState

PULLED, LASTS, IMPULSE = 10.0, 0.024, 0.4
"""Force [N] that holds a foot, for how long [s], and what it adds up to [N s]: sound feet at the
face of a step, among boxes and under pushes of 90 N s strike for 14 ms at most."""
UNFELT, GRIP = 10.0, 2.0
"""Force [N] below which a foot touches nothing: what stumbles is not held. By the latter times what
it feels it must be held by more: a paw that was being unloaded, on a robot with much friction in
its joints, was dragged towards its place by 13 N while the ground still pressed with 9."""
UPRIGHT, CARRIED = 0.3, 0.5
"""Tilt [rad] from which on, and share of its weight on its feet below which, a robot tumbles: its
legs strike each other. With a foot held, the others bear 0.65 at least."""
SUNK = 0.05
"""Depth [m] of the trunk below where it shall be from which on the feet stay behind with it: one
that was on a knee lay 0.12 too low, and its raised foot hung below its place, held by nothing. With
a foot held the trunk is 0.01 too low at most."""

EXCUSED = 1.0
"""Time [s] after it was held, be it for half of ``LASTS``, in which a foot's sensor may
contradict the leg: it is held for 0.3 s, and its sensor is found sound 0.1 s into the stance after
that."""


class FootWatch:
    """Judges the feet of one robot.

    Attributes:
        faults: feet that were held, in the order in which it was noticed.
    """

    def __init__(self, weight: float) -> None:
        """Nothing is held of a robot of this weight [N]."""
        self._carried = CARRIED * weight
        self.faults: tuple[PartFault, ...] = ()
        self._time, self._impulse, self._last = np.zeros(4), np.zeros(4), -np.inf
        self._held_at = np.full(4, -np.inf)

    def update(self, held: Array4, state: RobotState, sag: float, dt: float) -> None:
        """Take in the force [N] that holds each foot: see ``reference.hold_feet``.

        ``sag`` [m]: of the trunk below where it shall be. Ticks in which none is held may be left
        out.
        """
        forces = state.foot_forces
        stands = state.tilt < UPRIGHT and sag < SUNK and forces.sum() > self._carried
        is_held = (held > PULLED + GRIP * forces) & (forces < UNFELT) & stands
        goes_on = is_held & (state.time - self._last < 1.5 * dt)
        self._last = state.time
        self._time = np.where(is_held, self._time * goes_on + dt, 0.0)
        self._impulse = np.where(is_held, self._impulse * goes_on + held * dt, 0.0)
        self._held_at[self._time > 0.5 * LASTS] = state.time
        for leg in np.flatnonzero((self._time > LASTS) & (self._impulse > IMPULSE)):
            if all(fault.part != FOOT_NAMES[leg] for fault in self.faults):
                self.faults += (PartFault(FOOT_NAMES[leg], "was held", True, state.time),)

    def excuses(self, fault: PartFault, time: float) -> bool:
        """Whether a sensor's fault may be, at this time [s], that its foot has just been held."""
        if fault.part not in FOOT_NAMES:
            return False
        held_at = self._held_at[FOOT_NAMES.index(fault.part)]
        return bool(held_at < fault.since and time < held_at + EXCUSED)
