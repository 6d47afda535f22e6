"""``python -m benchmarks balance``: pushes, drops, changes of gait, and whether a fall is noticed.

Every row twice, with the true state and (``sensed-``) with what the robot's own sensors tell, and
MuJoCo judges. Motors with their torque-speed line, friction 0.6 to 1.0 (drops: 0.4 to 1.0), masses
within 10 %, of which the controller is not told. Numbers were chosen on seeds 0 to 9, from 9000 and
from 30000 to 63999; those judged begin at ``FIRST_SEED``.

- standing: a push of 0.1 s in each of eight directions, 36 N s aside, 45 ahead and back, on an
  ellipse in between; survived is who stands again within 3 s;
- trotting: a push of 0.1 s at 16 phases of the stride, at 0.5 m/s; survived as in ``behaviour``;
- recover: limp, any attitude, any joint angles, up to 0.5 m above the ground;
- gaits: ten changes to a random gait, or stops, with a random velocity in its envelope;
- commands: random velocities ahead, aside and turning for two minutes, a new one every 1.5 s;
- disturbed: random calls and velocities under random pushes, recovering from every fall; see
  ``benchmarks.disturbed``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks import disturbed
from benchmarks.command import Benchmark
from benchmarks.locomotion import MASS_RANGE
from benchmarks.qp_infeasibility import commanded
from benchmarks.robots import PUSH_TIME, heading_force, plant_of
from benchmarks.study import Direction, Measurement, Metric, Study, sensed
from controller.checks import is_standing
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityEnvelope
from go2_wbc.planning.envelopes import envelope_of
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel

FIRST_SEED = 64000
"""Seed of the first trial that is judged, but of disturbed runs, which have their own."""
ASIDE, AHEAD = 36.0, 45.0
"""Impulses [N s] on the standing robot."""
DIRECTIONS, PHASES = 8, 16
STANDING_LIMIT = 3.0
"""Time [s] after a push in which the robot must stand again."""
LOOK = 0.05
"""Time [s] between two looks at the robot."""
CALM = 0.2
"""Time [s] for which it must stand."""
TROT_PUSHES = {"lateral": (math.pi / 2, 26.0), "forward": (0.0, 50.0), "backward": (math.pi, 42.0)}
"""Direction [rad] and impulse [N s]."""
TROT_SPEED, SPEED_TOLERANCE, TROT_TIME = 0.5, 0.15, 2.0
"""m/s, m/s, and the time [s] after a push within which it trots again."""
DROP_FRICTION = (0.4, 1.0)
DROP_HEIGHT = (0.1, 0.5)
"""Height [m] of the lowest point of the robot over the floor."""
DROP_TIME = 1.0
"""Time [s] for which the limp robot falls before ``recover()``."""
GENTLE = VelocityEnvelope(forward=1.2, backward=1.2, lateral=0.5, turning=1.5)
"""Of the trot's changes; those of the other gaits are in proportion."""
CHANGES = 10
COMMANDS = 80
"""Random velocities of a run, two minutes of them."""


def impulse_at(angle: float) -> float:
    """Impulse [N s] of the standing robot's push in this direction."""
    return 1.0 / math.hypot(math.cos(angle) / AHEAD, math.sin(angle) / ASIDE)


def measure_standing(trial: Trial, direction: int) -> Measurement:
    """Push the standing robot in one direction."""
    name, angle = f"stand-{45 * direction}", 2.0 * math.pi * direction / DIRECTIONS
    with TrialRobot(plant_of(trial, FIRST_SEED, MASS_RANGE)) as robot:
        robot.require(robot.go2.stand())
        start, since = robot.plant.time, math.inf
        try:
            robot.push(heading_force(angle, impulse_at(angle)), PUSH_TIME)
            while robot.plant.time - start < STANDING_LIMIT:
                robot.wait(LOOK)
                stands = is_standing(RobotModel().snapshot(robot.plant.truth()))
                since = min(since, robot.plant.time) if stands else math.inf
        except TrialFailed as failed:
            return Measurement({name: 0.0}, notes={name: str(failed)})
    return Measurement({name: float(since <= start + STANDING_LIMIT - CALM)})


def measure_trotting(trial: Trial, push: str) -> Measurement:
    """Push the trotting robot at every phase; the share of phases that it survives."""
    angle, impulse = TROT_PUSHES[push]
    survived = 0
    for phase in range(PHASES):
        side = 1.0 if phase % 2 or push != "lateral" else -1.0
        with TrialRobot(plant_of(trial, FIRST_SEED, MASS_RANGE)) as robot:
            survived += trots_on(robot, phase, heading_force(side * angle, impulse))
    return Measurement({f"trot-{push}": survived / PHASES})


def trots_on(robot: TrialRobot, phase: int, force: np.ndarray) -> bool:
    """Whether a robot that is pushed by ``force`` [N] at a ``phase`` of its trot trots on."""
    period = GAITS["trot"].period
    robot.require(robot.go2.stand())
    robot.require(robot.go2.walk())
    robot.go2.move(TROT_SPEED)
    try:
        robot.wait(TROT_TIME + phase * period / PHASES)
        robot.push(force, PUSH_TIME)
        robot.wait(TROT_TIME)
    except TrialFailed:
        return False
    strides = robot.truth.recording(since=robot.plant.time - 2.0 * period)
    speed = float(strides.com_velocity[:, 0].mean())
    return abs(speed - TROT_SPEED) < SPEED_TOLERANCE


def dropped(seed: int, sensors: str = "ideal") -> MujocoPlant:
    """A robot in the air, in any attitude, with any joint angles."""
    rng, model = np.random.default_rng(seed), RobotModel()
    friction, mass = float(rng.uniform(*DROP_FRICTION)), float(rng.uniform(*MASS_RANGE))
    plant = MujocoPlant(friction=friction, mass_scale=mass, seed=seed, sensors=sensors)
    q = np.concatenate(
        [[0.0, 0.0, 1.0], rng.normal(size=4), rng.uniform(model.q_lower, model.q_upper)]
    )
    plant.place(q)
    lowest = plant.data.geom_xpos[plant.model.geom_bodyid > 0, 2].min()
    q[2] += rng.uniform(*DROP_HEIGHT) - lowest
    plant.place(q)
    return plant


def measure_recovery(trial: Trial) -> Measurement:
    """Drop the limp robot and let it get up."""
    with TrialRobot(dropped(FIRST_SEED + trial.seed, trial.sensors)) as robot:
        robot.go2.wait(DROP_TIME)
        said = robot.go2.recover()
        is_up = said and robot.truth.fall() is None
        stands = is_up and is_standing(RobotModel().snapshot(robot.plant.truth()))
        notes = {} if stands else {"recover": robot.go2.last_outcome.reason}
    return Measurement({"recover": float(stands)}, notes=notes)


def measure_gaits(trial: Trial) -> Measurement:
    """Change the gait, or stop, again and again."""
    rng, done = np.random.default_rng(FIRST_SEED + trial.seed), 0
    with TrialRobot(plant_of(trial, FIRST_SEED, MASS_RANGE)) as robot:
        robot.require(robot.go2.stand())
        robot.require(robot.go2.walk())
        try:
            for _ in range(CHANGES):
                _change(robot, rng)
                done += 1
        except TrialFailed as failed:
            return Measurement({"gaits": done / CHANGES}, notes={"gaits": str(failed)})
    return Measurement({"gaits": 1.0})


def _change(robot: TrialRobot, rng: np.random.Generator) -> None:
    """A stop, or another gait at a velocity in its envelope; then some time."""
    if rng.random() < 0.2:
        robot.go2.stop()
    else:
        gait = GAITS[str(rng.choice(list(GAITS)))]
        robot.require(robot.go2.walk(gait))
        most = envelope_of(gait, GENTLE)
        bounds = most.forward, most.lateral, most.turning
        x, y, turn = rng.uniform(-1.0, 1.0, 3) * bounds
        robot.go2.move(x, turn, linear_y=y)
    robot.wait(float(rng.uniform(0.3, 1.5)))


def measure_commands(trial: Trial) -> Measurement:
    """Follow random velocities; ticks in which the QP had no answer are counted."""
    rng, done = np.random.default_rng(FIRST_SEED + trial.seed), 0
    with TrialRobot(plant_of(trial, FIRST_SEED, MASS_RANGE)) as robot:
        robot.require(robot.go2.stand())
        robot.require(robot.go2.walk())
        counts, why = robot.go2.telemetry, ""
        try:
            for seconds in commanded(robot, rng, COMMANDS):
                robot.wait(seconds)
                robot.truth.clear()  # two minutes' recording would be two gigabytes
                done += 1
        except TrialFailed as failed:
            why = str(failed)
        failures = float(counts.qp_failures)
    values = {"commands": done / COMMANDS, "commands.failures": failures}
    return Measurement(values, notes={"commands": why} if why else {})


def _study(
    name: str,
    item: str,
    quantity: str,
    measure: Callable[[Trial], Measurement],
    *more: Metric,
    least: float = 1.0,
    times: int = 1,
) -> Study:
    """A row whose value is a share, and what is told besides."""
    share = Metric(name, item, quantity, "", least, Direction.AT_LEAST)
    return Study(name, (share, *more), measure, times, "truth")


_STANDING = f"standing, push 0.1 s, {ASIDE:g} N s aside, {AHEAD:g} ahead"
_TROT = f"trot {TROT_SPEED:g} m/s, push 0.1 s, 16 phases"
_COMMANDS = "random commands, 120 s"
ON_TRUTH = (
    *(
        _study(
            f"stand-{45 * k}",
            _STANDING,
            f"survived at {45 * k} deg",
            partial(measure_standing, direction=k),
        )
        for k in range(DIRECTIONS)
    ),
    *(
        _study(
            f"trot-{push}",
            _TROT,
            f"{push} {impulse:g} N s survived",
            partial(measure_trotting, push=push),
        )
        for push, (_, impulse) in TROT_PUSHES.items()
    ),
    _study("recover", "drops", "stand again", measure_recovery, least=0.98, times=10),
    _study("gaits", "ten changes of gait and stops", "done", measure_gaits),
    _study(
        "commands",
        _COMMANDS,
        "followed without a fall",
        measure_commands,
        Metric("commands.failures", _COMMANDS, "ticks without an answer", "", 0.0),
    ),
    disturbed.STUDY,
)
STUDIES = (*ON_TRUTH, *(sensed(study, "sensors") for study in ON_TRUTH))
"""In the order of the report."""


BENCHMARK = Benchmark(
    "balance",
    "Pushes, drops, changes of gait, and whether a fall is noticed.",
    STUDIES,
    examples=(
        "--rows sensors",
        "--rows recover sensed-recover",
    ),
    more_seeds="; times 10 for drops, 50 for disturbed runs",
)
register, run = BENCHMARK.register, BENCHMARK.run
