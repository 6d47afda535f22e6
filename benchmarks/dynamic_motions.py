"""``python -m benchmarks dynamic_motions``: dynamic motions, played in physics.

Jumps, hops, rears and a lifted pair from stand to stand, by torques alone. Nothing was tuned on the
seeds that are judged here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.command import Benchmark
from benchmarks.robots import feet_frame, loads, plant_of
from benchmarks.study import Direction, Measurement, Metric, Study
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.legs import Leg
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from motions import CompiledPlan, FeasibilityChecker, Timeline, compile_timeline, deg

FIRST_SEED = 6200
"""Seed of the first trial that is judged."""
AFTERWARDS = 1.0
"""Time [s] for which the robot must stand when the motion is over."""
PRESSED = 15.0
"""Force [N] on a foot from which on it has touched down: a tenth of the weight."""
FLOWN = 0.06
"""Time [s] without contact after which a contact counts as a touchdown."""
TEMPO, HOPS = 120.0, 3


@dataclass(frozen=True, slots=True)
class Item:
    """What is played, and what it must reach.

    Attributes:
        title: in the report.
        write: makes the timeline.
        height: planned height [m] of the feet, where it is judged.
        counts_beats: whether touchdowns are compared with beats.
        in_air: legs whose feet must be off the ground together, and for how long [s].
        done: share of the trials that must be done.
    """

    title: str
    write: Callable[[], Timeline]
    height: float | None = None
    counts_beats: bool = False
    in_air: tuple[tuple[Leg, ...], float] = ((), 0.0)
    done: float = 1.0


def _jump(**values: float) -> Timeline:
    return Timeline().jump(**values)


ITEMS: dict[str, Item] = {
    "up": Item("jump, feet 0.15 m up", partial(_jump, height=0.15), height=0.15),
    "forward": Item("jump 0.5 m ahead", partial(_jump, x=0.5, height=0.1)),
    "sideways": Item("jump 0.3 m to the left", partial(_jump, y=0.3, height=0.1)),
    "back": Item("jump 0.3 m back", partial(_jump, x=-0.3, height=0.1)),
    "turn": Item("jump and turn by 90 deg", lambda: Timeline().spin_jump(deg(90))),
    "hops": Item(
        "three hops to 120 beats a minute",
        lambda: Timeline().bpm(TEMPO).hop(HOPS, period=1),
        counts_beats=True,
    ),
    "rear25": Item(
        "rear up, trunk at -25 deg",
        lambda: Timeline().rear(deg(-25), hold=0.6),
        in_air=((Leg.FL, Leg.FR), 0.5),
    ),
    "rear40": Item(
        "rear up, trunk at -40 deg",
        lambda: Timeline().rear(deg(-40), hold=0.6),
        in_air=((Leg.FL, Leg.FR), 0.5),
        done=0.95,
    ),
    "pair": Item(
        "diagonal pair lifted 0.35 s",
        lambda: Timeline().lift(("FL", "RR"), hold=0.35),
        in_air=((Leg.FL, Leg.RR), 0.3),
    ),
}


@cache
def plan_of(name: str) -> tuple[CompiledPlan, bool]:
    """The plan of an item, and whether the check lets it pass; once for all trials of a process."""
    model = RobotModel()
    plan = compile_timeline(ITEMS[name].write(), model)
    return plan, FeasibilityChecker(model).check(plan).ok


def measure(trial: Trial, name: str) -> Measurement:
    """Play it, stand for a second, look what came of it."""
    plan, is_feasible = plan_of(name)
    if not is_feasible:
        return Measurement({f"{name}.done": 0.0}, reason="the check refuses the plan")
    model = RobotModel()
    try:
        played = play(plant_of(trial, FIRST_SEED), plan, model)
        if played.objection:
            raise TrialFailed(played.objection)
    except TrialFailed as failed:
        done = f"{name}.done"
        return Measurement({done: 0.0}, {done: str(failed)}, str(failed))
    return Measurement(_values(name, plan, played, model))


@dataclass(frozen=True, slots=True)
class Played:
    """What came of a plan.

    Attributes:
        recorded: while it was played.
        moved: way of the middle of the feet [m], along the heading at first.
        turned: change of their heading [rad], in (-pi, pi].
        objection: why the controller says that it was not done; empty if it was.
    """

    recorded: TruthRecording
    moved: Float[np.ndarray, "3"]
    turned: float
    objection: str

    @property
    def height(self) -> float:
        """Greatest height [m] of the lowest foot's centre above where it stood."""
        lowest = self.recorded.p_world_feet[:, :, 2].min(axis=1)
        return float(lowest.max() - lowest[0])

    def values(self, name: str, plan: CompiledPlan, model: RobotModel) -> dict[str, float]:
        """The metrics that every jump has, of the item ``name``."""
        x, y, yaw = plan.end_pose
        values = {
            "done": 1.0,
            "place": 1000.0 * math.hypot(self.moved[0] - x, self.moved[1] - y),
            "yaw": abs(math.degrees(wrap_angle(self.turned - yaw))),
            "asked": float(self.recorded.asked_shares(model).max()),
            **loads(self.recorded),
        }
        return {f"{name}.{quantity}": value for quantity, value in values.items()}


def play(plant: MujocoPlant, plan: CompiledPlan, model: RobotModel) -> Played:
    """Stand, play the plan unchecked, stand for a second.

    Raises:
        TrialFailed: if the robot falls.
    """
    with TrialRobot(plant) as robot:
        robot.require(robot.go2.stand())
        before = feet_frame(robot)
        robot.truth.clear()
        objection = "" if robot.go2.play(plan, check=False) else robot.go2.last_outcome.reason
        recorded = robot.truth.recording()
        try:
            robot.wait(AFTERWARDS)
        except TrialFailed as failed:
            raise TrialFailed(objection or str(failed)) from None
        after = feet_frame(robot)
    moved = yaw_rotation(before.yaw).T @ (after.p_world - before.p_world)
    return Played(recorded, moved, wrap_angle(after.yaw - before.yaw), objection)


def _values(name: str, plan: CompiledPlan, played: Played, model: RobotModel) -> dict[str, float]:
    values, recorded, item = played.values(name, plan, model), played.recorded, ITEMS[name]
    if item.height is not None:
        heights = recorded.p_world_feet[:, :, 2].min(axis=1) - model.foot_radius
        values[f"{name}.height"] = 1000.0 * abs(float(heights.max()) - item.height)
    if item.counts_beats:
        values[f"{name}.beat"] = 1000.0 * _beat_error(recorded)
    legs, _ = item.in_air
    if legs:
        off = np.all(recorded.foot_forces[:, list(legs)] < PRESSED, axis=1)
        values[f"{name}.air"] = _longest(recorded.time, off)
    return values


def _longest(times: Float[np.ndarray, " n"], mask: Bool[np.ndarray, " n"]) -> float:
    """Length [s] of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    runs = [times[min(end, len(times) - 1)] - times[start] for start, end in edges.reshape(-1, 2)]
    return float(max(runs, default=0.0))


def _beat_error(recorded: TruthRecording) -> float:
    """Greatest distance [s] of a touchdown of all feet from its beat; a missing one counts as 1."""
    times = recorded.time - recorded.time[0]
    flies = np.all(recorded.foot_forces < PRESSED, axis=1)
    edges = np.flatnonzero(np.diff(flies.astype(int)))
    landings = [
        float(times[end + 1])
        for start, end in pairwise(edges.tolist())
        if flies[end] and times[end] - times[start] >= FLOWN
    ]
    beat = 60.0 / TEMPO
    off = [abs(t / beat - round(t / beat)) * beat for t in landings]
    return max(off) if len(landings) == HOPS else 1.0


def metrics_of(name: str, title: str, done: float) -> list[Metric]:
    """The metrics that every jump has; ``done`` is the threshold of the trials that are done."""
    return [
        Metric(f"{name}.done", title, "done, stands 1 s later", "", done, Direction.AT_LEAST),
        Metric(f"{name}.place", title, "lands off its place", "mm", 40.0),
        Metric(f"{name}.yaw", title, "lands off its heading", "deg", 3.0),
        Metric(f"{name}.torque", title, "peak torque / motors' line", "", 1.0),
        Metric(f"{name}.asked", title, "asked for / motors' line", "", 1.0),
        Metric(f"{name}.speed", title, "peak joint speed / limit", "", 1.0),
        Metric(f"{name}.saturated", title, "saturated ticks", "%", 2.0),
    ]


def _metrics(name: str, item: Item) -> tuple[Metric, ...]:
    title, least = item.title, Direction.AT_LEAST
    found = metrics_of(name, title, item.done)
    if item.height is not None:
        found.append(Metric(f"{name}.height", title, "apex off the plan", "mm", 20.0))
    if item.counts_beats:
        found.append(Metric(f"{name}.beat", title, "touchdown off its beat", "ms", 20.0))
    legs, least_time = item.in_air
    if legs:
        found.append(Metric(f"{name}.air", title, "feet off the ground", "s", least_time, least))
    return tuple(found)


STUDIES = tuple(
    Study(name, _metrics(name, item), partial(measure, name=name)) for name, item in ITEMS.items()
)
"""In the order of the report."""


BENCHMARK = Benchmark(
    "dynamic_motions",
    "Jumps, hops, rears and lifts in physics: are they done, and where do they land.",
    STUDIES,
    takes="some minutes",
    examples=("--rows up turn --json",),
    sensors=True,
)
register, run = BENCHMARK.register, BENCHMARK.run
