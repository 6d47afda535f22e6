"""Runs many trials in parallel processes: the workers of a sweep, each started fresh."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from benchmarks.scenario import Measurement, Scenario
from controller.sweeps.local import LocalEngine
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.errors import Go2WbcError

Results = dict[str, dict[int, Measurement]]
"""What every trial gave, by scenario and seed."""
Task = tuple[Scenario, int]
"""A scenario and the seed of one trial."""
Done = tuple[Scenario, int, Measurement]
"""A task that has ended, and what it gave."""


def run_tasks(tasks: Sequence[Task], jobs: int) -> Iterator[Done]:
    """Trials as they end. A process that dies costs no other trial its result.

    Args:
        tasks: what to measure.
        jobs: processes at a time, from the main thread; 0 runs everything in this process.
    """
    if not jobs:
        yield from ((s, seed, run_trial(s.measure, seed)) for s, seed in tasks)
        return
    for ended in LocalEngine(jobs).run(_run_task, tasks):
        failure = ended.failure
        if failure is not None and not failure.has_died:
            raise RuntimeError(f"{failure.text}\n{failure.details}")
        yield *ended.item, ended.value or Measurement({}, reason="its process died twice")


def _run_task(task: Task) -> Measurement:
    scenario, seed = task
    return run_trial(scenario.measure, seed)


def run_trial(measure: Callable[[Trial], Measurement], seed: int) -> Measurement:
    """One trial; an error of this project is a failed trial, any other is a bug and is raised."""
    try:
        return measure(Trial(seed))
    except TrialFailed as failed:
        return Measurement({}, reason=str(failed))
    except Go2WbcError as error:
        reason = f"{type(error).__name__}: {str(error).splitlines()[0]}"
        return Measurement({}, reason=reason)
