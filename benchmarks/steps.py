"""``python -m benchmarks steps``: where authored steps end, against where they were to end.

Random steps to new places, and walks with turns and raised paws, one and three after another. The
gaits were chosen by the check and on two runs on the nominal floor; no
seed of theirs is judged here.
"""

import math
from functools import cache, partial

import numpy as np

from benchmarks.command import Benchmark
from benchmarks.robots import feet_frame, loads, plant_of
from benchmarks.study import Study, TrialResult
from controller.motion_measurement import FULL
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.legs import LEGS
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from motions import CompiledPlan, Timeline, compile_timeline, deg

FIRST_SEED = 4100  # Seed of the first trial that is judged
STEP_AHEAD, STEP_ASIDE = 0.06, 0.03
"""Greatest way [m] of a random step, in either direction."""
ROUNDS = 3  # Times that a walk is played


def random_steps(rng: np.random.Generator) -> Timeline:
    """Every foot steps once, in any order, to any place nearby."""
    line = Timeline(name="random steps")
    for leg in rng.permutation(4).tolist():
        x, y = rng.uniform((-STEP_AHEAD, -STEP_ASIDE), (STEP_AHEAD, STEP_ASIDE)).tolist()
        line = line.step(LEGS[leg], x, y, over=float(rng.uniform(0.4, 0.8)))
    return line.home(over=0.8)


def walk_with_paws(gait: str) -> Timeline:
    """2 m with two turns of 90 deg, and three raised paws."""
    line = Timeline(name=f"{gait} with paws").walk(x=0.7, gait=gait)
    line = _paw(line, "FR").turn(deg(90), gait=gait).walk(x=0.6, gait=gait)
    line = _paw(line, "FL").turn(deg(-90), gait=gait).walk(x=0.7, gait=gait)
    return _paw(line, "FR").home(over=0.8)


def _paw(line: Timeline, leg: str) -> Timeline:
    return line.foot(leg, x=0.06, z=0.12, over=0.7).hold(0.3).down(leg, over=0.6).home(over=0.6)


def play(robot: TrialRobot, plan: CompiledPlan) -> dict[str, float]:
    """Play ``plan``; how far a foot is off its place at the end, at most [mm], and ``loads``.

    Saturated is the share [%] of ticks in which any motor gave all it has.

    Raises:
        TrialFailed: if the robot falls, or says that it has not done it.
    """
    model = RobotModel()
    anchor = feet_frame(robot)
    robot.truth.clear()
    robot.require(robot.go2.play(plan, check=False))
    recorded = robot.truth.recording()
    wanted = plan.at(plan.duration).placed(anchor).p_world_feet
    off = recorded.p_world_feet[-1] - wanted
    shares = recorded.torque_shares(model)
    full = (shares >= FULL).any(axis=tuple(range(1, shares.ndim)))
    return {
        "place": 1000.0 * float(np.linalg.norm(off[:, :2], axis=1).max()),
        **loads(recorded),
        "saturated": 100.0 * float(full.mean()),
    }


def onwards(anchor: Anchor, pose: tuple[float, float, float]) -> Anchor:
    """The frame at ``pose`` (x, y [m], yaw [rad]) in another one."""
    x, y, yaw = pose
    p = anchor.p_world + yaw_rotation(anchor.yaw) @ np.array([x, y, 0.0])
    return Anchor(p, anchor.yaw + yaw)


def measure_steps(trial: Trial, found: TrialResult) -> None:
    """Random steps, twice: of the feet's final places, the one that is farthest off."""
    rng = np.random.default_rng(10 * FIRST_SEED + trial.seed)
    line, model = random_steps(rng), RobotModel()
    with TrialRobot(plant_of(trial, FIRST_SEED)) as robot:
        robot.require(robot.go2.stand())
        played = play(robot, compile_timeline(line, model))
    found.values = {name: played[name] for name, *_ in STEP}


def measure_walk(trial: Trial, found: TrialResult, gait: str) -> None:
    """The walk three times in a row: where it ends, against where it was to end."""
    plan = _walk(gait)
    off: list[tuple[float, float]] = []
    runs: list[dict[str, float]] = []
    with TrialRobot(plant_of(trial, FIRST_SEED)) as robot:
        robot.require(robot.go2.stand())
        predicted, found.values["done"] = feet_frame(robot), 0.0
        for number in range(1, ROUNDS + 1):
            runs.append(play(robot, plan))
            predicted, ended = onwards(predicted, plan.end_pose), feet_frame(robot)
            place = float(np.linalg.norm((ended.p_world - predicted.p_world)[:2]))
            off.append((1000.0 * place, math.degrees(abs(wrap_angle(ended.yaw - predicted.yaw)))))
            found.values["done"] = number / ROUNDS
    found.values |= {name: max(run[name] for run in runs) for name in runs[0].keys() - {"place"}}
    for number in (1, ROUNDS):
        found.values[f"place{number}"], found.values[f"yaw{number}"] = off[number - 1]


@cache
def _walk(gait: str) -> CompiledPlan:
    """The walk, compiled once for all trials of a process: it depends on nothing of theirs."""
    return compile_timeline(walk_with_paws(gait), RobotModel())


STEP = (
    ("place", "worst foot off its place", "<= 15 mm"),
    ("torque", "peak torque / limit", "<= 1"),
    ("saturated", "saturated ticks", "<= 2 %"),
)
WALK = (
    ("done", "share of three walks done", ">= 1"),
    ("place1", "end off its prediction", "<= 50 mm"),
    ("yaw1", "heading off it", "<= 4 deg"),
    ("place3", "end off, after three", "<= 50 mm"),
    ("yaw3", "heading off, after three", "<= 4 deg"),
    ("torque", "peak torque / limit", "<= 1"),
    ("speed", "peak joint speed / limit", "<= 1"),
    ("saturated", "saturated ticks", "<= 2 %"),
)
STUDIES = (
    Study("step", {"four random steps": STEP}, measure_steps),
    *(
        Study(
            gait,
            {f"{gait} 2 m, two turns of 90 deg, three paws": WALK},
            partial(measure_walk, gait=gait),
            done="done",
        )
        for gait in ("walk", "trot")
    ),
)
"""In the order of the report."""


BENCHMARK = Benchmark(
    "steps",
    "Authored steps and walks: where do they end, against where they were to end.",
    STUDIES,
    takes="minutes on two cores",
    examples=("--rows step --json",),
    sensors=True,
)
register, run = BENCHMARK.register, BENCHMARK.run
