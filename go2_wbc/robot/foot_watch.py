"""Which foot is held: in the air, by the plan, it stays elsewhere, and feels no ground.

What holds it takes the leg's load later on: its sensor may then be taken for dead, too.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.records import Array4, Array12
from go2_wbc.robot.state import PartFault, RobotState

ASTRAY, LASTS = 0.05, 0.02
"""Distance [m] from where a foot shall be by which it does not follow, and for how long [s].
In 78 minutes of random calls over 19 worlds, half of them pushed, 9 sound feet did not follow: at
the face of a step, on boxes, or after a push."""
UNFELT = 10.0
"""Force [N] below which a foot touches nothing: what stumbles is not held."""
UPRIGHT = 0.3
"""Tilt [rad] from which on a robot has more to do than to follow."""
ASKED, GIVEN = 2.0, 0.3
"""Torque [N m] from which on a motor that gives less than this share is why a foot stays."""


class FootWatch:
    """Judges the feet of one robot.

    Attributes:
        faults: feet that were held, in the order in which it was noticed.
    """

    def __init__(self) -> None:
        """Nothing is held."""
        self.faults: tuple[PartFault, ...] = ()
        self._time, self._last = np.zeros(4), -np.inf

    def update(self, astray: Array4, asked: Array12, state: RobotState, dt: float) -> None:
        """Take in how far each foot is astray [m]: see ``reference.feet_astray``.

        ``asked``: of the motors [N m]. Ticks in which no foot is may be left out.
        """
        is_weak = (np.abs(asked) > ASKED) & (np.abs(state.tau) < GIVEN * np.abs(asked))
        follows = (astray < ASTRAY) | (state.foot_forces > UNFELT) | is_weak.reshape(4, 3).any(1)
        is_new = state.time - self._last > 1.5 * dt
        self._last = state.time
        self._time = np.where(follows | (state.tilt > UPRIGHT) | is_new, 0.0, self._time + dt)
        for leg in np.flatnonzero(self._time > LASTS):
            if all(fault.part != FOOT_NAMES[leg] for fault in self.faults):
                self.faults += (PartFault(FOOT_NAMES[leg], "was held", True, state.time),)
