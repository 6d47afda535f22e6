"""What can be swept by name: a gait or a push, each a function from a seed to a row.

What a seed varies is in ``trials.py``: friction, mass, heading, and the pose from which the robot
gets up. A robot that fails is a row, too: it says why, and what was not measured is nan.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from controller.sweeps.rows import Row, Value
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.contacts import GAITS
from go2_wbc.errors import Go2WbcError
from go2_wbc.planning.command import VelocityCommand

START_TIME = 1.5
"""Time [s] after a command that is left out: the ramp takes 0.7 s, settling the rest."""
WINDOW = 5.0
"""Time [s] over which the velocity is compared with the command."""
PUSH_TIME = 0.1
"""Duration [s] of a push."""
RECOVERY_TIME = 2.0
"""Time [s] after a push until the robot is looked at."""
_STREAM = 1
"""Keeps the numbers of a push apart from those of the robot and its world."""


@dataclass(frozen=True, slots=True)
class GaitStudy:
    """Walks with a velocity, on flat ground.

    Attributes:
        gait: its name.
        command: forward and left [m/s], turning left [rad/s].
    """

    gait: str
    command: VelocityCommand

    def __call__(self, seed: int) -> Row:
        """Velocity errors [m/s], [rad/s] over 5 s, loads as shares of the limits."""
        names = ("speed_error", "side_error", "turn_error", "speed_ripple", "torque")
        return _row(Trial(seed), dict.fromkeys(names, math.nan), self._measured)

    def _measured(self, robot: TrialRobot) -> Row:
        set_off(robot, self.gait, self.command)
        robot.wait(START_TIME + WINDOW)
        recorded = robot.truth.recording()
        window = recorded.since(recorded.time[0] + START_TIME)
        ahead, left = window.com_velocity[:, 0], window.com_velocity[:, 1]
        turned = (window.rpy[-1, 2] - window.rpy[0, 2]) / (window.time[-1] - window.time[0])
        return {
            "ok": True,
            "speed_error": float(ahead.mean()) - self.command.linear_x,
            "side_error": float(left.mean()) - self.command.linear_y,
            "turn_error": float(turned) - self.command.angular_z,
            "speed_ripple": float(ahead.std()),
            "torque": float(recorded.torque_shares(robot.model).max()),
        }


@dataclass(frozen=True, slots=True)
class PushStudy:
    """Pushes the base of a trotting or standing robot, from any side, at any time of the stride.

    Attributes:
        impulse: of the push [N s], over 0.1 s.
        speed: at which the robot trots [m/s]; 0 stands.
    """

    impulse: float
    speed: float

    def __call__(self, seed: int) -> Row:
        """Whether it stayed up, where the push came from, how far [m] and fast [m/s] it went."""
        angle, phase = np.random.default_rng([_STREAM, seed]).random(2) * (2.0 * math.pi, 1.0)
        drawn = {"angle": float(angle), "phase": float(phase)}
        empty = {**drawn, "distance": math.nan, "speed_error": math.nan}
        return _row(Trial(seed), empty, partial(self._pushed, **drawn))

    def _pushed(self, robot: TrialRobot, angle: float, phase: float) -> Row:
        period = GAITS["trot"].period
        if self.speed:
            set_off(robot, "trot", VelocityCommand(self.speed))
        else:
            robot.require(robot.go2.stand())
        robot.wait(START_TIME + phase * period)
        start, heading = robot.truth.p_world_com, float(robot.plant.truth().rpy[2])
        force = self.impulse / PUSH_TIME * np.array([math.cos(angle), math.sin(angle), 0.0])
        robot.push(force, PUSH_TIME)
        robot.wait(RECOVERY_TIME)
        moved = robot.truth.p_world_com - start
        wanted = self.speed * RECOVERY_TIME * np.array([math.cos(heading), math.sin(heading)])
        last = robot.truth.recording(since=robot.plant.time - 2.0 * period)
        return {
            "ok": True,
            "distance": float(np.linalg.norm(moved[:2] - wanted)),
            "speed_error": float(last.com_velocity[:, 0].mean()) - self.speed,
        }


def set_off(robot: TrialRobot, gait: str, command: VelocityCommand) -> None:
    """Stand up and walk; the record begins with the command.

    Raises:
        TrialFailed: if the robot does not get that far.
    """
    robot.require(robot.go2.stand())
    robot.require(robot.go2.walk(gait))
    robot.go2.move(command.linear_x, command.angular_z, linear_y=command.linear_y)
    robot.truth.clear()


def _row(trial: Trial, empty: Row, measured: Callable[[TrialRobot], Row]) -> Row:
    """What the seed has drawn, and what is measured; of a robot that fails why, and ``empty``."""
    row: dict[str, Value] = {"friction": trial.friction, "mass_scale": trial.mass_scale}
    row |= {"ok": False, "fall": "", **empty}
    try:
        with TrialRobot(trial) as robot:
            row |= measured(robot)
    except (TrialFailed, Go2WbcError) as error:
        row["fall"] = str(error)
    return row
