"""What one solution costs, by us and by PlaCo, on the same states in turn."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float

from benchmarks.speed_placo import BarePlaco
from benchmarks.study import TrialResult
from controller.assembly import build_pilot
from controller.modes import Aborted
from controller.sweeps.trials import Trial, TrialFailed
from controller.telemetry import Telemetry
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from motions import compile_motion

ROUNDS = 500  # Ticks of each contact mode that are solved
BATCHES = 20  # Rounds over all ticks of what is too short for one
TROT = 2  # Stance feet
WARM_UP = 50  # Rounds before the measurement
FASTER = {4: 3.5, 3: 3.5, 2: 3.0}
"""By number of stance feet (standing, high five, trot): how many times faster than PlaCo we are to
be."""
PLACO_TIME = 43.0
"""Time [us] of PlaCo's tick on two feet on the machine for which bars in us are meant."""


TABLE = {
    **{
        f"tick of the QP, {feet} stance feet": (
            (f"{feet}.ours", "ours, median", "us"),
            (f"{feet}.placo", "bare PlaCo, median", "us"),
            (f"{feet}.faster", "median: times faster", f">= {least}"),
            (f"{feet}.ours_p99", "ours, 99 of 100", "us"),
            (f"{feet}.placo_p99", "bare PlaCo, 99 of 100", "us"),
            (f"{feet}.tail", "99 of 100: ours by PlaCo's", "<= 1"),
        )
        for feet, least in FASTER.items()
    },
    "which limits bind, at a trot": (
        ("noted", "multipliers recorded, a tick, scaled", "<= 2 us"),
        ("explained", "`explain()`, scaled", "ms"),
    ),
}


@dataclass(frozen=True, slots=True)
class Tick:
    """What the QP was asked in one tick of a run."""

    snapshot: Snapshot  #: of the measured state
    reference: Reference  #: what was asked for
    is_packed: bool  #: whether it came as the row of numbers that the kernel reads

    def asked(self) -> Reference:
        """The reference as it came: a copy that is not packed yet if it was not."""
        return self.reference if self.is_packed else replace(self.reference)


Ticks = Mapping[int, Sequence[Tick]]  #: By number of stance feet


class Recorder(WholeBodyController):
    """Solves, and keeps ``ROUNDS`` ticks for each number of stance feet."""

    def __init__(self, model: RobotModel) -> None:
        super().__init__(model)
        self.ticks: dict[int, list[Tick]] = {feet: [] for feet in FASTER}

    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        """Solve one tick and keep it if there is room."""
        kept = self.ticks.get(int(reference.stance.sum()), [])
        if len(kept) < ROUNDS:
            is_packed = reference._row is not None
            for part in fields(reference):  # a row's arrays are made at their first use
                getattr(reference, part.name)
            kept.append(Tick(snapshot, reference, is_packed))
        return super().solve(snapshot, reference, relax=relax)


def measure_solves(trial: Trial, found: TrialResult) -> None:
    """The tick of the QP from the measured state to torques, ours and PlaCo's in turn."""
    model, config = RobotModel(), WbcConfig()
    ours, placo = WholeBodyController(model, config=config), BarePlaco(model, config)
    values = found.values
    for feet, ticks in recorded_ticks(trial).items():
        solvers: Mapping[str, Callable[[Tick, Reference], object]] = {
            "ours": lambda tick, asked: ours.solve(model.snapshot(tick.snapshot.state), asked),
            "placo": lambda tick, asked: placo.tick(tick.snapshot.state, asked),
        }
        for name, times in interleaved(ticks, solvers).items():
            values[f"{feet}.{name}"] = float(np.median(times))
            values[f"{feet}.{name}_p99"] = float(np.quantile(times, 0.99))
        values[f"{feet}.faster"] = values[f"{feet}.placo"] / values[f"{feet}.ours"]
        values[f"{feet}.tail"] = values[f"{feet}.ours_p99"] / values[f"{feet}.placo_p99"]
        if feet == TROT:
            values |= _explaining(ours, ticks)


def _explaining(wbc: WholeBodyController, ticks: Sequence[Tick]) -> dict[str, float]:
    """Median time of noting multipliers [us] in telemetry, and of an explanation [ms]."""
    slow, telemetry = slowness(ticks), Telemetry(wbc.model, len(ticks))
    solutions = [wbc.solve(tick.snapshot, tick.reference) for tick in ticks]
    for tick in ticks:
        telemetry.record(tick.snapshot, tick.reference.stance, "")

    def spent(act: Callable[[WbcSolution], object], many: Sequence[WbcSolution]) -> float:
        rounds = timed(lambda: [act(solution) for solution in many], BATCHES)
        return float(np.median(rounds)) / len(many) / slow

    explained = spent(WbcSolution.explain, solutions[::BATCHES]) / 1e3
    return {"noted": spent(telemetry.note, solutions), "explained": explained}


def timed(work: Callable[[], object], times: int) -> Float[np.ndarray, " n"]:
    """Processor time [us] from the end of each call to the end of the next."""
    ends = [time.thread_time_ns()]
    for _ in range(times):
        work()
        ends.append(time.thread_time_ns())
    return np.diff(ends) / 1e3


def interleaved(
    ticks: Sequence[Tick], solvers: Mapping[str, Callable[[Tick, Reference], object]]
) -> dict[str, list[float]]:
    """Thread time [us] of each solver in each tick; A B A B, so that all meet the same machine.

    What reading the clock takes, half a microsecond, is left out.
    """
    readings = [(time.thread_time_ns(), time.thread_time_ns()) for _ in range(1000)]
    clock = float(np.median([after - before for before, after in readings])) / 1e3
    spent: dict[str, list[float]] = {name: [] for name in solvers}
    for tick in [*ticks[:WARM_UP], *ticks]:
        for name, solve in solvers.items():
            asked = tick.asked()
            start = time.thread_time_ns()
            solve(tick, asked)
            spent[name].append((time.thread_time_ns() - start) / 1e3 - clock)
    return {name: times[-len(ticks) :] for name, times in spent.items()}


def slowness(trotting: Sequence[Tick]) -> float:
    """How many times slower this machine is now than the one for which bars in us are meant.

    By PlaCo's tick on two feet: the rest of the machine slows it as it slows us.
    """
    placo = BarePlaco(RobotModel(), WbcConfig())
    solvers = {"placo": lambda tick, asked: placo.tick(tick.snapshot.state, asked)}
    return float(np.median(interleaved(trotting, solvers)["placo"])) / PLACO_TIME


def recorded_ticks(trial: Trial) -> Ticks:
    """Ticks of a run: standing, trotting, giving a high five.

    Raises:
        TrialFailed: if the robot falls.
    """
    with closing(trial.plant()) as plant, closing(build_pilot(plant, Config())) as robot:
        loop = robot.runner.loop
        recorder = Recorder(loop.model)
        loop.wbc = recorder
        try:
            robot.stand()
            robot.walk("trot")
            robot.set_command(VelocityCommand(0.5))
            robot.wait(2.0)
            robot.rest()
            robot.stand()
            robot.play(compile_motion("high_five", RobotModel()))
        except Aborted as aborted:
            raise TrialFailed(str(aborted)) from aborted
        return recorder.ticks
