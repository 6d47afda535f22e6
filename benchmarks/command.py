"""What the commands of the benchmarks share: their options, running studies, what is told."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial, wraps
from itertools import groupby
from pathlib import Path
from typing import Annotated, Any

from benchmarks.report import render, summarise, threshold_text
from benchmarks.study import IDEAL, IMU, Results, Study, TrialResult, chosen_studies
from controller.cli.common import ExitCode, ProgressLine, output, print_json, reader
from controller.cli.sweep import tell
from controller.sweeps.run import Progress, SweepResult, remove_sweep, sweep
from controller.sweeps.sweep_file import SEED, Row
from controller.sweeps.targets import Target, code_digest, digest
from go2_wbc.errors import ConfigError, MissingDependency
from go2_wbc.files import write_atomically

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path("out/benchmarks")  #: Where rows are kept, in a folder for each benchmark
SEEDS, QUICK_SEEDS = 20, 3

positive = reader(int, lambda value: value > 0, "at least 1")
Sensors = Annotated[
    str, "true state, or the robot's own sensors; default %(default)s", (IDEAL, IMU)
]
Jobs = Annotated[int, "N", "processes, default %(default)s", positive]
Listed = Annotated[bool, "list the metrics, run nothing"]
Resume = Annotated[bool, "skip what an interrupted run has finished"]
RowsFile = Annotated[Path, "FILE", "keep rows here, default %(default)s"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """Where results go."""

    json: Annotated[bool, "print JSON instead of the table"] = False
    out: Annotated[Path | None, "FILE", "also write the JSON here", output(".json")] = None

    def publish(self, values: dict[str, Any], table: str) -> int:
        """Print the table or the JSON, write the JSON where it was asked for; gives the exit code.

        ``values`` say whether all is ``passed``.
        """
        if self.out is not None:
            write_atomically(self.out, (json.dumps(values, indent=2) + "\n").encode())
        if self.json:
            print_json(values)
        else:
            print(table)
        return ExitCode.OK if values["passed"] else ExitCode.FAILED


@dataclass(frozen=True, slots=True, kw_only=True)
class Seeded:
    """Which studies are run on which seeds, and how."""

    seeds: Annotated[int | None, "N", f"default {SEEDS}", positive] = None
    quick: Annotated[bool, f"{QUICK_SEEDS} seeds"] = False
    rows: Annotated[tuple[str, ...], "NAME", "only these scenarios; see --list"] = ()
    list: Listed = False
    jobs: Jobs = 2
    resume: Resume = False


@dataclass(frozen=True, slots=True)
class Benchmark:
    """A command that runs studies; ``run`` is that of its module."""

    name: str  #: what the command line takes
    description: str  #: of its help; the exit code is told besides
    studies: Sequence[Study]  #: in the order of the report
    takes: str = ""  #: how long it takes, for the help
    examples: tuple[str, ...] = ()  #: arguments, for the help, besides those that all have
    sensors: bool = False  #: whether they can be chosen
    runs: int = (
        0  #: how often a study that draws nothing is run, in turn in one process; 0 for seeds
    )
    needs: Mapping[str, Callable[[], None]] = field(default_factory=dict)
    """By group, what raises ``MissingDependency`` if it cannot be run."""

    @property
    def run(self) -> Callable[..., int]:
        """What the command line calls: its parameters are the options, its docstring the help."""
        call: Callable[..., int] = self._repeated if self.runs else self._on_seeds
        if self.sensors:
            call = self._on_sensors

        @wraps(call)
        def command(**given: Any) -> int:  # noqa: ANN401
            return call(**given)

        command.__doc__ = self._help
        return command

    @property
    def _help(self) -> str:
        names = dict.fromkeys(n for s in self.studies for n in (s.group, s.name) if n)
        told = "Exit code 0 if every threshold is met, 1 if one is not."
        told += f"\n\nNAME: {', '.join(names)}." if self.runs else ""
        lines = [
            f"          {self.takes or 'everything'}",
            *([] if self.runs else [f"--quick   {QUICK_SEEDS} seeds"]),
            "--list    metrics and thresholds",
            *self.examples,
        ]
        examples = "\n".join(f"python -m benchmarks {self.name} {line}" for line in lines)
        return f"{self.description}\n{told}\n\nExamples:\n{examples}"

    def _on_seeds(self, *, chosen: Seeded, output: Output) -> int:
        return self._on_sensors(chosen=chosen, output=output)

    def _on_sensors(self, *, sensors: Sensors = IDEAL, chosen: Seeded, output: Output) -> int:
        """Run what was asked for, report; the exit code says whether all thresholds are met."""
        studies = [study for study in self.studies if study.sensors or sensors == IDEAL]
        studies = [study.on(sensors) for study in chosen_studies(studies, chosen.rows)]
        seeds = chosen.seeds or (QUICK_SEEDS if chosen.quick else SEEDS)
        seeds = 0 if chosen.list else seeds
        return self._report(studies, seeds, output, jobs=chosen.jobs, resume=chosen.resume)

    def _repeated(
        self,
        names: Annotated[tuple[str, ...], "NAME", "some of them, default: all"] = (),
        *,
        runs: Annotated[int | None, "N", "how often each is run", positive] = None,
        list: Listed = False,
        resume: Resume = False,
        output: Output,
    ) -> int:
        studies = chosen_studies(self.studies, names)
        if not list:
            studies = self._possible(studies, is_named=bool(names))
        seeds = 0 if list else runs or self.runs
        return self._report(studies, seeds, output, jobs=1, resume=resume)

    def _possible(self, studies: Sequence[Study], *, is_named: bool) -> Sequence[Study]:
        """Those of ``studies`` that can be run; the others are told of, or raise if they must."""
        for group in {study.group for study in studies} & self.needs.keys():
            try:
                self.needs[group]()
            except MissingDependency as error:
                print(f"{group} is not measured: {error}", file=sys.stderr)
                studies = [study for study in studies if study.group != group]
                if is_named or not studies:
                    raise
        return studies

    def _report(
        self, studies: Sequence[Study], seeds: int, output: Output, *, jobs: int, resume: bool
    ) -> int:
        """List the metrics without a seed; else run them, print and write the report."""
        if not seeds:
            _print_list(studies)
            return ExitCode.OK
        found = measure_all(self.name, studies, seeds, jobs=jobs, resume=resume)
        report = summarise(studies, found)
        return output.publish(report.as_dict(), render(report))


def measure_all(
    name: str, studies: Sequence[Study], seeds: int, *, jobs: int, resume: bool
) -> Results:
    """Sweep the trials of all studies at once; of every one is told, and its row kept at once.

    The number of seeds is multiplied by a study's factor. A process that dies costs no other trial
    its result. To be called from the main thread.
    """
    turn = [(study, k) for study in studies for k in range(study.seed_factor)]
    trials = [
        (study, study.seed_factor * number + k) for number in range(seeds) for study, k in turn
    ]  # in this order more seeds only add to what is there
    results: Results = {study.name: {} for study in studies}
    names = ", ".join(results)
    file = FOLDER / name / f"{digest(names.encode())}.sqlite"
    if not resume:
        remove_sweep(file)  # what an interrupted run does not come to is not of it
    about = {"benchmarks": code_digest(ROOT, ("benchmarks",)), "studies": names}
    target = Target(name, partial(_row_of, trials), about)
    try:
        found = run_sweep(target, len(trials), file, jobs, told=partial(_tell, trials))
    except ConfigError as error:
        raise ConfigError(f"{error}; run without --resume to begin anew") from error
    given = {int(row[SEED]): _trial_in(row) for row in found.rows}
    given |= {number: TrialResult(reason=why) for number, why in found.failures.items()}
    for number, (study, seed) in enumerate(trials):
        results[study.name][seed] = given[number]
    return results


def _row_of(trials: Sequence[tuple[Study, int]], number: int) -> Row:
    study, seed = trials[number]
    return {"study": study.name, "trial": seed, "result": json.dumps(asdict(study.run(seed)))}


def _trial_in(row: Row) -> TrialResult:
    return TrialResult(**json.loads(str(row["result"])))


def _tell(trials: Sequence[tuple[Study, int]], line: ProgressLine, progress: Progress) -> None:
    """How far all has come, and what came of a trial; a bug ends it."""
    failure = progress.failure
    if progress.seed is None:
        line.update(progress.share, "starting")
        if progress.done:
            print(f"{progress.done} finished trials are kept", file=sys.stderr)
        return
    if failure is not None and not failure.has_died:
        raise RuntimeError(f"{failure.text}\n{failure.details}")
    result = _trial_in(progress.row) if progress.row else TrialResult()
    failures = [f"{metric}: {why}" for metric, why in result.failures.items()]
    told = failure.text if failure else result.reason or "; ".join(failures) or "ok"
    study, seed = trials[progress.seed]
    place = f"{progress.done}/{progress.total} {study.name}, seed {seed}"
    line.done(f"{place}: {told}")
    line.update(progress.share, place)


def run_sweep(
    what: object,
    n: int,
    rows: Path,
    jobs: int,
    first_seed: int = 0,
    told: Callable[[ProgressLine, Progress], None] = tell,
) -> SweepResult:
    """Run those of ``n`` seeds that ``rows`` does not keep yet, as ``sweep``; tell of the progress.

    Raises:
        ConfigError: if the file of the rows cannot be used, or they depend on something else.
    """
    with ProgressLine() as line:
        how = {"first_seed": first_seed, "workers": jobs, "on_progress": partial(told, line)}
        return sweep(what, n, out=rows, keep_going=True, **how)


def _print_list(studies: Sequence[Study]) -> None:
    for study in studies:
        print(study.name)
        for item, metrics in groupby(study.metrics, key=lambda metric: metric.item):
            print(f"  {item}")
            for metric in metrics:
                print(f"    {metric.quantity:<30}{threshold_text(metric)}")
