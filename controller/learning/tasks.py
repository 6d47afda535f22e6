"""What environments ask, as data: commands, ground, pushes, worlds, weights of the reward."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from controller.sweeps.trials import FRICTION_RANGE, JOINT_NOISE, MASS_RANGE, PUSH_TIME, YAW_RANGE
from go2_wbc.brief import brief
from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.plant.terrain import Boxes, Terrain
from go2_wbc.records import Array3
from go2_wbc.world import DOUBTFUL, World

Range = tuple[float, float]  #: Least and greatest value; drawn evenly

_FRICTION = sum(FRICTION_RANGE) / 2.0
WORLD = World(
    friction=_FRICTION,
    friction_uncertainty=FRICTION_RANGE[1] / _FRICTION - 1.0,
    mass_uncertainty=MASS_RANGE[1] - 1.0,
    joint_friction_uncertainty=DOUBTFUL.joint_friction_uncertainty,
)
"""Friction and mass as the benchmarks draw them, the joints' friction as certificates do."""


@dataclass(frozen=True, slots=True)
class Commands:
    """Which velocities are asked for."""

    linear_x: Range = (-0.5, 1.0)  #: ahead [m/s]
    linear_y: Range = (-0.3, 0.3)  #: to the left [m/s]
    angular_z: Range = (-0.8, 0.8)  #: turning left [rad/s]
    every: float = 5.0  #: time [s] after which another is drawn
    standing: float = 0.1  #: share of commands that are 0

    def draw(self, rng: np.random.Generator) -> Array3:
        """One of them."""
        low, high = zip(self.linear_x, self.linear_y, self.angular_z, strict=True)
        command = rng.uniform(low, high)
        return np.zeros(3) if rng.random() < self.standing else command


@dataclass(frozen=True, slots=True)
class Shoves:
    """Pushes on the trunk, from any side, on the level."""

    every: Range = (2.0, 5.0)  #: time [s] from one to the next
    impulse: Range = (3.0, 15.0)  #: of each [N s]
    duration: float = PUSH_TIME  #: of each [s]

    def draw(self, rng: np.random.Generator) -> Array3:
        """The force of one [N]."""
        angle, impulse = rng.uniform(-math.pi, math.pi), rng.uniform(*self.impulse)
        return impulse / self.duration * np.array([math.cos(angle), math.sin(angle), 0.0])


WEIGHTS: Mapping[str, float] = {
    "velocity": 1.5,
    "turn": 0.75,
    "bounce": 2.0,
    "roll_and_pitch": 0.05,
    "tilt": 1.0,
    "effort": 2e-4,
    "change": 0.01,
    "knock": 1.0,
    "fall": 2.0,
}
"""Of the terms of ``rewards``, a second; nearly Isaac Lab's of its Go2 on flat ground, which come
from legged_gym (Rudin et al., Learning to walk in minutes, 2022, table 1). Fall: own choice."""


@dataclass(frozen=True, slots=True)
class LearningTask:
    """What an environment asks of the robot, and in which world."""

    name: str  #: what ``task=`` takes
    commands: Commands = Commands()  #: velocities to follow
    world: World = WORLD  #: what it meets; its uncertainties are drawn for every episode
    delay: Range = (0.0, 0.01)  #: after which actions act [s]
    shoves: Shoves | None = None  #: on the trunk, if there are any
    terrains: tuple[Terrain, ...] = ()  #: one is drawn for each episode; none is a level floor
    weights: Mapping[str, float] = field(default_factory=lambda: WEIGHTS, hash=False)
    """Of the terms of the reward, by name."""
    joint_noise: float = JOINT_NOISE  #: standard deviation [rad] of the joints' first angles
    yaw: Range = YAW_RANGE  #: heading at the start [rad]

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise CommandError for a weight of no term."""
        for name in self.weights:
            if name not in WEIGHTS:
                raise CommandError(unknown_name("term of the reward", name, WEIGHTS))

    def draw_world(self, rng: np.random.Generator) -> World:
        """The world of an episode."""
        return replace(self.world.sample(rng), delay=float(rng.uniform(*self.delay)))

    @property
    def exact(self) -> LearningTask:
        """The same in the middle of its world, without delay, noise or another heading."""
        world = World(self.world.friction)
        return replace(self, world=world, delay=(0.0, 0.0), joint_noise=0.0, yaw=(0.0, 0.0))


ROUGH = tuple(Boxes(0.02 + 0.01 * n, count=250, extent=5.0, seed=n) for n in range(6))
"""Boxes of 2 to 7 cm, 250 in a square of 10 m: the highest are a fifth of the legs' length."""

TASKS: Mapping[str, LearningTask] = {
    task.name: task
    for task in (
        LearningTask("velocity"),
        LearningTask("rough", Commands(linear_x=(-0.3, 0.6)), terrains=ROUGH),
        LearningTask("push", Commands(linear_x=(-0.3, 0.6)), shoves=Shoves()),
    )
}
"""What ships, by name."""


def find_task(task: LearningTask | str) -> LearningTask:
    """The task of that name; a task is itself.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    if isinstance(task, LearningTask):
        return task
    if task not in TASKS:
        raise CommandError(unknown_name("task", str(task), TASKS))
    return TASKS[task]
