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
from benchmarks.study import Rows, Study, TrialResult
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.legs import Leg
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from motions import CompiledPlan, FeasibilityChecker, Timeline, compile_timeline, deg

FIRST_SEED = 6200  # Seed of the first trial that is judged
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


def measure(trial: Trial, found: TrialResult, name: str) -> None:
    """Play it, stand for a second, look what came of it."""
    plan, is_feasible = plan_of(name)
    if not is_feasible:
        raise TrialFailed("the check refuses the plan")
    model, item = RobotModel(), ITEMS[name]
    with TrialRobot(plant_of(trial, FIRST_SEED)) as robot:
        robot.require(robot.go2.stand())
        before = feet_frame(robot)
        robot.truth.clear()
        objection = "" if robot.go2.play(plan, check=False) else robot.go2.last_outcome.reason
        recorded = robot.truth.recording()
        try:
            robot.wait(AFTERWARDS)
        except TrialFailed as failed:
            raise TrialFailed(objection or str(failed)) from None
        if objection:
            raise TrialFailed(objection)
        after = feet_frame(robot)
    x, y, yaw = plan.end_pose
    moved = yaw_rotation(before.yaw).T @ (after.p_world - before.p_world)
    found.values = {
        "place": 1000.0 * math.hypot(moved[0] - x, moved[1] - y),
        "yaw": abs(math.degrees(wrap_angle(after.yaw - before.yaw - yaw))),
        "asked": float(recorded.asked_shares(model).max()),
        **loads(recorded),
    }
    if item.height is not None:
        heights = recorded.p_world_feet[:, :, 2].min(axis=1) - model.foot_radius
        found.values["height"] = 1000.0 * abs(float(heights.max()) - item.height)
    if item.counts_beats:
        found.values["beat"] = 1000.0 * _beat_error(recorded)
    if legs := list(item.in_air[0]):
        off = np.all(recorded.foot_forces[:, legs] < PRESSED, axis=1)
        found.values["air"] = _longest(recorded.time, off)


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


def _rows(item: Item) -> Rows:
    legs, least_time = item.in_air
    return (
        ("done", "done, stands 1 s later", f">= {item.done:g}"),
        ("place", "lands off its place", "<= 40 mm"),
        ("yaw", "lands off its heading", "<= 3 deg"),
        ("torque", "peak torque / motors' line", "<= 1"),
        ("asked", "asked for / motors' line", "<= 1"),
        ("speed", "peak joint speed / limit", "<= 1"),
        ("saturated", "saturated ticks", "<= 2 %"),
        *([("height", "apex off the plan", "<= 20 mm")] if item.height is not None else []),
        *([("beat", "touchdown off its beat", "<= 20 ms")] if item.counts_beats else []),
        *([("air", "feet off the ground", f">= {least_time:g} s")] if legs else []),
    )


STUDIES = tuple(
    Study(name, {item.title: _rows(item)}, partial(measure, name=name), done="done")
    for name, item in ITEMS.items()
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
