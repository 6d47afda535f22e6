"""Behaviours: each turns the snapshot of a tick into what to track now.

Here those that need no contact model: going limp, and moving the joints by a servo.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.curves import Curve
from go2_wbc.reference import JointReference, Reference
from go2_wbc.robot.state import JointCommand, RobotState, Snapshot


@dataclass(frozen=True, slots=True)
class Shared:
    """What to track while somebody else moves the joints, too."""

    reference: Reference  #: for the whole-body controller
    command: JointCommand  #: of the other one
    share: float  #: of that in the torques, above 0, at most 1

    @property
    def stance(self) -> Bool[np.ndarray, "4"]:
        """Feet that are planned to carry the robot."""
        return self.reference.stance

    def mixed(self, own: JointCommand, state: RobotState) -> JointCommand:
        """The other's command, and that of the whole-body controller as a torque."""
        rest, theirs = 1.0 - self.share, self.command
        tau = rest * own.asked(state.joint_positions, state.joint_velocities)
        return JointCommand(
            tau + self.share * theirs.tau,
            theirs.q_des,
            theirs.v_des,
            self.share * theirs.kp,
            self.share * theirs.kd,
        )


class Behaviour(ABC):
    """Something the robot does: ``start`` once, then ``update`` every tick."""

    label: str = "?"  #: what is written in recordings
    duration: float = 0.0  #: time [s] that it takes, unless it says otherwise by ``is_finished``
    needs_balance: bool = True  #: whether a large tilt means that the robot has fallen
    may_lie: bool = False  #: whether the belly may be on the ground
    is_dynamic: bool = False  #: whether it flies, or stands on few feet
    knows_payload: bool = False
    """Whether the robot is taken to carry what was felt, and goes on feeling it."""
    sag_and_lean: tuple[float, float] | None = None
    """Depth [m] of the trunk below where it shall be and angle [rad] from how it shall be, if what
    is tracked says something else; None if it says so itself."""
    delay: float = 0.0  #: after which commands act [s], as far as that is known

    def start(self, snapshot: Snapshot) -> None:
        """Begin from the measured state."""
        self._start = snapshot.state.time

    @abstractmethod
    def update(self, snapshot: Snapshot) -> Reference | JointReference | Shared:
        """What to track now."""

    def is_finished(self, snapshot: Snapshot) -> bool:
        """Whether it has nothing more to do; it goes on holding its end until replaced."""
        return snapshot.state.time - self._start >= self.duration


DAMPING = 3.0  #: Joint damping [N m s/rad] of the safe state: the robot sinks in about a second
SERVO_DAMPING = 2.0  #: That of a servo [N m s/rad]


class _OnTheGround(Behaviour):
    """Something that a robot does on the ground, where only a large tilt can be a fall."""

    may_lie = True

    def __init__(self, label: str, *, stays_on_belly: bool) -> None:
        self.label, self.needs_balance = label, stays_on_belly


class Damped(_OnTheGround):
    """Limp: no stiffness, only damping."""

    def __init__(
        self, label: str = "damped", duration: float = 0.0, *, stays_on_belly: bool = False
    ) -> None:
        """Go limp.

        Args:
            label: see ``Behaviour``.
            duration: time [s] before it counts as finished.
            stays_on_belly: whether a robot that is tipped over, or was before, has fallen.
        """
        super().__init__(label, stays_on_belly=stays_on_belly)
        self.duration = duration

    def start(self, snapshot: Snapshot) -> None:
        """Note the time and the joints."""
        super().start(snapshot)
        self._joints = snapshot.state.joint_positions.copy()

    def update(self, snapshot: Snapshot) -> JointReference:
        """Zero stiffness."""
        return JointReference(self._joints, np.zeros(12), 0.0, DAMPING)


class ServoJoints(_OnTheGround):
    """Move the joints through keyframes by a stiff servo; for when the trunk lies on the ground."""

    def __init__(
        self,
        label: str,
        targets: tuple[tuple[float, Float[np.ndarray, "12"]], ...],
        kp: float = 40.0,
        *,
        stays_on_belly: bool = False,
    ) -> None:
        """Move.

        Args:
            label: see ``Behaviour``.
            targets: (duration [s], joint angles (12,) [rad]) of each leg of the way.
            kp: stiffness [N m/rad].
            stays_on_belly: whether a robot that is tipped over, or was before, has fallen.
        """
        super().__init__(label, stays_on_belly=stays_on_belly)
        self._targets, self._kp = targets, kp

    def start(self, snapshot: Snapshot) -> None:
        """Plan from the measured joints."""
        super().start(snapshot)
        times = np.cumsum([0.0, *(duration for duration, _ in self._targets)]).tolist()
        values = [snapshot.state.joint_positions.copy(), *(q for _, q in self._targets)]
        self._curve = Curve(times, values)
        self.duration = self._curve.duration

    def update(self, snapshot: Snapshot) -> JointReference:
        """The point of the way that belongs to this instant."""
        point = self._curve.at(snapshot.state.time - self._start)
        return JointReference(point.value, point.rate, self._kp, SERVO_DAMPING)
