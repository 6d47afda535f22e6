"""``python -m benchmarks rough``: stairs, blocks, slopes and waves, blind and by sight; reversals.

On a terrain the robot stands up, walks ahead at the row's speed, and has done it if it is at the
other end in the time that ``LEAST_SHARE`` of that speed takes (of 0.4 m/s where 1 m/s is commanded,
at which it goes on level ground only), has not fallen, comes to rest and stands there. Drawn by the
seed: friction, masses, where it starts, and its heading, which it keeps by its own estimate. A
trunk that touches and goes on has not fallen; its touches are told. Judged by MuJoCo's truth; the
controller is told nothing. Tuned on seeds below 9000; those that are judged begin at
``FIRST_SEED``.

- speed off: of the mean speed from start to end, short of the commanded one [%];
- calf, trunk: share of ticks [%] in which a leg above its foot, or the trunk, touches the ground;
- saturated: share of ticks [%] in which some motor gives all it has at its speed;
- rough torque: root mean square of the change of a torque in 0.1 s [N m].

By sight the robot has a lidar or a depth camera and lives on its own sensors. In front of a wall,
a gap of 60 cm and a step of 30 cm ``move_forward`` must say that it stopped, without a touch.

Reversals are ``COMMANDS``, each for ``EACH`` seconds, ``ROUNDS`` times, on level ground: what is
told is the mean over time of the length of velocity less command, in the heading frame; also with
commands that act 0 to 18 ms late, drawn anew every 20 ms, with 5 % of them lost, and on a friction
of 0.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.command import Benchmark
from benchmarks.study import IDEAL, IMU, Study, TrialResult
from controller.modes import Mode
from controller.motion_measurement import FULL
from controller.sweeps.trials import JOINT_NOISE, Trial, TrialFailed, TrialRobot
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import FALLEN_TILT, TOUCH, TruthRecording
from go2_wbc.plant.terrain import (
    BOTH,
    DOWN,
    Blocks,
    Boxes,
    Course,
    Gap,
    Ramp,
    Stairs,
    Stones,
    Terrain,
    Waves,
)
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle
from go2_wbc.robot.state import JointCommand

FIRST_SEED = 9700
FRICTION, MASS, PLACE, YAW = (0.6, 0.9), (0.9, 1.1), (-0.1, 0.1), (-0.087, 0.087)
"""What is drawn: friction, factor on the masses, place ahead [m], heading [rad]."""
LEAST_SHARE, BEYOND, PATIENCE = 0.8, 0.5, 0.5
"""Share of the speed; how far [m] behind the terrain's end its way ends; time [s] to set off."""
STEER, LOOK, RIPPLE = 1.0, 0.1, 0.1
"""Turning rate per heading error [1/s], how often it is corrected [s], and the span of time [s]."""
COMMANDS = ((2.0, 0, 0), (-2.0, 0, 0), (0, 1.0, 0), (0, -1.0, 0), (0, 0, 2.0), (0, 0, -2.0))
EACH, ROUNDS = 3.0, 5
LATEST, HELD = 9, 10
"""Control periods by which a command is late at most, and for which it is as late: 18, 20 ms."""


class UnreliablePlant(MujocoPlant):
    """A plant whose commands are late by a time that changes, or are lost."""

    def __init__(self, settings: dict[str, Any], *, latest: int = 0, lost: float = 0.0) -> None:
        """Commands act up to ``latest`` control periods late; this share of them gets ``lost``."""
        self._latest, self._lost = latest, lost
        self._sent: list[tuple[int, JointCommand]] = []
        self._lag, self._draws = 0, np.random.default_rng(settings["seed"])
        super().__init__(**settings)

    def write(self, command: JointCommand) -> None:
        """Apply the newest command that has arrived."""
        now, rng = self._ticks, self._draws
        if now % HELD == 0:
            self._lag = int(rng.integers(self._latest + 1))
        if rng.random() >= self._lost or not self._sent:
            self._sent.append((now + self._lag, command))
        arrived = [n for n, (when, _) in enumerate(self._sent) if when <= now] or [0]
        self._sent = self._sent[arrived[-1] :]
        super().write(self._sent[0][1])


@dataclass(frozen=True, slots=True)
class Way:
    """A terrain, and how it is walked."""

    name: str  #: of the scenario
    item: str  #: what it is, for the report
    terrain: Terrain | Callable[[int], Terrain]  #: the same for all seeds, or by the seed
    speed: float = 0.5  #: commanded, ahead [m/s]; negative walks backwards
    length: float | None = None  #: where it has to come [m]; None for behind the terrain's end
    heading: float = 0.0  #: at the start [rad]
    bar: float | None = 0.95  #: least share of the trials that are done
    sees: str = ""  #: by "lidar" or "depth"; it then lives on its own sensors
    returns: bool = False  #: whether it turns there and walks back
    friction: tuple[float, float] = FRICTION  #: of the ground, drawn between these
    pace: float | None = None  #: speed [m/s] by which its time is reckoned; None for the commanded

    @property
    def study(self) -> Study:
        """Its rows and its trial."""
        bar = ">=" if self.bar is None else f">= {self.bar:g}"
        rows = [
            ("done", "share done", bar),
            ("speed", "speed off", "%"),
            ("calf", "ticks with a calf's touch", "%"),
            ("trunk", "ticks with the trunk's touch", "%"),
            ("saturated", "saturated ticks", "%"),
            ("ripple", "rough torque", "N m"),
        ]
        measure = partial(measure_way, way=self)
        group, sensors = ("sight", None) if self.sees else ("terrain", IDEAL)
        return Study(
            self.name, {self.item: rows}, measure, done="done", group=group, sensors=sensors
        )

    def ground(self, seed: int) -> Terrain:
        """The terrain of a trial."""
        return self.terrain(seed) if callable(self.terrain) else self.terrain

    def plant(self, seed: int, sensors: str) -> MujocoPlant:
        """The simulated robot of a trial."""
        rng, terrain = np.random.default_rng(seed), self.ground(seed)
        friction, mass, yaw = (float(rng.uniform(*bounds)) for bounds in (self.friction, MASS, YAW))
        drawn = {"friction": friction, "mass_scale": mass, "initial_yaw": self.heading + yaw}
        own = IMU if self.sees else sensors
        more = {"seed": seed, "sensors": own, "initial_joint_noise": JOINT_NOISE}
        eyes = {self.sees: True} if self.sees else {}
        plant = MujocoPlant(terrain=terrain, **eyes, **drawn, **more)
        q = plant.truth().q.copy()
        q[0] += float(rng.uniform(*PLACE))
        plant.place(q)
        return plant


def measure_way(trial: Trial, found: TrialResult, way: Way, first_seed: int = FIRST_SEED) -> None:
    """Walk the way; see the module's docstring for what is measured."""
    seed = first_seed + trial.seed
    behind = (way.ground(seed).end + BEYOND) / abs(math.cos(way.heading))
    length = way.length or behind
    with TrialRobot(way.plant(seed, trial.sensors)) as robot:
        robot.require(robot.go2.walk())
        robot.truth.clear()
        try:
            time = _walked(robot, way, length)
            if way.returns:
                robot.require(robot.go2.turn_left(math.pi))
                time = 0.5 * (time + _walked(robot, way, length))
        finally:
            found.values |= _measured(robot.truth.recording())
        found.values["speed"] = 100.0 * (1.0 - length / (time * abs(way.speed)))
        robot.go2.stop()
        robot.require(robot.go2.stand())


def _walked(robot: TrialRobot, walked: Way, length: float) -> float:
    """The time [s] that it took to come ``length`` ahead in its own direction.

    Raises:
        TrialFailed: if it falls or takes too long.
    """
    plant, go2 = robot.plant, robot.go2
    start, course = plant.truth(), plant.read().yaw
    speed, way = walked.speed, 0.0
    most, side = PATIENCE + length / (LEAST_SHARE * (walked.pace or abs(speed))), np.sign(speed)
    ahead = side * np.array([math.cos(start.yaw), math.sin(start.yaw)])
    while (elapsed := plant.time - start.time) <= most:
        go2.move(speed, STEER * wrap_angle(course - plant.read().yaw))
        go2.wait(LOOK)
        if go2.mode is not Mode.WALKING or plant.truth().tilt > FALLEN_TILT:
            raise TrialFailed(go2.last_outcome.reason or "it has tipped over")
        way = float(ahead @ (plant.truth().q[:2] - start.q[:2]))
        if way >= length:
            return elapsed
    raise TrialFailed(f"came {way:.1f} of {length:.1f} m in {most:.0f} s")


def _measured(recorded: TruthRecording) -> dict[str, float]:
    """Touches, saturated ticks and how rough the torques were."""
    step = max(round(RIPPLE / float(np.diff(recorded.time[:2])[0])), 1)
    change = recorded.tau[step:] - recorded.tau[:-step]
    touches = {"calf": recorded.limb_force, "trunk": recorded.trunk_force}
    shares = {name: force > TOUCH for name, force in touches.items()}
    shares["saturated"] = recorded.torque_shares(RobotModel()) >= FULL
    values = {name: 100.0 * float(flags.mean()) for name, flags in shares.items()}
    return values | {"ripple": float(np.sqrt(np.mean(change**2))) if len(change) else 0.0}


def measure_barrier(trial: Trial, found: TrialResult, way: Way) -> None:
    """Ask the robot to walk into what it cannot walk over: it stops, says so, and touches nothing.

    Raises:
        TrialFailed: if it does not.
    """
    with TrialRobot(way.plant(FIRST_SEED + trial.seed, trial.sensors)) as robot:
        robot.require(robot.go2.stand())
        robot.truth.clear()
        arrived = robot.go2.move_forward(3.0)
        measured = _measured(robot.truth.recording())
        if " ended: " not in robot.go2.last_outcome.reason:
            raise TrialFailed("came on" if arrived else robot.go2.last_outcome.reason)
        if measured["calf"] + measured["trunk"] > 0.0:
            raise TrialFailed("touched it")
        robot.require(robot.go2.stand())


def _barrier(way: Way) -> Study:
    rows = (
        ("done", "share that stops, says so and touches nothing", ">= 1"),
        ("left", "way left", ">= m"),
    )
    measure = partial(measure_barrier, way=way)
    return Study(way.name, {way.item: rows}, measure, done="done", group="sight", sensors=None)


def measure_reversals(
    trial: Trial,
    found: TrialResult,
    friction: float | None = None,
    latest: int = 0,
    lost: float = 0.0,
    first_seed: int = FIRST_SEED,
) -> None:
    """Follow the commands; ``friction`` is drawn if it is None, for the rest see the plant."""
    seed = first_seed + trial.seed
    rng, off = np.random.default_rng(seed), []
    drawn, mass = float(rng.uniform(*FRICTION)), float(rng.uniform(*MASS))
    world = {"friction": friction or drawn, "mass_scale": mass, "sensors": trial.sensors}
    with TrialRobot(UnreliablePlant({**world, "seed": seed}, latest=latest, lost=lost)) as robot:
        robot.require(robot.go2.walk())
        for ahead, left, turn in COMMANDS * ROUNDS:
            robot.truth.clear()
            robot.go2.move(ahead, turn, linear_y=left)
            robot.wait(EACH)
            velocity = robot.truth.recording().com_velocity[:, :2]
            off.append(float(np.linalg.norm(velocity - (ahead, left), axis=1).mean()))
            found.values["off"] = float(np.mean(off))


def _stairs(height: float) -> Terrain:
    return Stairs(height, 6, 0.31, way=BOTH, landing=1.6)


def _boxes(seed: int) -> Terrain:
    return Boxes(height=0.12, count=300, seed=seed)


SLOPE, ASLANT = math.radians(22.0), math.radians(20.0)
_SLOPE, _DOWN = Ramp(SLOPE, length=2.0), Stairs(0.13, 6, 0.31, way=DOWN)
_LOW = replace(_DOWN, height=0.11)
WAYS = (
    Way("stairs-10", "6 stairs up and down, 10 cm, 0.5 m/s", _stairs(0.10)),
    Way("stairs-13", "13 cm", _stairs(0.13)),
    Way("stairs-14", "14 cm", _stairs(0.14)),
    Way("slow-stairs-13", "13 cm, 0.3 m/s", _stairs(0.13), 0.3),
    Way("slow-stairs-14", "14 cm, 0.3 m/s", _stairs(0.14), 0.3),
    Way("stairs-down", "6 stairs down, 13 cm, 0.5 m/s", _DOWN, length=3.5),
    Way(
        "fast-stairs-down",
        "11 cm, 1 m/s, friction 0.3",
        _LOW,
        1.0,
        3.5,
        bar=0.6,
        friction=(0.3, 0.3),
        pace=0.4,
    ),
    Way("stairs-aslant", "13 cm, aslant by 20 deg", _stairs(0.13), heading=ASLANT),
    Way("slow-stairs-aslant", "the same, 0.3 m/s", _stairs(0.13), 0.3, heading=ASLANT),
    Way("blocks", "4 blocks of 14 cm, 0.5 m/s", Blocks(0.14), bar=0.9),
    Way("slope", "ramp of 22 deg up and down, 0.5 m/s", _SLOPE),
    Way("slope-back", "the same backwards", _SLOPE, -0.5, heading=math.pi),
    Way("waves", "5 waves of 8 cm, 0.5 m/s", Waves(0.08)),
    Way("boxes", "boxes up to 12 cm, 0.5 m/s", _boxes, length=3.5),
    Way("course", "random course of 12 m, 0.5 m/s", Course.drawn, bar=None),
)
_UP = Stairs(0.16, 6, 0.31)
SEEING = (
    Way("seen-stairs-13", "6 stairs up and down, 13 cm, 0.3 m/s", _stairs(0.13), 0.3),
    Way("seen-stairs-16", "16 cm", _stairs(0.16), 0.3, bar=1.0),
    Way("seen-stairs-18", "18 cm", _stairs(0.18), 0.3),
    Way("seen-stairs-20", "20 cm", _stairs(0.20), 0.3, bar=0.8),
    Way("seen-stairs-down", "18 cm down only", Stairs(0.18, 6, 0.31, way=DOWN), 0.3, 3.5),
    Way("seen-stairs-aslant", "16 cm, aslant by 20 deg", _stairs(0.16), 0.3, None, ASLANT, 0.9),
    Way("seen-stairs-turn", "16 cm up, half a turn, down", _UP, 0.3, 3.4, returns=True, bar=0.9),
    Way("depth-stairs-16", "16 cm by depth camera", _stairs(0.16), 0.3, sees="depth", bar=0.9),
    Way("seen-blocks", "4 blocks of 20 cm, 0.5 m/s", Blocks(0.20)),
    Way("seen-slope", "ramp of 22 deg up and down, 0.5 m/s", _SLOPE),
    Way("seen-gap-20", "gap of 20 cm, 0.5 m/s", Gap(0.20)),
    Way("seen-gap-30", "30 cm", Gap(0.30), bar=0.6),
    Way("seen-stones", "stones of 25 cm, 10 cm between, 0.3 m/s", Stones(), 0.3, bar=0.8),
    Way("seen-waves", "5 waves of 8 cm, 0.5 m/s", Waves(0.08), bar=1.0),
    Way("seen-boxes", "boxes up to 12 cm, 0.5 m/s", _boxes, length=3.5, bar=1.0),
    Way("seen-course", "random course of 12 m, 0.5 m/s", Course.drawn, bar=0.9),
)
SEEING = tuple(replace(way, sees=way.sees or "lidar") for way in SEEING)
BARRIERS = (
    Way("seen-wall", "wall", Blocks(0.6, count=1, start=2.0)),
    Way("seen-gap-60", "gap of 60 cm", Gap(0.6, start=2.0)),
    Way("seen-step-30", "step of 30 cm", Stairs(0.3, count=1, start=2.0)),
)
BARRIERS = tuple(replace(way, sees="lidar") for way in BARRIERS)
_ROWS = (("done", "share done", ">= 1"), ("off", "velocity off", "<= 0.25 m/s"))
REVERSALS = tuple(
    Study(name, {item: _ROWS}, measure, done="done", group="reversals")
    for name, item, measure in (
        ("flat", "reversals", measure_reversals),
        ("flat-late", "the same, 0 to 18 ms late", partial(measure_reversals, latest=LATEST)),
        ("flat-lost", "the same, 5 % lost", partial(measure_reversals, lost=0.05)),
        ("flat-slippery", "the same, friction 0.3", partial(measure_reversals, friction=0.3)),
    )
)
_STUDIES = [*(way.study for way in WAYS), *REVERSALS]
STUDIES = (*_STUDIES, *(study.sensed(study.group) for study in _STUDIES))
STUDIES += (*(way.study for way in SEEING), *(_barrier(way) for way in BARRIERS))
"""In the order of the report."""

BENCHMARK = Benchmark(
    "rough",
    "Stairs, blocks, slopes and waves, blind; reversals on level ground.",
    STUDIES,
    takes="an hour on two cores",
    examples=("--rows terrain --quick", "--rows stairs-13 sensed-stairs-13"),
)
run = BENCHMARK.run
