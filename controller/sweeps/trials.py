"""The conditions that a seed draws, a simulated robot under them, and the trials with a name.

A gait or a push is a function from a seed to a row. A robot that fails gives a row, too, with the
reason; what was not measured is nan.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from jaxtyping import Float

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.sweeps.sweep_file import Row, Value
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS
from go2_wbc.errors import Go2WbcError
from go2_wbc.motion_plan import Posture
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation

FRICTION_RANGE = (0.5, 1.0)
"""Friction coefficient of feet and floor: from wet tiles to dry rubber on concrete."""
NOMINAL_FRICTION = 0.8
MASS_RANGE = (0.9, 1.1)
"""Factor on every mass and inertia of the robot; the controller is not told."""
YAW_RANGE = (-math.pi, math.pi)  #: Heading [rad] at the start
JOINT_NOISE = 0.05
"""Standard deviation [rad] of the joint angles from which the robot sinks to the ground."""


class TrialFailed(Exception):
    """The robot fell or did not do what it was asked; the message says why."""


@dataclass(frozen=True, slots=True)
class Trial:
    """The conditions that a seed stands for."""

    seed: int  #: of every random number of the trial
    has_nominal_friction: bool = False  #: whether it is ``NOMINAL_FRICTION``, as for pushes
    sensors: str = "ideal"  #: of the plant, what the controller is given of the state

    @property
    def friction(self) -> float:
        """Sliding friction coefficient."""
        return NOMINAL_FRICTION if self.has_nominal_friction else self._draw(0, FRICTION_RANGE)

    @property
    def mass_scale(self) -> float:
        """Factor on the robot's mass."""
        return self._draw(1, MASS_RANGE)

    @property
    def initial_yaw(self) -> float:
        """Initial heading [rad]."""
        return self._draw(2, YAW_RANGE)

    def _draw(self, index: int, bounds: tuple[float, float]) -> float:
        share = np.random.default_rng(self.seed).random(3)[index]
        return float(bounds[0] + share * (bounds[1] - bounds[0]))

    def plant(self) -> MujocoPlant:
        """A simulated robot under these conditions."""
        return MujocoPlant(
            friction=self.friction,
            mass_scale=self.mass_scale,
            seed=self.seed,
            initial_yaw=self.initial_yaw,
            initial_joint_noise=JOINT_NOISE,
            sensors=self.sensors,
        )


@cache
def _model(motor: str, robot: str) -> RobotModel:
    return RobotModel(find_description(robot=robot), motor=motor)


class TrialRobot:
    """A robot on trial, lying at first: calls succeed, or ``TrialFailed`` is raised.

    Attributes:
        go2, plant, truth: the controller, the simulated robot, for pushes, and what MuJoCo says.
    """

    def __init__(self, trial: Trial | MujocoPlant, config: Config | None = None) -> None:
        """Set up a robot under the conditions of ``trial``, or the one given."""
        self.plant = trial.plant() if isinstance(trial, Trial) else trial
        self.truth = GroundTruth(self.plant)
        self.go2 = GO2Controller(plant=self.truth, config=config)
        self._motor = (config or Config()).motor

    @property
    def model(self) -> RobotModel:
        """What the controller takes the robot for, for those who plan and judge."""
        return _model(self._motor, self.plant.robot)

    def close(self) -> None:
        """End the robot; idempotent."""
        self.go2.close()
        self.plant.close()

    def __enter__(self) -> TrialRobot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def require(self, ok: bool) -> None:
        """Raise ``TrialFailed`` unless a call said True and the robot is upright in truth."""
        reason = self.truth.fall() if ok else self.go2.last_outcome.reason
        if reason is not None:
            raise TrialFailed(reason)

    def get_ready(self, posture: Posture) -> None:
        """Sit, where a motion begins so, or else stand; raises as ``require``."""
        self.require(self.go2.sit() if posture is Posture.SIT else self.go2.stand())

    def wait(self, seconds: float) -> None:
        """Let time pass.

        Raises:
            TrialFailed: if the robot falls meanwhile, for the controller or in truth.
        """
        self.go2.wait(seconds)
        self.require(self.go2.mode not in (Mode.FALLEN, Mode.DAMPED))

    def push(self, f_heading: Float[np.ndarray, "3"], duration: float, where: str = "base") -> None:
        """Push with a force [N] that points ahead, left, up of the robot, beginning now."""
        yaw = float(self.plant.truth().rpy[2])
        self.plant.push(yaw_rotation(yaw) @ f_heading, duration, where)


START_TIME = 1.5
"""Time [s] after a command that is left out: the ramp takes 0.7 s, settling the rest."""
WINDOW = 5.0  #: Time [s] over which the velocity is compared with the command
PUSH_TIME = 0.1  #: Duration [s] of a push
RECOVERY_TIME = 2.0  #: Time [s] after a push until the robot is looked at
_STREAM = 1  #: Keeps the numbers of a push apart from those of the robot and its world


@dataclass(frozen=True, slots=True)
class GaitStudy:
    """Walks with a velocity, on flat ground."""

    gait: str  #: its name
    command: VelocityCommand  #: forward and left [m/s], turning left [rad/s]

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
    """Pushes the base of a trotting or standing robot, from any side, at any time of the stride."""

    impulse: float  #: of the push [N s], over 0.1 s
    speed: float  #: at which the robot trots [m/s]; 0 stands

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
