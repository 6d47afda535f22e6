"""Runs whose every number is to stay what it was, and the ledger that takes note of them.

They drive the public ``GO2Controller``. What each stage of a tick made is read on its way through
``MujocoPlant.read``, ``WholeBodyController.solve`` and ``MujocoPlant.write``: names that stay,
however what lies behind them is rewritten.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, fields
from enum import Enum
from functools import partial
from hashlib import blake2b
from operator import attrgetter
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from controller import GO2Controller
from go2_wbc.config import Config
from go2_wbc.errors import Go2WbcError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import Boxes, Slope, Stairs
from go2_wbc.reference import Reference
from go2_wbc.robot.estimator import SensorReading, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState, Snapshot
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from motions import FeasibilityChecker, FeasibilityReport, Playable, Timeline, motion_names

KEPT_EVERY = 20
"""Ticks from one whose numbers are kept to the next; of the others only digests are."""
STAGES: dict[str, tuple[str, ...]] = {
    "estimate": ("time", "q", "v", "tau", "foot_forces", "feet_in_contact"),
    "snapshot": (
        *("R_world_base", "mass_matrix", "bias", "p_world_com", "v_world_com", "J_com"),
        *("drift_com", "p_world_feet", "v_world_feet", "J_feet", "drift_feet", "J_contacts"),
        *("drift_contacts", "v_world_contacts", "payload", "com_shift"),
    ),
    "reference": (
        *("body.point", "body.p_world", "body.v_world", "body.a_world", "body.R_world_base"),
        *("body.w_world", "body.dw_world", "legs", "normal_force_min", "normal_force_max"),
        *("p_world_feet", "v_world_feet", "a_world_feet", "q_joints", "v_joints", "a_joints"),
        *("f_world_feet", "force_weight", "friction", "orientation_discount"),
    ),
    "feedback": ("q", "v", "gains"),
    "solution": ("tau", "tau_motors", "qdd", "forces", "is_relaxed"),
    "command": ("tau", "q_des", "v_des", "kp", "kd"),
    "report": (),
}
"""What a tick makes, in its order, and the fields that are looked at; a report has its own."""

Values = Mapping[str, Float[np.ndarray, " n"]]  #: Numbers of one stage, by their names
Step = Callable[[GO2Controller], object]


@dataclass
class Ledger:
    """What a run has made."""

    folder: Path  #: where the run may keep what it reads
    digests: list[list[int]] = field(default_factory=list)
    """Of every tick, by stage; 0 where the stage did nothing."""
    kept: list[list[Values]] = field(default_factory=list)
    """Numbers of every ``KEPT_EVERY``-th tick, stage by stage."""
    lines: list[str] = field(default_factory=list)  #: what came of its calls

    def tick(self, made: Mapping[str, object]) -> None:
        """Take note of what each stage made: values, or what has the fields of ``STAGES``."""
        tick = [_values(made.get(stage), names) for stage, names in STAGES.items()]
        if len(self.digests) % KEPT_EVERY == 0:
            self.kept.append(tick)
        self.digests.append([_digest(values) for values in tick])


def _values(made: object, names: tuple[str, ...]) -> Values:
    if made is None or isinstance(made, dict):
        return made or {}
    return {name: np.array(_plain(attrgetter(name)(made)), float).ravel() for name in names}


def _plain(value: object) -> object:
    is_word = isinstance(value, Enum) and not isinstance(value, int)
    return list(type(value)).index(value) if is_word else value  # type: ignore[call-overload]


def _digest(values: Values) -> int:
    """64 bits of the exact bytes; 0 of nothing."""
    if not values:
        return 0
    numbers = b"".join(array.tobytes() for array in values.values())
    return int.from_bytes(blake2b(numbers, digest_size=8).digest(), "little")


@contextmanager
def noted(ledger: Ledger) -> Iterator[None]:
    """Notes every tick of every robot in the meantime."""
    read, write, solve = MujocoPlant.read, MujocoPlant.write, WholeBodyController.solve
    made: dict[str, object] = {}

    def reading(plant: MujocoPlant) -> RobotState:
        made["estimate"] = state = read(plant)
        return state

    def solving(
        wbc: WholeBodyController, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        made.update(snapshot=snapshot, reference=reference)
        made["solution"] = solution = solve(wbc, snapshot, reference, relax=relax)
        return solution

    def writing(plant: MujocoPlant, command: JointCommand) -> None:
        ledger.tick({**made, "command": command})
        made.clear()
        write(plant, command)

    with (
        patch.multiple(MujocoPlant, read=reading, write=writing),
        patch.object(WholeBodyController, "solve", solving),
    ):
        yield


@dataclass(frozen=True)
class RobotRun:
    """A robot that takes steps, one after the other."""

    steps: tuple[Step, ...]  #: calls of the controller
    plant: Callable[[], MujocoPlant] = MujocoPlant  #: makes the robot
    config: Config | None = None  #: of the controller

    def __call__(self, ledger: Ledger) -> None:
        """Take the steps; what each came to is a line."""
        with (
            closing(self.plant()) as plant,
            noted(ledger),
            GO2Controller(plant=plant, config=self.config) as go2,
        ):
            for step in self.steps:
                try:
                    step(go2)
                    ledger.lines.append(f"Mode.{go2.mode.name} {go2.last_outcome}")
                except Go2WbcError as error:
                    ledger.lines.append(f"{type(error).__name__}: {error}")


def walk(gait: str = "trot") -> Step:
    """Enter walking mode, or another gait."""
    return lambda go2: go2.walk(gait)


def move(
    x: float = 0.0,
    turn: float = 0.0,
    y: float = 0.0,
    wait: float = 2.0,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Step:
    """Walk like this, at this height, roll and pitch, for ``wait`` seconds."""
    how = dict(zip(("linear_y", "height", "roll", "pitch"), (y, *pose), strict=True))
    return lambda go2: (go2.move(x, turn, **how), go2.wait(wait))


def push(x: float, y: float, duration: float = 0.1, wait: float = 1.5, at: str = "base") -> Step:
    """Push with these forces [N], and see what comes of it."""

    def step(go2: GO2Controller) -> None:
        if isinstance(go2.plant, MujocoPlant):
            go2.plant.push(np.array([x, y, 0.0]), duration, at)
        go2.wait(wait)

    return step


def play(motion: Playable) -> Step:
    """Play a motion."""
    return lambda go2: go2.play(motion)


def library(ledger: Ledger) -> None:
    """Every plan of the library at 200 instants, and what the check says of it."""
    checker = FeasibilityChecker(RobotModel())
    for name in motion_names():
        checked = checker.evaluate(name)
        for number, t in enumerate(np.linspace(0.0, checked.plan.duration, 200).tolist()):
            made = {"reference": checked.plan.at(t), "feedback": checked.plan.feedback_at(t)}
            ledger.tick({**made, "report": _margins(checked.report)} if number == 0 else made)
        ledger.lines.append(f"{name} {checked.report.ok} {checked.report.probability}")


def _margins(report: FeasibilityReport) -> Values:
    """The worst of every subject of every check, and sums over all instants."""
    found = {}
    for series in report.series:
        found[series.check] = [np.nansum(series.values), np.nansum(series.margins)]
        for item in series.findings():
            numbers = [item.time, item.value, item.limit, item.margin]
            found[f"{item.check} of {item.subject}"] = numbers
    return {name: np.array(numbers, float) for name, numbers in found.items()}


def solves(ledger: Ledger, count: int = 300) -> None:
    """Ticks of plans on four feet down to none, from states beside them by a little and by much."""
    rng, model = np.random.default_rng(31), RobotModel()
    checker, wbc = FeasibilityChecker(model), WholeBodyController(model)
    motions = [checker.evaluate(name) for name in ("wave", "zigzag", "paw_pair", "spin_jump")]
    for number in range(count):
        checked = motions[number % len(motions)]
        row = rng.integers(len(checked.path.times))
        scale = (0.01, 0.1, 1.0)[number % 3]
        q = pin.integrate(model.pin_model, checked.path.q[row], scale * rng.normal(size=18))
        v = checked.path.v[row] + 5.0 * scale * rng.normal(size=18)
        time, stands = float(checked.path.times[row]), checked.path.stance[row]
        snapshot = model.snapshot(RobotState(time, q, v, np.zeros(12), 40.0 * stands, stands))
        reference = checked.plan.at(time)
        try:
            solution = wbc.solve(snapshot, reference, relax=True)
        except Go2WbcError as error:
            ledger.lines.append(f"{number} {type(error).__name__}: {error}")
            continue
        ledger.tick({"snapshot": snapshot, "reference": reference, "solution": solution})


def estimator(ledger: Ledger) -> None:
    """A fresh filter over readings that were recorded with the run, not made anew."""
    file = ledger.folder / "estimator.npy"
    if not file.exists():
        np.save(file, _readings())
    sizes = np.cumsum([1, 3, 3, 12, 12, 12])
    filtering = StateEstimator(RobotModel())
    for row in np.load(file):
        time, *arrays = np.split(row, sizes)
        ledger.tick({"estimate": filtering.update(SensorReading(float(time[0]), *arrays))})
    ledger.lines.append(repr(filtering.covariance().pose.tolist()))


def _readings() -> Float[np.ndarray, "n 47"]:
    """Sensor readings of a robot that stands up, trots, turns, is thrown over and gets up."""
    rows, names = [], [item.name for item in fields(SensorReading)]
    update = StateEstimator.update

    def updating(filtering: StateEstimator, reading: SensorReading) -> RobotState:
        rows.append(np.hstack([getattr(reading, name) for name in names]))
        return update(filtering, reading)

    steps = (walk(), move(1.0, 0.5), push(0.0, 500.0, 0.3), GO2Controller.recover)
    with patch.object(StateEstimator, "update", updating):
        RobotRun(steps, IMU)(Ledger(Path()))
    return np.array(rows)


IMU = partial(MujocoPlant, sensors="imu", seed=3)
STAND, STOP = GO2Controller.stand, GO2Controller.stop
FIVES = tuple(partial(GO2Controller.high_five, side=side, hold=0.5) for side in ("left", "right"))
POSES = ((-0.05, 0.0, 0.0), (0.0, 0.15, 0.0), (0.0, 0.0, -0.15))
ORDER = ("walk", "pace", "flying_trot", "bound", "gallop", "pronk", "trot")
SHOVED = Timeline(name="shoved", physics="nearest").body(y=0.09, over=0.16).hold(0.2).home(over=0.5)
LEAP = Timeline(name="leap").jump(x=0.13, height=0.06)
WAY = Timeline(name="way").walk(x=0.4).step("FR", x=0.05, over=0.5).home(over=0.5)

RUNS: dict[str, Callable[[Ledger], None]] = {
    "postures": RobotRun((STAND, GO2Controller.sit, STAND, GO2Controller.lie_down, STAND)),
    "trot": RobotRun((walk(), move(0.5), move(1.5), STOP)),
    "trot-fast": RobotRun((walk(), move(1.5, wait=1.5), move(3.0, wait=3.0), STOP)),
    "trot-planned": RobotRun((walk(), move(1.0), move(2.0, wait=1.0), STOP), IMU),
    "trot-imu": RobotRun((walk(), move(0.8, 0.8), move(0.0, y=0.4), move(-0.3), STOP), IMU),
    "trot-noisy": RobotRun(
        (walk(), move(0.6, -0.5), STOP), partial(MujocoPlant, sensors="noisy", delay=0.004)
    ),
    "gaits": RobotRun(tuple(step for gait in ORDER for step in (walk(gait), move(0.5, wait=1.2)))),
    "gait-auto": RobotRun((walk("auto"), move(0.2), move(0.9), move(2.0), STOP)),
    "push-trot": RobotRun(
        (walk(), move(0.5), push(0, 300), push(-300, 0), push(0, 90, at="FL_foot"))
    ),
    "push-stand": RobotRun((STAND, push(0, 200), push(150, 150), push(-250, 0))),
    "slippery": RobotRun((walk(), move(0.4, 0.6), STOP), partial(MujocoPlant, friction=0.18)),
    "boxes": RobotRun(
        (walk(), move(1.0, wait=5.0), STOP), partial(MujocoPlant, terrain=Boxes(0.08, seed=21))
    ),
    "stairs": RobotRun((walk(), move(0.5, wait=5.0)), partial(MujocoPlant, terrain=Stairs(0.06))),
    "slope": RobotRun((walk(), move(0.5, wait=3.0), STOP), partial(IMU, terrain=Slope(0.2))),
    "fall": RobotRun((STAND, push(0, 600, 0.3, wait=2.5), GO2Controller.recover, walk())),
    "payload": RobotRun(
        (walk(), move(0.5, 0.3), STOP),
        partial(MujocoPlant, payload=4.0, payload_place=(0.0, 0.08, 0.1)),
    ),
    "high-five": RobotRun(FIVES),
    "high-five-imu": RobotRun(FIVES, IMU),
    "pose": RobotRun((walk(), *(move(0.3, wait=1.0, pose=pose) for pose in POSES), STOP)),
    "goals": RobotRun((walk(), lambda go2: go2.turn_left(0.8), lambda go2: go2.move_forward(0.5))),
    "play-feet": RobotRun((STAND, play("knock"), play("cross_step"), play("hula")), IMU),
    "play-walks": RobotRun((STAND, play("zigzag"), play("sit_pretty"))),
    "play-dynamic": RobotRun(
        (STAND, *map(play, ("jump_forward", "bunny_hops", "rear_up", "paw_pair", "spin_jump")))
    ),
    "play-solved": RobotRun((STAND, play(LEAP), play(SHOVED))),
    "play-landing": RobotRun(
        (STAND, play(WAY)), partial(IMU, terrain=Boxes(0.04, count=400, clear_radius=0.4))
    ),
    "placo": RobotRun((walk(), move(0.5, 0.3, wait=1.0)), config=Config(backend="placo")),
    "full": RobotRun((walk(), move(0.5, 0.3, wait=1.0)), config=Config(backend="full")),
    "library": library,
    "solves": solves,
    "estimator": estimator,
}
"""By name."""
