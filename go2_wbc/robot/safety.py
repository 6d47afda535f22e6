"""Safety: says whether the measured state still allows the controller to go on.

A state is none if a number is not finite or its quaternion is not of length 1. With z of the
highest numbers that tell of a fall, of a robot that is to balance:

    height = z_base - min z_feet                          low where the legs have given way
    clearance = z_base + min (R p)_z - min z_feet + r     over the underside's points p: it touches
    sag, lean                                             see ``reference.sag_and_lean``
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.compilation import Foreign, kernel
from go2_wbc.records import Array4, Array12, Array18, Array19, ArrayNx3
from go2_wbc.robot.description import RobotProfile, find_profile
from go2_wbc.robot.state import Snapshot
from go2_wbc.validation import POSITIVE, ranged

TOUCH = 0.01  #: Height [m] of the trunk's lowest point over the ground below which it touches
ASTRAY_TOUCH = 0.025
"""The same [m] for a trunk that is not where it shall be: feet press into the ground in a fall, and
an attitude that is off by a degree puts the nose off by 5 mm."""
STRIKE = 0.05
"""Time [s] of a touch from which on it counts until the trunk is back. With 0.03 two of sixteen
trots counted as fallen that a push of 50 N s ahead let touch the ground, and that trotted on."""

UNIT_TOLERANCE = 0.01  #: How far the norm of a measured quaternion may be from 1


@kernel
def is_plausible(
    q: Foreign[Array19], v: Foreign[Array18], tau: Foreign[Array12], forces: Foreign[Array4]
) -> bool:
    """Whether every number of a state is finite and the quaternion of ``q`` of length 1."""
    for values in (q, v, tau, forces):
        for value in values:
            if not np.isfinite(value):
                return False
    length = np.sqrt(q[3] ** 2 + q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
    return bool(abs(length - 1.0) < UNIT_TOLERANCE)


@kernel
def heights(now: Snapshot, underside: ArrayNx3) -> tuple[float, float]:
    """Heights [m] of the base over the lowest foot's centre, and of the trunk over the ground."""
    lowest, height = np.inf, now.q[2]
    for leg in range(4):
        lowest = min(lowest, now.p_world_feet[leg, 2])
    clearance = np.inf
    for point in range(underside.shape[0]):
        z = 0.0
        for i in range(3):
            z += now.R_world_base[2, i] * underside[point, i]
        clearance = min(clearance, z)
    return height - lowest, height + clearance - lowest + now.foot_radius


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class SafetyConfig:
    """When to give up and go limp."""

    tilt_limit: float = 1.05
    """Tilt [rad] of the trunk beyond which a balancing robot counts as fallen, also where a motion
    wants it; rearing by 59 deg is done."""
    astray_tilt_limit: float = 1.0
    """The same for a robot that leans by half of ``lean_limit`` or more from its reference, or that
    may lie. After a push a robot may be at 60 deg for a moment only, and its sensors off by a
    degree."""
    height_limit: float = 0.075
    """Height [m] of the base over the centre of the lowest foot below which a balancing robot
    counts as collapsed; on its belly it is 0.063."""
    touch_limit: float = 0.1
    """Time [s] for which the trunk of a balancing robot may touch the ground, or bounce off it,
    while it has sunk by more than half of ``sink_limit`` or leans by more than half of
    ``lean_limit``, except for a graze; hardly any robot that withstood a push in simulation did."""
    sink_limit: float = 0.12
    """Depth [m] of the trunk below its reference beyond which it has sunk; in simulation 0.01 at
    most in every motion, 0.07 with a payload of 8 kg."""
    sink_limit_time: float = 0.3
    """Time [s] for which it may; after pushes that a trot withstood 0.16 at most."""
    lean_limit: float = 0.52
    """Angle [rad] between the trunk's attitude and its reference, without heading, beyond which it
    leans; in simulation 0.10 at most in every motion, 0.16 after pushes that the robot withstood,
    1.0 at rest on a limb."""
    lean_limit_time: float = 0.3  #: time [s] for which it may
    stale_limit: float = 0.03
    """Time [s] without news from the plant after which it counts as silent."""
    qp_patience: int = 10  #: QP failures in a row after which the robot is damped for good
    grave_limit_time: float = 0.1
    """Time [s] for which constraints may be violated by more than ``wbc.solvers.LIMITS`` before the
    robot is damped for good; after pushes that a trot withstood 0.036 at most (a hip at its
    stop)."""

    __repr__ = brief

    def greatest_tilt(self, *, is_astray: bool) -> float:
        """Tilt [rad] beyond which a robot has fallen: of two limits the lower one, if astray."""
        return min(self.tilt_limit, self.astray_tilt_limit) if is_astray else self.tilt_limit


class FallDetector:
    """Says whether a robot that balances has fallen; asked once per tick."""

    def __init__(self, config: SafetyConfig, profile: RobotProfile | None = None) -> None:
        """Judge a robot, a Go2 if no ``profile`` is given, by ``config``."""
        self._config = config
        self._underside = (profile or find_profile()).underside_points
        self.begin()

    def begin(self) -> None:
        """Forget what was measured: another behaviour begins."""
        self._since: dict[str, float] = {}
        self._has_struck = False

    def reason(self, snapshot: Snapshot, sag: float, lean: float, *, may_lie: bool) -> str | None:
        """Why the robot counts as fallen, or None.

        Args:
            sag: depth [m] of the trunk below where it shall be.
            lean: angle [rad] between the trunk's attitude and the wanted one, heading left out.
            may_lie: whether the belly may be on the ground.
        """
        state, config = snapshot.state, self._config
        height, clearance = heights(snapshot, self._underside)
        has_sunk = not may_lie and sag > config.sink_limit
        is_aslant = lean > config.lean_limit / 2
        is_off = sag > config.sink_limit / 2 or is_aslant
        is_touching = not may_lie and clearance < (ASTRAY_TOUCH if is_off else TOUCH)
        is_bouncing = self._has_struck and is_off and not may_lie
        strikes = self._lasts("strike", STRIKE, state.time, holds=is_touching)
        self._has_struck = strikes or is_bouncing
        is_touching |= is_bouncing
        leans = lean > config.lean_limit
        what = None
        if state.tilt > config.greatest_tilt(is_astray=may_lie or is_aslant):
            roll, pitch, _ = (round(angle) for angle in np.degrees(state.rpy).tolist())
            what = f"roll {roll} deg, pitch {pitch} deg"
        elif not may_lie and height < config.height_limit:
            what = f"base {100 * height:.0f} cm above the feet"
        elif self._lasts("touch", config.touch_limit, state.time, holds=is_touching):
            what = f"trunk on the ground, base {100 * height:.0f} cm above the feet"
        elif self._lasts("sink", config.sink_limit_time, state.time, holds=has_sunk):
            what = f"trunk {100 * sag:.0f} cm below where it should be"
        elif self._lasts("lean", config.lean_limit_time, state.time, holds=leans):
            what = f"trunk tilted {np.degrees(lean):.0f} deg from where it should be"
        return None if what is None else f"fell at t={state.time:.2f} s: {what}"

    def _lasts(self, what: str, limit: float, now: float, *, holds: bool) -> bool:
        """Whether ``what`` has held without a break for longer than ``limit`` [s]."""
        if not holds:
            self._since.pop(what, None)
            return False
        return now - self._since.setdefault(what, now) > limit
