"""What the robot is not told of: uneven, sloping and slippery ground, payloads, late commands.

Rows of ``python -m benchmarks locomotion``. A run is done if the robot has stood up, walked its way
without falling, at nine tenths of the wanted speed at least, come to rest and stood up straight
again, all by calls that said True; MuJoCo judges. Motors with their torque-speed line; unless said
otherwise friction 0.6 to 1.0 and masses within 10 %. The controller, in its own configuration, is
told nothing. Every world is walked twice: with the true state, and (group ``unknown-sensors``) with
what the robot's own sensors tell. Numbers were chosen on seeds 0 to 9 and from 7500 on; those that
are judged begin at ``FIRST_SEED``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from benchmarks.study import Direction, Measurement, Metric, Study
from controller.sweeps.trials import JOINT_NOISE, Trial, TrialFailed, TrialRobot
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.plant.terrain import Boxes, Patch, Ramp, Slope, Stairs, Terrain
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from motions.postures import STAND_HEIGHT

FIRST_SEED = 14200
"""Seed of the first trial that is judged; those from 4200 on were, and causes found on them."""
FRICTION_RANGE, MASS_RANGE = (0.6, 1.0), (0.9, 1.1)
HEADING_RANGE = math.radians(5.0)
"""By which the heading at the start is off its way, at most, on either side [rad]."""
LEAST_SHARE = 0.9
"""Of the wanted way, that has to be walked."""
RAMP_UP = 1.0
"""Time [s] after the command that is left out."""
REST, SAMPLING = 3.0, 10
"""Time [s] over which height and tilt are averaged, and ticks from one sample to the next."""
STEEP = math.radians(15.0)
UP, ACROSS, DOWN = 0.0, math.pi / 2, math.pi
"""Headings on a slope [rad]."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """One world and one command.

    Attributes:
        name: of the scenario.
        item: what it is, for the report.
        speed: wanted, ahead [m/s]; 0 to stand only.
        time: for which it is walked, or stood [s].
        terrain: the ground; boxes take their seed from the trial.
        friction: of the ground; None if it is drawn.
        heading: at the start [rad].
        payload: [kg], and the mass of the robot is then that of the model.
        payload_place: of its middle in the base frame [m].
        delay: after which a command acts [s].
        control_period: [s].
        sensors: of the plant.
    """

    name: str
    item: str
    speed: float = 0.5
    time: float = 8.0
    terrain: Terrain | None = None
    friction: float | None = None
    heading: float = UP
    payload: float = 0.0
    payload_place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    delay: float = 0.0
    control_period: float = 0.002
    sensors: str = "ideal"

    @property
    def sensed(self) -> Unknown:
        """The same on the robot's own sensors."""
        name, item = f"sensed-{self.name}", f"sensors: {self.item}"
        return replace(self, name=name, item=item, sensors="imu")

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """The rows of the report."""
        name, item = self.name, self.item
        done = Metric(f"{name}.done", item, "share done", "", 1.0, Direction.AT_LEAST)
        if self.payload:
            return (
                done,
                Metric(f"{name}.height", item, "mean height off", "mm", 10.0),
                Metric(f"{name}.tilt", item, "mean tilt", "deg", 2.0),
            )
        if not self.speed:
            return (done,)
        return done, Metric(f"{name}.mean", item, "mean velocity error", "%", None)

    def plant(self, seed: int) -> MujocoPlant:
        """The simulated robot of a trial."""
        rng = np.random.default_rng(seed)
        friction, mass = rng.uniform(*FRICTION_RANGE), rng.uniform(*MASS_RANGE)
        off = rng.uniform(-HEADING_RANGE, HEADING_RANGE)
        terrain = self.terrain
        if isinstance(terrain, Boxes):
            terrain = Boxes(height=terrain.height, count=terrain.count, seed=seed)
        return MujocoPlant(
            friction=float(friction) if self.friction is None else self.friction,
            mass_scale=1.0 if self.payload else float(mass),
            seed=seed,
            initial_yaw=self.heading + float(off),
            initial_joint_noise=JOINT_NOISE,
            terrain=terrain,
            payload=self.payload,
            payload_place=self.payload_place,
            delay=self.delay,
            control_period=self.control_period,
            sensors=self.sensors,
        )


def measure(
    trial: Trial, unknown: Unknown, first_seed: int = FIRST_SEED, config: Config | None = None
) -> Measurement:
    """Stand up, walk, come to rest, stand; see the module's docstring."""
    values = {f"{unknown.name}.done": 0.0}
    try:
        with TrialRobot(unknown.plant(first_seed + trial.seed), config) as robot:
            robot.require(robot.go2.stand())
            if unknown.speed:
                _walk(robot, unknown, values)
            robot.require(robot.go2.stand())
            if unknown.payload:
                robot.truth.clear()
                robot.wait(REST)
                _note_posture(unknown, robot.truth.recording(), values)
    except TrialFailed as failed:
        return Measurement(values, {f"{unknown.name}.done": str(failed)}, str(failed))
    return Measurement(values | {f"{unknown.name}.done": 1.0})


def _walk(robot: TrialRobot, unknown: Unknown, values: dict[str, float]) -> None:
    robot.require(robot.go2.walk())
    robot.go2.move(unknown.speed)
    robot.wait(RAMP_UP)
    robot.truth.clear()
    robot.wait(unknown.time)
    recorded = robot.truth.recording()
    speed = float(recorded.com_velocity[:, 0].mean())
    if speed < LEAST_SHARE * unknown.speed:
        raise TrialFailed(f"walked at {speed:.2f} m/s")
    if unknown.payload:
        _note_posture(unknown, recorded, values)
    else:
        values[f"{unknown.name}.mean"] = 100.0 * abs(speed / unknown.speed - 1.0)


def _note_posture(unknown: Unknown, recorded: TruthRecording, values: dict[str, float]) -> None:
    """Mean height and tilt over the last ``REST`` seconds, if worse than what was noted before.

    The height is that of the CoM as the model has it, without the payload: what is asked for.
    """
    window = recorded.since(recorded.time[-1] - REST)
    off = 1000.0 * abs(com_height(window) - STAND_HEIGHT)
    tilt = math.degrees(float(np.abs(window.rpy[:, :2].mean(axis=0)).max()))
    for name, value in ("height", off), ("tilt", tilt):
        key = f"{unknown.name}.{name}"
        values[key] = max(values.get(key, 0.0), value)


def com_height(window: TruthRecording) -> float:
    """Mean height [m] of the CoM as the model has it, without a payload."""
    model, q, v = RobotModel(), window.q[::SAMPLING], window.v[::SAMPLING]
    heights = [model.snapshot(_state(*pair)).p_world_com[2] for pair in zip(q, v, strict=True)]
    return float(np.mean(heights))


def _state(q: Float[np.ndarray, "19"], v: Float[np.ndarray, "18"]) -> RobotState:
    return RobotState(0.0, q, v, np.zeros(12), np.zeros(4), np.ones(4, dtype=bool))


ASIDE = (0.0, 0.08, 0.1)
"""Place of a payload that hangs to the left [m]."""
WORLDS = (
    Unknown("boxes", "boxes up to 8 cm, 0.5 m/s", terrain=Boxes(height=0.08, count=300)),
    Unknown("step", "step of 10 cm, 0.5 m/s", terrain=Stairs(height=0.10, count=1)),
    Unknown("stairs", "stairs of 4 x 8 cm, 0.5 m/s", terrain=Stairs()),
    Unknown("stand-slope", "standing up on 15 deg", speed=0.0, terrain=Slope(STEEP)),
    Unknown("up", "15 deg up, 0.5 m/s", terrain=Slope(STEEP)),
    Unknown("down", "15 deg down, 0.5 m/s", terrain=Slope(STEEP), heading=DOWN),
    Unknown("across", "15 deg across, 0.5 m/s", terrain=Slope(STEEP), heading=ACROSS),
    Unknown("ramp", "up and down 15 deg from the level, 0.5 m/s", time=11.0, terrain=Ramp(STEEP)),
    Unknown("slippery", "friction 0.2, 0.5 m/s", friction=0.2),
    Unknown("slippery-fast", "friction 0.3, 1.0 m/s", speed=1.0, friction=0.3),
    Unknown("patch", "0.5 m of friction 0.15, 0.5 m/s", terrain=Patch()),
    Unknown("heavy", "payload of 6 kg, 0.5 m/s", payload=6.0),
    Unknown("aside", "payload of 4 kg 8 cm aside, 0.5 m/s", payload=4.0, payload_place=ASIDE),
    Unknown("late", "commands 10 ms late, 1.0 m/s", speed=1.0, delay=0.01),
    Unknown("slow", "control at 250 Hz, 1.0 m/s", speed=1.0, control_period=0.004),
)
STUDIES = tuple(
    Study(world.name, world.metrics, partial(measure, unknown=world), group=group)
    for group, worlds in (
        ("unknown", WORLDS),
        ("unknown-sensors", [world.sensed for world in WORLDS]),
    )
    for world in worlds
)
"""In the order of the report."""
