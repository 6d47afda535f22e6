"""A study: metrics with their bars, and a trial that gives them for a seed; and running them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial

from controller.sweeps.local import LocalEngine
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.errors import CommandError, Go2WbcError, unknown_name

IDEAL, IMU = "ideal", "imu"
"""The state that the controller is given: the true one, or what its own sensors tell."""
SENSED = "sensed-"
"""What names on the robot's own sensors begin with."""


class Direction(Enum):
    """On which side of its threshold a value is good."""

    AT_MOST = "<="
    AT_LEAST = ">="

    def meets(self, value: float, threshold: float) -> bool:
        """Whether ``value`` is on the good side; a nan never is."""
        return value <= threshold if self is Direction.AT_MOST else value >= threshold

    def worst(self, values: Mapping[int, float]) -> int:
        """The key of the worst value; ``values`` must not be empty."""
        pick = max if self is Direction.AT_MOST else min
        return pick(values, key=lambda key: values[key])


@dataclass(frozen=True, slots=True)
class Metric:
    """One row of the report: a quantity of which every trial gives one value.

    Attributes:
        name: unique among all metrics.
        item: what the robot does; metrics of one item stand together.
        quantity: what is measured.
        unit: of the value; empty for a ratio or a count.
        threshold: what the mean over the seeds must reach; ``None`` for one that only informs.
        direction: on which side of the threshold is good.
    """

    name: str
    item: str
    quantity: str
    unit: str
    threshold: float | None
    direction: Direction = Direction.AT_MOST


@dataclass(frozen=True, slots=True)
class Measurement:
    """What one trial of a study gave.

    Attributes:
        values: by metric. One without a value counts as failed.
        failures: by metric, why the robot did not do it although there may be a value.
        reason: why metrics without a value have none; empty if all have one.
        notes: what else is worth keeping, by name; is on disk only.
        not_asked: by metric, why this trial says nothing of it, neither good nor bad.
    """

    values: Mapping[str, float]
    failures: Mapping[str, str] = field(default_factory=dict)
    reason: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    not_asked: Mapping[str, str] = field(default_factory=dict)

    def failure(self, metric: str) -> str | None:
        """Why this trial counts as failed for ``metric``, or None."""
        if metric in self.failures:
            return self.failures[metric]
        return None if metric in self.values else self.reason or "no value was measured"


@dataclass(frozen=True, slots=True)
class Study:
    """Metrics that are measured together, in one trial.

    Attributes:
        name: what the command line takes.
        metrics: in the order of the report.
        measure: runs one trial; must be a function of a module, so that a process can import it.
        seed_factor: how many times the usual number of seeds it runs.
        group: what the command line takes for all studies of the same kind; may be empty.
        has_sensors: whether its robot can be given other sensors.
    """

    name: str
    metrics: tuple[Metric, ...]
    measure: Callable[[Trial], Measurement]
    seed_factor: int = 1
    group: str = ""
    has_sensors: bool = True


def sensed(study: Study, group: str) -> Study:
    """The study on the robot's own sensors; its name and those of its metrics say so."""
    metrics = tuple(
        replace(metric, name=f"{SENSED}{metric.name}", item=f"sensors: {metric.item}")
        for metric in study.metrics
    )
    measure = partial(_measure_sensed, measure=study.measure)
    return Study(f"{SENSED}{study.name}", metrics, measure, study.seed_factor, group)


def _measure_sensed(trial: Trial, measure: Callable[[Trial], Measurement]) -> Measurement:
    found = measure(replace(trial, sensors=IMU))
    named = ("values", "failures", "notes", "not_asked")
    parts = {part: {f"{SENSED}{n}": v for n, v in getattr(found, part).items()} for part in named}
    return replace(found, **parts)


Results = dict[str, dict[int, Measurement]]
"""What every trial gave, by study and seed."""
Task = tuple[Study, int]
"""A study and the seed of one trial."""


def chosen_studies(studies: Sequence[Study], names: Sequence[str]) -> tuple[Study, ...]:
    """The studies that are named, by themselves or by their group; all if there is no name.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    valid = dict.fromkeys(name for s in studies for name in (s.group, s.name) if name)
    for name in names:
        if name not in valid:
            raise CommandError(unknown_name("scenario", name, valid))
    return tuple(s for s in studies if not names or s.name in names or s.group in names)


def tasks_of(studies: Sequence[Study], seeds: int) -> list[Task]:
    """Every study on its seeds 0, 1, ...; their number is multiplied by its factor."""
    return [(s, seed) for s in studies for seed in range(seeds * s.seed_factor)]


def run_tasks(tasks: Sequence[Task], jobs: int) -> Iterator[tuple[Study, int, Measurement]]:
    """Study, seed and measurement of trials as they end, in the workers of a sweep.

    A process that dies costs no other trial its result.

    Args:
        tasks: what to measure.
        jobs: processes at a time, from the main thread; 0 runs everything in this process.
    """
    if not jobs:
        yield from ((*task, _run_task(task)) for task in tasks)
        return
    for ended in LocalEngine(jobs).run(_run_task, tasks):
        failure = ended.failure
        if failure is not None and not failure.has_died:
            raise RuntimeError(f"{failure.text}\n{failure.details}")
        yield *ended.item, ended.value or Measurement({}, reason="its process died twice")


def _run_task(task: Task) -> Measurement:
    """One trial; an error of this project is a failed trial, any other is a bug and is raised."""
    study, seed = task
    try:
        return study.measure(Trial(seed))
    except TrialFailed as failed:
        return Measurement({}, reason=str(failed))
    except Go2WbcError as error:
        reason = f"{type(error).__name__}: {str(error).splitlines()[0]}"
        return Measurement({}, reason=reason)
