"""``python -m benchmarks qp_infeasibility``: answers where its constraints contradict it.

Blind trots over boxes, pushes that throw the robot off its stride, and legs at the ends of their
joints; random commands are in ``balance``. The limits of ``wbc.solvers`` were chosen on box
layouts 0 to 5 and six pushes; no seed of theirs is judged here.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float

from benchmarks.command import Benchmark
from benchmarks.robots import PUSH_TIME, heading_force
from benchmarks.study import Study, TrialResult
from controller.modes import Mode
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.config import Config
from go2_wbc.planning.locomotion import GREATEST_HEIGHT, LEAST_HEIGHT, LocomotionConfig
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.plant.terrain import Boxes
from go2_wbc.robot.model import RobotModel

FIRST_LAYOUT = 20  # Seed of the first layout of boxes that is judged
BOX_HEIGHT = 0.08  # m
FIRST_PUSH = 700  # Seed of the first series of pushes that is judged
IMPULSE, IMPULSE_AT_STOPS = 30.0, 20.0
"""N s of a push; and at the ends of the joints, where a trot has less room to answer."""
AT_STOP = 0.01  #: Distance [rad] from its stop at which a calf counts as there
LOOK = 0.02  #: Time [s] between two looks at whether the robot is still up
AFTERMATH = 1.0
"""Time [s] for which a robot that gave up is watched, to see whether it reports a fall."""
UPRIGHT = np.radians(30.0)
"""Tilt below which a robot that was damped had no reason to be: the limit of ``SafetyConfig``."""


def ahead(robot: TrialRobot) -> Iterator[float]:
    """A course: commands and pushes; gives the time [s] until it wants to go on."""
    robot.go2.move(1.0)
    yield 8.0


def pushed(
    robot: TrialRobot, rng: np.random.Generator, impulse: float, speed: float
) -> Iterator[float]:
    """Three horizontal pushes in any direction, at any instant of the stride."""
    robot.go2.move(speed)
    yield 1.5
    for _ in range(3):
        yield float(rng.uniform(0.0, 0.36))
        angle = rng.uniform(-np.pi, np.pi)
        robot.push(heading_force(angle, impulse), PUSH_TIME)
        yield 2.5


def commanded(robot: TrialRobot, rng: np.random.Generator, count: int) -> Iterator[float]:
    """Random velocities, ``count`` of them, a new one every 1.5 s."""
    for _ in range(count):
        linear_x, linear_y, angular_z = rng.uniform((-1.0, -0.6, -2.0), (1.5, 0.6, 2.0)).tolist()
        robot.go2.move(linear_x, angular_z, linear_y=linear_y)
        yield 1.5


ROWS = (
    ("failures", "ticks without an answer", "<= 0"),
    ("damped", "damped while upright", "<= 0"),
    ("grave", "ticks beyond the limits", "<= 0.1 %"),
    ("relaxed", "ticks relaxed", "%"),
    ("unreported", "falls not reported", "<= 0"),
    ("falls", "falls", ""),
)


def watch(robot: TrialRobot, course: Iterator[float], found: TrialResult) -> None:
    """Follow the course until its end, or until the robot gives up.

    Damped while upright is a loop that went limp at a tilt below 30 deg without calling it a fall;
    a fall counts for the controller or in truth, within a second of giving up.
    """
    go2 = robot.go2
    robot.require(go2.walk())
    robot.truth.clear()
    counts, start = go2.telemetry, robot.plant.time
    for seconds in course:
        end = robot.plant.time + seconds
        while is_up(robot) and robot.plant.time < end - 1e-9:
            go2.wait(min(LOOK, end - robot.plant.time))
        if not is_up(robot):
            break
    was_damped = go2.mode is Mode.DAMPED and robot.plant.truth().tilt < UPRIGHT
    ticks = round((robot.plant.time - start) / robot.plant.control_period)
    shares = {"grave": counts.grave_ticks, "relaxed": counts.relaxed_ticks}
    go2.wait(0.0 if is_up(robot) else AFTERMATH)
    has_fallen, is_reported = robot.truth.fall() is not None, go2.mode is Mode.FALLEN
    found.values |= {
        "failures": float(counts.qp_failures),
        "damped": float(was_damped),
        "unreported": float(has_fallen and not is_reported and not was_damped),
        "falls": float(has_fallen or is_reported),
        **{quantity: 100.0 * count / ticks for quantity, count in shares.items()},
    }


def is_up(robot: TrialRobot) -> bool:
    """Whether the controller still balances."""
    return robot.go2.mode not in (Mode.FALLEN, Mode.DAMPED)


def measure_boxes(trial: Trial, found: TrialResult) -> None:
    """Eight seconds at 1.0 m/s over boxes that the robot does not know about."""
    layout = FIRST_LAYOUT + trial.seed
    terrain = Boxes(height=BOX_HEIGHT, seed=layout)
    with TrialRobot(MujocoPlant(terrain=terrain, seed=layout, sensors=trial.sensors)) as robot:
        watch(robot, ahead(robot), found)


def measure_pushes(
    trial: Trial, found: TrialResult, impulse: float, speed: float, config: Config | None = None
) -> None:
    """Trot, and be pushed by ``impulse`` [N s]."""
    seed = FIRST_PUSH + trial.seed
    trial = replace(trial, seed=seed, has_nominal_friction=True)
    with TrialRobot(trial, config) as robot:
        watch(robot, pushed(robot, np.random.default_rng(seed), impulse, speed), found)
        if config is not None:
            distance = calf_distance(robot.truth.recording())
            found.values["near"] = 100.0 * float((distance < AT_STOP).mean())


def measure_stops(trial: Trial, found: TrialResult) -> None:
    """Trot so high that the calves come to their stops, or (odd seeds) so low; and be pushed."""
    height = (GREATEST_HEIGHT, LEAST_HEIGHT)[trial.seed % 2]
    config = Config(locomotion=LocomotionConfig(height=height))
    measure_pushes(trial, found, IMPULSE_AT_STOPS, 0.8, config)


def calf_distance(recorded: TruthRecording) -> Float[np.ndarray, " n"]:
    """Distance [rad] of the nearest calf from one of its stops, at every tick; negative beyond."""
    model, angles = RobotModel(), recorded.q[:, 7:]
    distance = np.minimum(angles - model.q_lower, model.q_upper - angles)
    return distance[:, 2::3].min(axis=1)


NEAR = ("near", "ticks, a calf at its stop", "%")
PUSHES = partial(measure_pushes, impulse=IMPULSE, speed=0.5)
STUDIES = (
    Study("boxes", {"8 cm boxes, trot 1.0 m/s, 8 s": ROWS}, measure_boxes),
    Study("pushes", {"trot 0.5 m/s, three pushes of 30 N s": ROWS}, PUSHES),
    Study("stops", {"calves at their stops, pushes of 20 N s": (*ROWS, NEAR)}, measure_stops),
)
run = Benchmark(
    "qp_infeasibility",
    "Trots on which the QP contradicts itself: is there always an answer, is the\n"
    "robot never damped while upright, how often do constraints give way too far.",
    STUDIES,
    takes="minutes on two cores",
    examples=("--rows boxes pushes --json",),
    sensors=True,
).run
