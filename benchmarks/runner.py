"""Runs many trials in parallel processes, each started fresh.

Started by spawning, so that a child holds no state of the parent; run-time checks of types, which
pytest switches on in the parent, are off in the children. An interrupt ends the children at once,
and so does the end of the parent, however it came.
"""

from __future__ import annotations

import gc
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass

from benchmarks.rows import Family, Measurement
from benchmarks.trials import Trial
from go2_wbc.errors import Go2WbcError

Results = dict[str, dict[int, Measurement]]
"""What every trial gave, by family and seed."""


@dataclass(frozen=True, slots=True)
class BenchProgress:
    """A trial that has just ended.

    Attributes:
        done: how many trials have ended.
        count: how many there are.
        family: name of this trial's family.
        seed: of this trial.
        measurement: what it gave.
    """

    done: int
    count: int
    family: str
    seed: int
    measurement: Measurement


def run_families(
    families: Sequence[Family],
    seeds: int,
    jobs: int,
    on_progress: Callable[[BenchProgress], None] = lambda progress: None,
) -> Results:
    """Every family on its seeds 0, 1, ...

    Args:
        families: what to measure.
        seeds: how many seeds, times the family's factor.
        jobs: processes at a time; 0 runs everything in this process, one after the other.
        on_progress: told after every trial.
    """
    tasks = [(f, seed) for f in families for seed in range(seeds * f.seed_factor)]
    results: Results = {family.name: {} for family in families}
    for family, seed, measurement in _in_processes(tasks, jobs) if jobs else _in_turn(tasks):
        results[family.name][seed] = measurement
        done = sum(map(len, results.values()))
        on_progress(BenchProgress(done, len(tasks), family.name, seed, measurement))
    return results


def run_trial(measure: Callable[[Trial], Measurement], seed: int) -> Measurement:
    """One trial; an error of this project is a failed trial, any other is a bug and is raised."""
    try:
        return measure(Trial(seed))
    except Go2WbcError as error:
        reason = f"{type(error).__name__}: {str(error).splitlines()[0]}"
        return Measurement({}, reason=reason)
    finally:
        gc.collect()  # robots hold tens of megabytes of records, in cycles


_Task = tuple[Family, int]


_Done = tuple[Family, int, Measurement]


def _in_turn(tasks: Sequence[_Task]) -> Iterator[_Done]:
    for family, seed in tasks:
        yield family, seed, run_trial(family.measure, seed)


def _in_processes(tasks: Sequence[_Task], jobs: int) -> Iterator[_Done]:
    """Trials as they end. A process that dies costs no other trial its result."""
    left = list(tasks)
    while left:
        try:
            for family, seed, measurement in _in_one_pool(left, jobs):
                left.remove((family, seed))
                yield family, seed, measurement
        except BrokenProcessPool:
            suspects, left = left[:jobs], left[jobs:]  # trials are started in their order
            for task in suspects:
                yield from _alone(task)


def _alone(task: _Task) -> Iterator[_Done]:
    """One trial again, in a process of its own; if that dies as well, the trial has failed."""
    try:
        yield from _in_one_pool([task], 1)
    except BrokenProcessPool:
        yield *task, Measurement({}, reason="its process died twice")


def _in_one_pool(tasks: Sequence[_Task], jobs: int) -> Iterator[_Done]:
    strangers = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, context, initializer=_settle_in)
    try:
        with _interrupts_ignored():  # inherited by the children: only the parent is interrupted
            futures = {pool.submit(run_trial, f.measure, seed): (f, seed) for f, seed in tasks}
        for future in as_completed(futures):
            yield *futures[future], future.result()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in set(multiprocessing.active_children()) - strangers:
            child.terminate()
        raise
    finally:
        pool.shutdown()


def _settle_in() -> None:
    """Keeps warnings about falls, which the report tells, quiet, and ends with the parent."""
    logging.getLogger().addHandler(logging.NullHandler())
    threading.Thread(target=_end_with_parent, name="bench-parent", daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Ignores Ctrl-C for a moment; does nothing outside the main thread, which gets none."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
