"""``python -m benchmarks nearest``: of motions that the check refuses, the nearest that is not.

Each seed gives one motion that is refused as it is written, for it asks for something that no
quasi-static motion can do, within what a person might write. The nearest one is planned, and played
in physics, by torques alone, on a robot and a floor of the seed's. How far the trunk was from what
was written, at most, is measured and compared with the check's report.

The planner, and how plans are met, were worked on with the motions of seeds 1000 to 1039, and those
of 7300 to 7319 had been seen before the last settings were chosen; none of those that are judged
here was looked at before.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from benchmarks.command import Benchmark
from benchmarks.robots import loads, plant_of
from benchmarks.study import Study, TrialResult
from controller.motion_measurement import during_motion
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.errors import MotionError, MotionInfeasible
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from motions import CheckedMotion, CompiledPlan, FeasibilityChecker, FeasibilityReport, Timeline
from motions.dynamics.projection import PlanTarget, nearest
from motions.language.timeline_data import NEAREST
from motions.plan.dynamic_span import DynamicSpan
from motions.plan.trajectory import as_written

FIRST_SEED, ROBOTS = 8600, 6200  # Seeds of the first motion that is judged, and of its robot
AFTERWARDS = 1.0
"""Time [s] for which the robot must stand when the motion is over."""
AS_REPORTED = 10.0
"""Difference [mm] between the measured and the reported deviation, of every motion."""
LARGEST = {"x": 0.05, "y": 0.05, "z": 0.05, "roll": 0.25, "pitch": 0.25, "yaw": 0.35}
"""Greatest offset of the trunk [m, rad] by channel."""
DIAGONALS = (("FL", "RR"), ("FR", "RL"))
FRONT = ("FL", "FR")
ATTEMPTS = 40
"""Draws after which a kind that the check never refuses is a mistake of ours."""
Maker = Callable[[np.random.Generator], Timeline]
ROWS = (
    ("found", "plan found", ">= 80 %"),
    ("done", "done, stands 1 s later", ">= 1"),
    ("as_reported", "off what was reported", f"<= {AS_REPORTED:g} mm"),
    ("reported", "trunk off, as reported", "mm"),
    ("measured", "trunk off, as measured", "mm"),
    ("angle", "turned off, as reported", "deg"),
    ("angle_measured", "turned off, as measured", "deg"),
    ("lag", "late, as reported", "ms"),
    ("cpu", "planning from cold", "<= 4 s"),
    ("torque", "peak torque / limit", "<= 1"),
    ("speed", "peak joint speed / limit", "<= 1"),
    ("saturated", "saturated ticks", "<= 2 %"),
)


def measure(trial: Trial, found: TrialResult) -> None:
    """Plan the nearest to one refused motion, and play it."""
    model, seed = RobotModel(), FIRST_SEED + trial.seed
    checker = FeasibilityChecker(model)
    checked = checker.evaluate(refused_motion(seed, checker).nearest)
    try:
        checked.report.raise_if_infeasible()
    except MotionInfeasible as error:
        found.values["found"] = 0.0
        found.not_asked = dict.fromkeys((name for name, *_ in ROWS[1:]), str(error))
        return
    found.values |= {"found": 100.0, "cpu": planning_time(checked, model)}
    found.values["reported"] = reported_worst(checked.report, "off by")
    found.values["angle"] = reported_worst(checked.report, "turned off by")
    lags = (span.trajectory.lag for span in spans_of(checked))
    found.values["lag"] = 1000.0 * max(lags, key=abs)
    try:
        found.values |= play(trial, checked, model)
    except TrialFailed as failed:
        found.values["done"], found.failures["done"] = 0.0, str(failed)
        raise
    off = abs(found.values["measured"] - found.values["reported"])
    found.values |= {"done": 1.0, "as_reported": off}
    if off > AS_REPORTED:
        found.failures["as_reported"] = f"{off:.1f} mm"


def planning_time(checked: CheckedMotion, model: RobotModel) -> float:
    """Processor time [s] of solving all that had to be, which was done before: nothing is new."""
    before = time.process_time()
    for span in spans_of(checked):
        if isinstance(span.asked, PlanTarget):
            nearest(span.asked, model, tolerance=span.tolerance)
    return time.process_time() - before


def reported_worst(report: FeasibilityReport, check: str) -> float:
    """The trunk's worst value in one check of the report, in its unit."""
    (series,) = (item for item in report.series if item.check == check)
    return float(np.max(series.values[:, series.subjects.index("trunk")]))


def play(trial: Trial, checked: CheckedMotion, model: RobotModel) -> dict[str, float]:
    """Play it from a stand, and stand for a second; what was measured, by row.

    Raises:
        TrialFailed: if the robot falls, or says that it has not done it.
    """
    with TrialRobot(plant_of(trial, ROBOTS)) as robot:
        robot.require(robot.go2.stand())
        robot.truth.clear()
        robot.require(robot.go2.play(checked))
        recorded = during_motion(robot.go2, robot.truth, checked.plan.name)
        robot.wait(AFTERWARDS)
    place, angle = off_written(recorded, checked, model)
    return {"measured": 1000.0 * place, "angle_measured": math.degrees(angle), **loads(recorded)}


def off_written(
    recorded: TruthRecording, checked: CheckedMotion, model: RobotModel
) -> tuple[float, float]:
    """Greatest distance [m] and angle [rad] of the trunk from what was written for that instant.

    In the frame of the feet as they stood at the start; over the whole motion, solved or not.
    """
    written, times = as_written(checked.plan, checked.path), checked.path.times
    now = np.clip(recorded.time - recorded.time[0], 0.0, times[-1])
    wanted = np.column_stack([np.interp(now, times, column) for column in written.T[:3]])
    anchor = Anchor.of_feet(recorded.p_world_feet[0].copy(), model.foot_radius)
    turn = Rotation.from_euler("z", -anchor.yaw)
    away = turn.apply(recorded.q[:, :3] - anchor.p_world) - wanted
    measured = turn * Rotation.from_quat(recorded.q[:, 3:7])
    asked = Slerp(times, Rotation.from_quat(written[:, 3:7]))(now)
    angles = (asked.inv() * measured).magnitude()
    return float(np.linalg.norm(away, axis=1).max()), float(angles.max())


def spans_of(checked: CheckedMotion) -> tuple[DynamicSpan, ...]:
    """The parts of the plan that were solved."""
    return checked.plan.dynamic if isinstance(checked.plan, CompiledPlan) else ()


# --- motions that are refused ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class RefusedMotion:
    """A motion with its origin.

    Attributes:
        kind: the maker's name.
        line: as it is written, with ``physics="as_written"``.
    """

    kind: str
    line: Timeline

    @property
    def nearest(self) -> Timeline:
        """The same, of which the nearest feasible motion is asked."""
        return replace(self.line, physics=NEAREST)


def refused_motion(seed: int, checker: FeasibilityChecker) -> RefusedMotion:
    """The motion of ``seed``: kinds take turns, numbers are drawn until the check refuses it.

    Raises:
        MotionError: if ``ATTEMPTS`` draws of the kind are all feasible.
    """
    kind, make = list(KINDS.items())[seed % len(KINDS)]
    rng = np.random.default_rng([seed, 11])
    for _ in range(ATTEMPTS):
        line = replace(make(rng), name=f"refused {seed}")
        if not checker.check(line).ok:
            return RefusedMotion(kind, line)
    raise MotionError(f"{ATTEMPTS} motions of the kind {kind!r} are feasible")


def _poses(rng: np.random.Generator, over: float) -> Timeline:
    """Two or three quick poses of the trunk on four feet."""
    line = Timeline()
    for _ in range(int(rng.integers(2, 4))):
        line = _moved(line, rng, over)
    return line.home(over=1.5 * over)


def _moved(line: Timeline, rng: np.random.Generator, over: float) -> Timeline:
    """To a pose that differs in two channels."""
    chosen = rng.choice(list(LARGEST), size=2, replace=False).tolist()
    pose = {name: float(rng.uniform(-1.0, 1.0)) * LARGEST[name] for name in chosen}
    x, y, z, roll, pitch, yaw = (pose.get(channel) for channel in LARGEST)
    return line.body(x=x, y=y, z=z, roll=roll, pitch=pitch, yaw=yaw, over=over)


def _quick_trunk(rng: np.random.Generator) -> Timeline:
    return Timeline().hold(0.2).then(_poses(rng, float(rng.uniform(0.12, 0.24)))).hold(0.2)


def _pair(rng: np.random.Generator) -> Timeline:
    """Two diagonal feet up and down; half of the authors let the trunk be balanced."""
    first, second = DIAGONALS[int(rng.integers(2))]
    up, down, z = float(rng.uniform(0.15, 0.25)), float(rng.uniform(0.15, 0.25)), rng.uniform
    line = Timeline(balance=bool(rng.random() < 0.5), shift_time=0.3).hold(0.3)
    line = line.foot(first, z=float(z(0.03, 0.07)), over=up).also()
    line = line.foot(second, z=float(z(0.03, 0.07)), over=up).hold(float(rng.uniform(0.02, 0.2)))
    line = line.down(first, over=down).also().down(second, over=down)
    return line.home(over=0.4).hold(0.3)


def _pair_while_moving(rng: np.random.Generator) -> Timeline:
    """Two diagonal feet up and down while the trunk goes to a pose and back."""
    first, second = DIAGONALS[int(rng.integers(2))]
    z, over = float(rng.uniform(0.03, 0.06)), float(rng.uniform(0.2, 0.3))
    feet = Timeline(balance=False).foot(first, z=z, over=over).also().foot(second, z=z, over=over)
    feet = feet.down(first, over=over).also().down(second, over=over)
    trunk = _moved(Timeline(), rng, 2.0 * over)
    return Timeline(balance=False).hold(0.2).together(feet, trunk).home(over=0.5).hold(0.3)


def _early_paw(rng: np.random.Generator) -> Timeline:
    """A front paw that is raised before the trunk is over the other feet."""
    leg, over = FRONT[int(rng.integers(2))], float(rng.uniform(0.2, 0.35))
    line = Timeline(balance=bool(rng.random() < 0.5), shift_time=float(rng.uniform(0.1, 0.2)))
    line = line.hold(0.2).foot(leg, x=float(rng.uniform(0.0, 0.06)), z=0.08, over=over)
    return line.hold(float(rng.uniform(0.1, 0.4))).down(leg, over=over).home(over=0.3).hold(0.3)


def _chain(rng: np.random.Generator) -> Timeline:
    """One of the others between stretches that can be done as they are written."""
    others = (_quick_trunk, _pair, _pair_while_moving, _early_paw)
    inner = others[int(rng.integers(len(others)))](rng)
    paw = FRONT[int(rng.integers(2))]
    before = Timeline().foot(paw, z=float(rng.uniform(0.05, 0.1)), over=0.7).home(over=0.8)
    after = _moved(Timeline(), rng, 0.9).home(over=0.9)
    return before.then(inner, after)


KINDS: dict[str, Maker] = {
    "quick trunk": _quick_trunk,
    "diagonal pair": _pair,
    "pair while moving": _pair_while_moving,
    "early paw": _early_paw,
    "chain": _chain,
}
"""In turns, by the seed."""


STUDIES = (Study("nearest", {"nearest to a refused motion": ROWS}, measure),)


BENCHMARK = Benchmark(
    "nearest",
    "Motions that the check refuses: is the nearest one found that it does not, is\n"
    "it done in physics, and is it as far from what was written as reported? Needs\n"
    "go2-wbc[dynamics].",
    STUDIES,
    takes="twenty motions, some minutes",
    more_seeds=", each of another motion",
)
register, run = BENCHMARK.register, BENCHMARK.run
