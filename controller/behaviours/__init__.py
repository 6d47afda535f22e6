"""Behaviours: each turns the snapshot of a tick into what to track now."""

from __future__ import annotations

from abc import ABC, abstractmethod

from go2_wbc.reference import JointReference, Reference
from go2_wbc.robot.state import Snapshot


class Behaviour(ABC):
    """Something the robot does: ``start`` once, then ``update`` every tick.

    Attributes:
        label: what is written in recordings.
        duration: time [s] that it takes, unless it says otherwise by ``is_finished``.
        needs_balance: whether a large tilt means that the robot has fallen.
        may_lie: whether the belly may be on the ground.
        is_dynamic: whether it flies, or stands on few feet.
        knows_payload: whether the robot is taken to carry what was felt, and goes on feeling it.
        delay: after which commands act [s], as far as that is known.
        sag_and_lean: depth [m] of the trunk below where it shall be and angle [rad] from how it
            shall be, if what is tracked says something else; None if it says so itself.
    """

    label: str = "?"
    duration: float = 0.0
    needs_balance: bool = True
    may_lie: bool = False
    is_dynamic: bool = False
    knows_payload: bool = False
    sag_and_lean: tuple[float, float] | None = None
    delay: float = 0.0

    def start(self, snapshot: Snapshot) -> None:
        """Begin from the measured state."""
        self._start = snapshot.state.time

    @abstractmethod
    def update(self, snapshot: Snapshot) -> Reference | JointReference:
        """What to track now."""

    def is_finished(self, snapshot: Snapshot) -> bool:
        """Whether it has nothing more to do; it goes on holding its end until replaced."""
        return snapshot.state.time - self._start >= self.duration
