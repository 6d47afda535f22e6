"""What a seed varies, and how a robot is set up for one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.ground_truth import GroundTruth
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.plant import MujocoPlant
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


class Failed(Exception):
    """The robot fell or did not do what it was asked; the message says why."""


@dataclass(frozen=True, slots=True)
class Trial:
    """The conditions that a seed stands for.

    Attributes:
        seed: of every random number of the trial.
        has_nominal_friction: keep the friction at ``NOMINAL_FRICTION``, as for pushes.
    """

    seed: int
    has_nominal_friction: bool = False

    @property
    def friction(self) -> float:
        """Sliding friction coefficient."""
        return NOMINAL_FRICTION if self.has_nominal_friction else self._draw(0, FRICTION_RANGE)

    @property
    def mass_scale(self) -> float:
        """Factor on the robot's mass."""
        return self._draw(1, MASS_RANGE)

    @property
    def yaw(self) -> float:
        """Initial heading [rad]."""
        return self._draw(2, YAW_RANGE)

    @property
    def joint_noise(self) -> float:
        """Standard deviation [rad] of the initial joint angles."""
        return JOINT_NOISE

    def _draw(self, index: int, bounds: tuple[float, float]) -> float:
        share = np.random.default_rng(self.seed).random(3)[index]
        return float(bounds[0] + share * (bounds[1] - bounds[0]))

    def plant(self) -> MujocoPlant:
        """A simulated robot under these conditions."""
        return MujocoPlant(
            friction=self.friction,
            mass_scale=self.mass_scale,
            seed=self.seed,
            initial_yaw=self.yaw,
            initial_joint_noise=self.joint_noise,
        )


class Subject:
    """A robot on trial, lying on the ground at first: calls succeed, or ``Failed`` is raised.

    Attributes:
        go2: the controller.
        plant: the simulated robot, for pushes.
        truth: what MuJoCo says.
    """

    def __init__(self, trial: Trial | MujocoPlant) -> None:
        """Set up a robot under the conditions of ``trial``, or the one given."""
        self.plant = trial.plant() if isinstance(trial, Trial) else trial
        self.truth = GroundTruth(self.plant)
        self.go2 = GO2Controller(plant=self.truth)

    def close(self) -> None:
        """End the robot; idempotent."""
        self.go2.close()
        self.plant.close()

    def __enter__(self) -> Subject:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def heading(self) -> float:
        """Yaw [rad] now."""
        return float(self.plant.read().rpy[2])

    def require(self, ok: bool) -> None:
        """Raise ``Failed`` unless a call said True and the robot is upright for the truth."""
        if not ok:
            raise Failed(self.go2.last_outcome.reason)
        self._require_upright()

    def wait(self, seconds: float) -> None:
        """Let time pass.

        Raises:
            Failed: if the robot falls meanwhile, for the controller or for the truth.
        """
        self.go2.wait(seconds)
        if self.go2.mode in (Mode.FALLEN, Mode.DAMPED):
            raise Failed(self.go2.last_outcome.reason)
        self._require_upright()

    def push(self, f_heading: Float[np.ndarray, "3"], duration: float, where: str = "base") -> None:
        """Push with a force [N] that points ahead, left, up of the robot, beginning now."""
        self.plant.push(yaw_rotation(self.heading) @ f_heading, duration, where)

    def _require_upright(self) -> None:
        fall = self.truth.fall()
        if fall is not None:
            raise Failed(fall)


class Supply:
    """One robot at a time, made ready; after ``drop`` the next use gets a new one."""

    def __init__(self, trial: Trial, prepare: Callable[[Subject], None]) -> None:
        """Make robots for ``trial``; ``prepare`` makes one ready and may raise ``Failed``."""
        self._trial, self._prepare = trial, prepare
        self._robot: Subject | None = None

    def robot(self) -> Subject:
        """The present robot, or a new one made ready.

        Raises:
            Failed: if a new robot cannot be made ready.
        """
        if self._robot is None:
            self._robot = Subject(self._trial)
            self._prepare(self._robot)
        return self._robot

    def drop(self) -> None:
        """End the present robot, if there is one."""
        if self._robot is not None:
            self._robot.close()
            self._robot = None

    def __enter__(self) -> Supply:
        return self

    def __exit__(self, *_: object) -> None:
        self.drop()
