"""``python -m benchmarks balance``: pushes, drops, changes of gait, and whether a fall is noticed.

Every row twice, with the true state and (``sensed-``) with what the robot's own sensors tell, and
MuJoCo judges. Motors with their torque-speed line, friction 0.6 to 1.0 (drops: 0.4 to 1.0), masses
within 10 %, of which the controller is not told. Numbers were chosen on seeds 0 to 9, from 9000 and
from 30000 to 63999; those judged begin at ``FIRST_SEED``.

- standing: impulses of the directions lie on an ellipse; survived is who stands again within 3 s;
- trotting: survived is who still trots two seconds later, at about its speed;
- recover: limp, any attitude, any joint angles, up to 0.5 m above the ground;
- disturbed: see ``benchmarks.disturbed``.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks import disturbed
from benchmarks.command import Benchmark
from benchmarks.qp_infeasibility import commanded
from benchmarks.robots import PUSH_TIME, UNTOLD, heading_force, plant_of
from benchmarks.study import Study, TrialResult
from controller.modes import is_standing
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot, set_off
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand, VelocityEnvelope
from go2_wbc.planning.envelopes import envelope_of
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel

FIRST_SEED = 64000
"""Seed of the first trial that is judged, but of disturbed runs, which have their own."""
ASIDE, AHEAD = 36.0, 45.0  # Impulses [N s] on the standing robot
DIRECTIONS, PHASES = 8, 16
STANDING_LIMIT = 3.0  #: Time [s] after a push in which the robot must stand again
LOOK = 0.05  # Time [s] between two looks at the robot
CALM = 0.2  # Time [s] for which it must stand
TROT_PUSHES = {"lateral": (math.pi / 2, 26.0), "forward": (0.0, 50.0), "backward": (math.pi, 42.0)}
"""Direction [rad] and impulse [N s]."""
TROT_SPEED, SPEED_TOLERANCE, TROT_TIME = 0.5, 0.15, 2.0
"""m/s, m/s, and the time [s] after a push within which it trots again."""
STRIDE = GAITS["trot"].period  # [s]
DROP_FRICTION = (0.4, 1.0)
DROP_HEIGHT = (0.1, 0.5)  #: Height [m] of the lowest point of the robot over the floor
DROP_TIME = 1.0  #: Time [s] for which the limp robot falls before ``recover()``
GENTLE = VelocityEnvelope(forward=1.2, backward=1.2, lateral=0.5, turning=1.5)
"""Of the trot's changes; those of the other gaits are in proportion."""
CHANGES = 10
COMMANDS = 80  # Random velocities of a run, two minutes of them
Course = Callable[[TrialRobot, np.random.Generator, int], Iterator[float]]
"""Does a number of things, and gives the time [s] that passes after each."""


def impulse_at(angle: float) -> float:
    """Impulse [N s] of the standing robot's push in this direction."""
    return 1.0 / math.hypot(math.cos(angle) / AHEAD, math.sin(angle) / ASIDE)


def measure_standing(trial: Trial, found: TrialResult, direction: int) -> None:
    """Push the standing robot in one direction."""
    angle = 2.0 * math.pi * direction / DIRECTIONS
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        robot.require(robot.go2.stand())
        start, since = robot.plant.time, math.inf
        try:
            robot.push(heading_force(angle, impulse_at(angle)), PUSH_TIME)
            while robot.plant.time - start < STANDING_LIMIT:
                robot.wait(LOOK)
                stands = is_standing(RobotModel().snapshot(robot.plant.truth()))
                since = min(since, robot.plant.time) if stands else math.inf
        except TrialFailed as failed:
            since, found.notes[""] = math.inf, str(failed)
    found.values[""] = float(since <= start + STANDING_LIMIT - CALM)


def measure_trotting(trial: Trial, found: TrialResult, push: str) -> None:
    """Push the trotting robot at every phase."""
    found.values[""] = share_of_phases(trial, FIRST_SEED, push, trots_on)


def share_of_phases(
    trial: Trial, first_seed: int, push: str, goes_on: Callable[[TrialRobot, int, np.ndarray], bool]
) -> float:
    """The share of the phases of the stride at which a robot goes on under a push [N]."""
    angle, impulse = TROT_PUSHES[push]
    survived = 0
    for phase in range(PHASES):
        side = 1.0 if phase % 2 or push != "lateral" else -1.0
        with TrialRobot(plant_of(trial, first_seed, UNTOLD)) as robot:
            survived += goes_on(robot, phase, heading_force(side * angle, impulse))
    return survived / PHASES


def trots_on(robot: TrialRobot, phase: int, force: np.ndarray) -> bool:
    """Whether a robot that is pushed by ``force`` [N] at a ``phase`` of its trot trots on."""
    set_off(robot, "trot", VelocityCommand(TROT_SPEED))
    if not stays_up(robot, phase, force):
        return False
    strides = robot.truth.recording(since=robot.plant.time - 2.0 * STRIDE)
    speed = float(strides.com_velocity[:, 0].mean())
    return abs(speed - TROT_SPEED) < SPEED_TOLERANCE


def stays_up(robot: TrialRobot, phase: int, force: np.ndarray) -> bool:
    """Whether a robot that trots stays up under a push by ``force`` [N] at a ``phase``."""
    try:
        robot.wait(TROT_TIME + phase * STRIDE / PHASES)
        robot.push(force, PUSH_TIME)
        robot.wait(TROT_TIME)
    except TrialFailed:
        return False
    return True


def dropped(seed: int, sensors: str = "ideal") -> MujocoPlant:
    """A robot in the air, in any attitude, with any joint angles."""
    rng, model = np.random.default_rng(seed), RobotModel()
    friction, mass = float(rng.uniform(*DROP_FRICTION)), float(rng.uniform(*UNTOLD))
    plant = MujocoPlant(friction=friction, mass_scale=mass, seed=seed, sensors=sensors)
    q = np.concatenate(
        [[0.0, 0.0, 1.0], rng.normal(size=4), rng.uniform(model.q_lower, model.q_upper)]
    )
    plant.place(q)
    lowest = plant.data.geom_xpos[plant.model.geom_bodyid > 0, 2].min()
    q[2] += rng.uniform(*DROP_HEIGHT) - lowest
    plant.place(q)
    return plant


def measure_recovery(trial: Trial, found: TrialResult) -> None:
    """Drop the limp robot and let it get up."""
    with TrialRobot(dropped(FIRST_SEED + trial.seed, trial.sensors)) as robot:
        robot.go2.wait(DROP_TIME)
        said = robot.go2.recover()
        is_up = said and robot.truth.fall() is None
        stands = is_up and is_standing(RobotModel().snapshot(robot.plant.truth()))
        found.values[""] = float(stands)
        if not stands:
            found.notes[""] = robot.go2.last_outcome.reason


def changing(robot: TrialRobot, rng: np.random.Generator, count: int) -> Iterator[float]:
    """A stop, or another gait at a velocity in its envelope; then some time."""
    for _ in range(count):
        if rng.random() < 0.2:
            robot.go2.stop()
        else:
            gait = GAITS[str(rng.choice(list(GAITS)))]
            robot.require(robot.go2.walk(gait))
            most = envelope_of(gait, GENTLE)
            x, y, turn = rng.uniform(-1.0, 1.0, 3) * (most.forward, most.lateral, most.turning)
            robot.go2.move(x, turn, linear_y=y)
        yield float(rng.uniform(0.3, 1.5))


def measure_course(trial: Trial, found: TrialResult, course: Course, count: int) -> None:
    """The share of a course's ``count`` parts that are done, and how often the QP had no answer."""
    rng, done = np.random.default_rng(FIRST_SEED + trial.seed), 0
    with TrialRobot(plant_of(trial, FIRST_SEED, UNTOLD)) as robot:
        robot.require(robot.go2.walk())
        try:
            for seconds in course(robot, rng, count):
                robot.wait(seconds)
                robot.truth.clear()  # two minutes' recording would be two gigabytes
                done += 1
        except TrialFailed as failed:
            found.notes[""] = str(failed)
        found.values |= {"": done / count, "failures": robot.go2.telemetry.qp_failures}


_STANDING = f"standing, push 0.1 s, {ASIDE:g} N s aside, {AHEAD:g} ahead"
_TROT = f"trot {TROT_SPEED:g} m/s, push 0.1 s, 16 phases"
_ALL = ">= 1"
ON_TRUTH = (
    *(
        Study(
            f"stand-{45 * k}",
            {_STANDING: [("", f"survived at {45 * k} deg", _ALL)]},
            partial(measure_standing, direction=k),
        )
        for k in range(DIRECTIONS)
    ),
    *(
        Study(
            f"trot-{push}",
            {_TROT: [("", f"{push} {impulse:g} N s survived", _ALL)]},
            partial(measure_trotting, push=push),
        )
        for push, (_, impulse) in TROT_PUSHES.items()
    ),
    Study("recover", {"drops": [("", "stand again", ">= 0.98")]}, measure_recovery, seed_factor=10),
    Study(
        "gaits",
        {"ten changes of gait and stops": [("", "done", _ALL)]},
        partial(measure_course, course=changing, count=CHANGES),
    ),
    Study(
        "commands",
        {
            "random commands, 120 s": (
                ("", "followed without a fall", _ALL),
                ("failures", "ticks without an answer", "<= 0"),
            )
        },
        partial(measure_course, course=commanded, count=COMMANDS),
    ),
    disturbed.STUDY,
)
STUDIES = (
    *(replace(study, group="truth") for study in ON_TRUTH),
    *(study.sensed("sensors") for study in ON_TRUTH),
)

run = Benchmark(
    "balance",
    "Pushes, drops, changes of gait, and whether a fall is noticed.\n"
    "Drops take 10 times the seeds, disturbed runs 50 times.",
    STUDIES,
    examples=("--rows sensors", "--rows recover sensed-recover"),
).run
