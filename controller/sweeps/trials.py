"""What a seed varies, and a simulated robot under these conditions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.config import Config
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
YAW_RANGE = (-math.pi, math.pi)
"""Heading [rad] at the start."""
JOINT_NOISE = 0.05
"""Standard deviation [rad] of the joint angles from which the robot sinks to the ground."""


class TrialFailed(Exception):
    """The robot fell or did not do what it was asked; the message says why."""


@dataclass(frozen=True, slots=True)
class Trial:
    """The conditions that a seed stands for.

    Attributes:
        seed: of every random number of the trial.
        has_nominal_friction: keep the friction at ``NOMINAL_FRICTION``, as for pushes.
        sensors: of the plant: what the controller is given of the state.
    """

    seed: int
    has_nominal_friction: bool = False
    sensors: str = "ideal"

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
        go2: the controller.
        plant: the simulated robot, for pushes.
        truth: what MuJoCo says.
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
