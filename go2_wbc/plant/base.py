"""What a robot, or a simulator of one, must do to be driven by this project."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import isfinite

import numpy as np

from go2_wbc.errors import PlantError
from go2_wbc.records import ArrayNx3
from go2_wbc.robot.description import GO2
from go2_wbc.robot.state import JointCommand, PartFault, RobotState


@dataclass(frozen=True, slots=True)
class Scan:
    """What a range sensor has met around the robot, without what it sees of the robot itself."""

    time: float  #: plant time [s] at which it was taken
    p_base_points: ArrayNx3  #: where its rays have met something, in the base frame [m]
    deviation: float  #: standard deviation of a point's height [m]

    def checked(self) -> Scan:
        """The same, its points as double precision.

        Raises:
            PlantError: if it cannot be taken into the map.
        """
        try:
            points = np.ascontiguousarray(self.p_base_points, dtype=float)
        except (TypeError, ValueError) as error:
            raise PlantError(f"p_base_points of a scan must be numbers: {error}") from None
        if points.ndim != 2 or points.shape[1] != 3:
            raise PlantError(f"p_base_points of a scan must be (n, 3), got {points.shape}")
        if not (isfinite(self.time) and isfinite(self.deviation) and self.deviation > 0.0):
            raise PlantError(
                "time [s] of a scan must be finite, its deviation [m] above 0; "
                f"got {self.time} and {self.deviation}"
            )
        return Scan(self.time, points, self.deviation)


class Plant(ABC):
    """A robot that can be read and commanded; its clock is the only clock of the controller.

    One control tick is ``read()``, then ``write(command)``, which lets one control period pass.

    Attributes:
        robot: name of the profile of the robot that it is.
        model_file: its own MJCF or URDF, by which it is drawn; empty if it has none.
        joint_damping: viscous friction of the joints [N m s/rad], if it is written down, else 0.
    """

    robot: str = GO2
    model_file: str = ""
    joint_damping: tuple[float, ...] = (0.0,) * 12

    @property
    @abstractmethod
    def control_period(self) -> float:
        """Seconds that pass in one ``write``."""

    @property
    def is_live(self) -> bool:
        """Whether time also passes between two ``write``, so that commands must not stop."""
        return False

    @property
    def is_hardware(self) -> bool:
        """Whether a robot may be moved: dynamic motions are then refused unless allowed.

        What is live is taken for one unless it says that it is none.
        """
        return self.is_live

    @property
    def body_contact_force(self) -> float | None:
        """Normal force [N] of the ground on all but the feet; None of a plant that cannot tell."""
        return None

    @property
    def motors_obey(self) -> bool:
        """Whether motors are asked for what is written, at once, so that they are judged by it.

        Not where others may command them, or time passes between two ``write``.
        """
        return False

    @property
    def sensor_faults(self) -> tuple[PartFault, ...]:
        """Sensors that were found to be broken; a plant that does not look says none."""
        return ()

    @abstractmethod
    def read(self) -> RobotState:
        """The newest measured state.

        Raises:
            PlantTimeout: if the plant stopped answering.
        """

    def scan(self) -> Scan | None:
        """The newest scan of the ground, once; None until there is another, or without a sensor."""
        return None

    @abstractmethod
    def write(self, command: JointCommand) -> None:
        """Apply ``command`` for one control period.

        Raises:
            CommandError: if the command has a value that is not finite; nothing is applied.
            PlantTimeout: if the plant stopped answering.
        """

    @abstractmethod
    def close(self) -> None:
        """Release everything; idempotent."""
