"""Goals: turning by an angle and walking a distance, closed on the measured pose."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from controller.modes import Limited
from go2_wbc.errors import CommandError
from go2_wbc.planning.command import VelocityCommand, finite_number
from go2_wbc.robot.rotations import wrap_angle
from go2_wbc.robot.state import RobotState

TURN_RATE = 1.0  #: Greatest turning rate [rad/s] of a goal
WALK_SPEED = 0.4  #: Greatest speed [m/s] of a goal
APPROACH = 2.0  #: Speed per remaining way [1/s]: the robot slows down before its goal
HEADING_TOLERANCE = math.radians(1.5)
DISTANCE_TOLERANCE = 0.02
GREATEST_TURN = 2 * math.pi
"""Greatest angle [rad] of one goal: a whole turn; more is a mistake in units."""
GREATEST_DISTANCE = 100.0
"""Greatest distance [m] of one goal: four minutes' work; more is a mistake in units."""


class Goal(ABC):
    """A walk with a measured goal."""

    def __init__(self, name: str, asked: float, speed: float) -> None:
        """Args: asked: way or angle, walked at ``speed`` per second."""
        self.name, self._asked = name, asked
        self.time_limit = 3.0 * abs(asked) / speed + 8.0
        """Time [s] in which it must end: three times as long as at full speed."""

    def begin(self, state: RobotState) -> None:
        """Note where it starts."""
        self._p_world_start = state.p_world_base.copy()
        self._yaw_start = self._yaw_last = state.yaw
        self._turned_before = 0.0

    def command(self, state: RobotState) -> VelocityCommand:
        """The velocity that leads to the goal; ask at least twice in every turn of the robot."""
        turned = self._turned(state)
        self._turned_before, self._yaw_last = turned, state.yaw
        x, y, turn = self._velocity(*self._displacement(state), turned)
        c, s = math.cos(turned), math.sin(turned)
        return VelocityCommand(c * x + s * y, -s * x + c * y, turn)

    def _turned(self, state: RobotState) -> float:
        """Angle [rad] turned to the left since the start, over any number of turns.

        The robot must have turned by less than half a turn since it last asked for a command.
        """
        return self._turned_before + wrap_angle(state.yaw - self._yaw_last)

    def _displacement(self, state: RobotState) -> tuple[float, float]:
        """Way ahead and to the left [m] in the frame of the start."""
        dx, dy = (state.p_world_base - self._p_world_start)[:2].tolist()
        c, s = math.cos(self._yaw_start), math.sin(self._yaw_start)
        return c * dx + s * dy, -s * dx + c * dy

    @abstractmethod
    def _velocity(self, ahead: float, left: float, turned: float) -> tuple[float, float, float]:
        """Velocity [m/s] in the frame of the start and turning rate [rad/s] to the goal."""

    @abstractmethod
    def is_done(self, state: RobotState) -> bool:
        """Whether the goal is reached and the robot may stop."""

    @abstractmethod
    def errors(self, state: RobotState) -> Limited:
        """How far the resting robot is from the goal, and may be."""

    @abstractmethod
    def measurements(self, state: RobotState) -> dict[str, float]:
        """What was asked and achieved, by name with unit."""


class TurnInPlace(Goal):
    """Turn left by an angle, staying in place."""

    def __init__(self, angle: float, way: float = 1.0) -> None:
        """Turn left by ``way`` times ``angle`` [rad]; CommandError beyond ``GREATEST_TURN``."""
        angle = finite_number("angle", angle)
        if abs(angle) > GREATEST_TURN:
            raise CommandError(
                f"angle of {angle:g} rad looks like degrees: write deg({angle:g}), from motions "
                f"import deg; a turn goes to 360 deg at most, and this is {math.degrees(angle):.0f}"
            )
        asked = way * angle
        super().__init__(f"turn by {math.degrees(asked):.1f} deg", asked, TURN_RATE)

    def _velocity(self, ahead: float, left: float, turned: float) -> tuple[float, float, float]:
        turn = _clipped(APPROACH * (self._asked - turned), TURN_RATE)
        return _clipped(-0.5 * ahead, 0.1), _clipped(-0.5 * left, 0.1), turn

    def is_done(self, state: RobotState) -> bool:
        """Whether less than a third of a degree is left and the robot hardly turns."""
        remaining = self._asked - self._turned(state)
        return abs(remaining) < math.radians(0.3) and abs(float(state.v[5])) < 0.15

    def errors(self, state: RobotState) -> Limited:
        """Of the heading."""
        return _heading_error(self._asked - self._turned(state))

    def measurements(self, state: RobotState) -> dict[str, float]:
        """Angle asked and turned."""
        turned = self._turned(state)
        return {"asked [deg]": math.degrees(self._asked), "turned [deg]": math.degrees(turned)}


class DriveStraight(Goal):
    """Walk a distance along the heading of the start."""

    def __init__(self, distance: float) -> None:
        """Walk ``distance`` [m], negative goes back; CommandError beyond ``GREATEST_DISTANCE``."""
        distance = finite_number("distance", distance)
        if abs(distance) > GREATEST_DISTANCE:
            limit = f"+-{GREATEST_DISTANCE:.0f} m"
            raise CommandError(f"distance must be within {limit}, got {distance}")
        super().__init__(f"walk {distance:.3f} m", distance, WALK_SPEED)

    def _velocity(self, ahead: float, left: float, turned: float) -> tuple[float, float, float]:
        speed = _clipped(APPROACH * (self._asked - ahead), WALK_SPEED)
        return speed, _clipped(-left, 0.15), _clipped(-APPROACH * turned, 0.5)

    def is_done(self, state: RobotState) -> bool:
        """Whether less than 4 mm are left and the robot hardly moves on."""
        ahead, _ = self._displacement(state)
        return abs(self._asked - ahead) < 0.004 and abs(float(state.v[0])) < 0.06

    def errors(self, state: RobotState) -> Limited:
        """Of the place, and of the heading of the start."""
        ahead, left = self._displacement(state)
        miss = math.hypot(self._asked - ahead, left)
        place = {"distance from the goal [m]": (miss, DISTANCE_TOLERANCE)}
        return {**place, **_heading_error(self._turned(state))}

    def measurements(self, state: RobotState) -> dict[str, float]:
        """Distance asked and walked, and the heading error."""
        ahead, left = self._displacement(state)
        return {
            "asked [m]": self._asked,
            "walked [m]": ahead,
            "aside [m]": left,
            "heading error [deg]": math.degrees(self._turned(state)),
        }


def _heading_error(angle: float) -> Limited:
    return {"off the heading [deg]": (math.degrees(abs(angle)), math.degrees(HEADING_TOLERANCE))}


def _clipped(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
