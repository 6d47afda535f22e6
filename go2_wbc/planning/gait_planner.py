"""What a planner of gaits is: a velocity command in, references out."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import Gait
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.pose import LEVEL, BodyPose
from go2_wbc.reference import Reference
from go2_wbc.robot.snapshot import Snapshot


class GaitPlanner(ABC):
    """Turns a velocity command into references, one tick after the other."""

    @abstractmethod
    def start(self, snapshot: Snapshot) -> None:
        """Begin from the measured state, standing."""

    @abstractmethod
    def change_gait(self, gait: Gait) -> None:
        """Walk on with ``gait``; while it walks the strides pass over into it one after the other.

        The command, and the velocity that is left of one before, must be within its envelope.
        """

    @property
    @abstractmethod
    def velocity(self) -> Float[np.ndarray, "3"]:
        """Ramped command in the heading frame [m/s, m/s, rad/s]; 0 before ``start``."""

    @property
    @abstractmethod
    def is_stepping(self) -> bool:
        """Whether the gait is running; not before ``start``."""

    @property
    @abstractmethod
    def heading(self) -> float:
        """Yaw [rad] of the reference; 0 before ``start``."""

    @abstractmethod
    def square_up(self, snapshot: Snapshot) -> bool:
        """Start stepping unless every foot is below its hip; returns whether they all are."""

    @abstractmethod
    def update(
        self, snapshot: Snapshot, command: VelocityCommand, pose: BodyPose = LEVEL
    ) -> Reference:
        """The reference of this tick.

        Args:
            snapshot: of this tick.
            command: wanted velocity, already inside the envelope.
            pose: wanted pose of the trunk, already inside its envelope.
        """
