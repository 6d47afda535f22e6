"""``python -m benchmarks jump_limits``: how high, how far, how far round, and what forbids more.

A kind of jump is asked for ever more, every plan the start of the search for the next
(continuation), the time in the air searched, until it is not planned, the check refuses it or a few
robots do not do it; between the last two sizes it is bisected. The greatest jump of each kind is
played over other seeds, on which nothing was tuned. There are no thresholds: what was reached is
told, and what stopped the climb, beside what the legs and the motors' line permit
(``jump_bounds``).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from textwrap import wrap
from typing import NamedTuple

from benchmarks.command import SEEDED, add_options, measure_all, publish, run_and_report, seeds_of
from benchmarks.dynamic_motions import FIRST_SEED, Played, metrics_of, play
from benchmarks.report import WIDTH, render, summarise
from benchmarks.robots import plant_of
from benchmarks.studies.jump_bounds import PhysicsRow, physics_rows
from benchmarks.study import Direction, Measurement, Metric, Study, chosen_studies, tasks_of
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.cli.progress import ProgressLine
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.errors import PlanNotFound
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, FeasibilityChecker, Timeline, compile_timeline
from motions.dynamics import PhaseProblem, Solved, solve
from motions.dynamics import phase_builders as moves
from motions.dynamics.phases import GRAVITY, KNOT_PERIOD
from motions.dynamics.plan_cache import keep
from motions.dynamics.plan_limits import PlanLimits

BISECTIONS = 2
"""Between the greatest size that is found and the least that is not."""
FLIGHT_STEPS = (0, 2, -2)
"""Knots by which the time in the air is changed, in this order, where there is no plan."""
LIMITS = PlanLimits(torque_share=0.84, knee_height=0.12)
"""What the greatest jumps keep, more strictly than others: with knees 0.09 m high at least, calves
touch the ground in landing; at 0.85 of the torque, the check allows 0.845. Chosen on a jump of 0.7
m and the seeds of the trials by which a climb decides."""
DRAWN_UP = 0.10
"""Height [m] that the feet gain by drawing up the legs, for which the trunk need not rise."""
OFFSET = 500
"""Seeds from which these trials are away from those of ``dynamic_motions``; 200 to 219 had been
seen when the climb was made to stop at what is not done."""
TRIED = range(600, 603)
"""Seeds of the trials by which a climb decides, counted like ``OFFSET``."""
BUDGET = 20.0
"""Processor time [s] of one attempt."""
EXAMPLES = """
python -m benchmarks jump_limits                  everything; some minutes
python -m benchmarks jump_limits --rows high --seeds 5
python -m benchmarks jump_limits --budget 40      40 s for every attempt
python -m benchmarks jump_limits --json
"""


class Jump(NamedTuple):
    """What ``Timeline.jump`` takes."""

    x: float
    yaw: float
    height: float
    flight: float


@dataclass(frozen=True, slots=True)
class Kind:
    """What is asked for ever more of.

    Attributes:
        title: in the report.
        unit: of the size that is shown.
        scale: from the size [m, rad] to that unit.
        sizes: increasing; the first is easy.
        ask: the jump of a size.
    """

    title: str
    unit: str
    scale: float
    sizes: tuple[float, ...]
    ask: Callable[[float], Jump]


def high(size: float) -> Jump:
    """Straight up, the feet ``size`` [m] over the ground."""
    rise = max(size - DRAWN_UP, DRAWN_UP)
    return Jump(0.0, 0.0, size, 2.0 * math.sqrt(2.0 * rise / GRAVITY))


def far(size: float) -> Jump:
    """``size`` [m] ahead."""
    return Jump(size, 0.0, 0.1, 0.28)


def round_about(size: float) -> Jump:
    """Up, and round by ``size`` [rad]."""
    return Jump(0.0, size, 0.15, 0.36)


HALF_TURN = math.pi
KINDS: dict[str, Kind] = {
    "high": Kind("jump up", "m", 1.0, (0.15, 0.20, 0.25, 0.30, 0.35, 0.40), high),
    "far": Kind("jump ahead", "m", 1.0, (0.5, 0.6, 0.7, 0.8, 0.9), far),
    "round": Kind(
        "jump and turn", "deg", math.degrees(1.0),
        tuple(share * HALF_TURN for share in (1 / 2, 2 / 3, 5 / 6, 1.0)), round_about,
    ),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Attempt:
    """One question to the planner.

    Attributes:
        size: in the kind's unit.
        flight: time in the air [s].
        reason: why there is no plan, or why it is not done; empty if it is.
    """

    size: float
    flight: float
    reason: str

    def __str__(self) -> str:
        """For progress."""
        return f"{self.size:.3g}, {self.flight:.2f} s in the air: {self.reason or 'done'}"


@dataclass(frozen=True, slots=True)
class Climb:
    """How far the sizes of a kind were climbed.

    Attributes:
        size: the greatest [m, rad] that is done.
        jump: that jump.
        attempts: all, in their order.
    """

    size: float
    jump: Jump
    attempts: tuple[Attempt, ...]


def compiled(jump: Jump, model: RobotModel) -> CompiledPlan:
    """The plan of a jump; what was kept is not solved again."""
    line = Timeline().jump(x=jump.x, yaw=jump.yaw, height=jump.height, flight=jump.flight)
    return compile_timeline(line, model)


def objection(plan: CompiledPlan, model: RobotModel) -> str:
    """What the check finds first, which judges torques by other speeds than the planner."""
    failures = FeasibilityChecker(model).check(plan).failures
    return f"the check: {failures[0]}" if failures else ""


class Climber:
    """Climbs the sizes of one kind; plans are kept where ``compile_timeline`` looks for them.

    A plan counts if the check lets it pass and it is done when it is played. One of which that is
    not so is still a start for the next.
    """

    def __init__(
        self,
        kind: Kind,
        model: RobotModel,
        budget: float,
        *,
        play: Callable[[CompiledPlan], str],
        tell: Callable[[str], None],
    ) -> None:
        """Ask for jumps of ``kind``, each for ``budget`` seconds of processor time.

        ``play`` plays a plan and says what is in the way of its being done, or nothing; ``tell`` is
        called with every attempt in words.
        """
        self._kind, self._model, self._budget = kind, model, budget
        self._play, self._tell = play, tell
        self._attempts: list[Attempt] = []
        self._last: Solved | None = None
        self._longer = 0.0

    def climb(self) -> Climb:
        """The greatest size.

        Raises:
            PlanNotFound: if the first one is not planned or not done.
        """
        found, jump, least = self._kind.sizes[0], None, math.inf
        for size in self._kind.sizes:
            if (planned := self._find(size)) is None:
                least = size
                break
            found, jump = size, planned
        if jump is None:
            raise PlanNotFound(f"{self._kind.title}: {self._attempts[-1]}")
        for _ in range(BISECTIONS if math.isfinite(least) else 0):
            middle = 0.5 * (found + least)
            if (planned := self._find(middle)) is None:
                least = middle
            else:
                found, jump = middle, planned
        return Climb(found, jump, tuple(self._attempts))

    def _find(self, size: float) -> Jump | None:
        """A jump of this size that is done, over the times in the air."""
        asked, longer = self._kind.ask(size), self._longer
        for steps in FLIGHT_STEPS:
            self._longer = longer + steps * KNOT_PERIOD
            halves = max(round(0.5 * (asked.flight + self._longer) / KNOT_PERIOD), 1)
            jump = asked._replace(flight=2.0 * KNOT_PERIOD * halves)
            if self._is_done(size, jump):
                return jump
        self._longer = longer
        return None

    def _is_done(self, size: float, jump: Jump) -> bool:
        phases = moves.jump(jump.x, 0.0, jump.yaw, jump.height, flight=jump.flight)
        problem, reason = PhaseProblem(phases), ""
        try:
            plan = solve(problem, self._model, budget=self._budget, limits=LIMITS, start=self._last)
        except PlanNotFound as error:
            reason = "; ".join([str(error).split("\n")[0], *error.reasons])
        else:
            keep(problem, self._model, plan)
            self._last = Solved(problem, plan)
            ready = compiled(jump, self._model)
            reason = objection(ready, self._model) or self._play(ready)
        attempt = Attempt(self._kind.scale * size, jump.flight, reason)
        self._attempts.append(attempt)
        self._tell(f"{self._kind.title}, {attempt}")
        return not reason


@cache
def plan_of(jump: Jump) -> CompiledPlan:
    """The plan of a jump; once for all trials of a process."""
    return compiled(jump, RobotModel())


def measure(trial: Trial, name: str, jump: Jump) -> Measurement:
    """Play it, stand for a second, look what came of it."""
    plan, model = plan_of(jump), RobotModel()
    planned, done, stood = (f"{name}.{part}" for part in ("planned", "done", "stood"))
    values, failures = {planned: _size(name, jump), done: 0.0, stood: 0.0}, {}
    try:
        played = play(plant_of(Trial(trial.seed + OFFSET), FIRST_SEED), plan, model)
    except TrialFailed as failed:
        return Measurement(values, {done: str(failed), stood: str(failed)}, str(failed))
    values |= {**played.values(name, plan, model), f"{name}.reached": _reached(name, played)}
    values[stood] = 1.0
    if played.objection:
        values[done], failures[done] = 0.0, played.objection
    return Measurement(values, failures)


def not_done(plan: CompiledPlan) -> str:
    """What is in the way of the plan's being done in the trials of a climb, if anything."""
    for seed in TRIED:
        try:
            objection = play(plant_of(Trial(seed), FIRST_SEED), plan, RobotModel()).objection
        except TrialFailed as failed:
            objection = str(failed)
        if objection:
            return f"played: {objection}"
    return ""


def _size(name: str, jump: Jump) -> float:
    return KINDS[name].scale * {"high": jump.height, "far": jump.x, "round": jump.yaw}[name]


def _reached(name: str, played: Played) -> float:
    turned = played.turned % (2.0 * math.pi)
    sizes = {"high": played.height, "far": float(played.moved[0]), "round": turned}
    return KINDS[name].scale * sizes[name]


def study_of(name: str, jump: Jump) -> Study:
    """The trials of the greatest jump of a kind."""
    kind = KINDS[name]
    title = f"{kind.title}, the greatest that is done"
    planned = [
        Metric(f"{name}.planned", title, "planned", kind.unit, None),
        Metric(f"{name}.reached", title, "reached", kind.unit, None, Direction.AT_LEAST),
        Metric(f"{name}.stood", title, "stands 1 s later", "", None, Direction.AT_LEAST),
    ]
    common = [replace(metric, threshold=None) for metric in metrics_of(name, title, 1.0)]
    return Study(name, (*planned, *common), partial(measure, name=name, jump=jump))


def register(subparsers: Subparsers) -> None:
    """Add the options of ``jump_limits``."""
    parser = add_parser(
        subparsers,
        "jump_limits",
        "The greatest jumps that are done, what stops greater ones, and what physics\n"
        "permits. Exit code 0.",
        examples=EXAMPLES,
    )
    add_options(parser, *SEEDED)
    parser.add_argument(
        "--budget", metavar="S", type=float, default=BUDGET,
        help="processor time of one attempt to plan [s], default %(default)g",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Climb, play, and tell."""
    easy = [study_of(name, kind.ask(kind.sizes[0])) for name, kind in KINDS.items()]
    chosen = chosen_studies(easy, args.rows)
    if args.list:
        return run_and_report(args, chosen, [])
    model = RobotModel()
    climbs = _climbs([study.name for study in chosen], model, args.budget)
    studies = [study_of(name, climb.jump) for name, climb in climbs.items()]
    report = summarise(studies, measure_all(args, tasks_of(studies, seeds_of(args))))
    rows = physics_rows(model)
    values = {
        **report.as_dict(),
        "climbs": {name: asdict(climb) for name, climb in climbs.items()},
        "physics": [asdict(row) for row in rows],
    }
    publish(args, values, f"{render(report)}\n\n{_climb_table(climbs)}\n\n{_physics_table(rows)}")
    return ExitCode.OK


def _climbs(names: list[str], model: RobotModel, budget: float) -> Mapping[str, Climb]:
    with ProgressLine() as line:
        return {
            name: Climber(KINDS[name], model, budget, play=not_done, tell=line.done).climb()
            for name in names
        }


def _climb_table(climbs: Mapping[str, Climb]) -> str:
    """What stopped the climbs: every jump that is greater than the one that is done."""
    lines = ["what stopped the climbs", "-" * WIDTH]
    for name, climb in climbs.items():
        kind = KINDS[name]
        for attempt in climb.attempts:
            if attempt.reason and attempt.size > kind.scale * climb.size:
                text = f"{kind.title}, {attempt}"
                lines += wrap(text, WIDTH, initial_indent="  ", subsequent_indent="      ")
    return "\n".join(lines)


def _physics_table(rows: tuple[PhysicsRow, ...]) -> str:
    lines = ["what legs and motors permit, legs without inertia", "-" * WIDTH]
    lines += [f"  {row.what:<52}{row.value:>9.3g} {row.unit}" for row in rows]
    return "\n".join(lines)
