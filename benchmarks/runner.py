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

from benchmarks.scenario import Measurement, Scenario
from benchmarks.trials import Trial, TrialFailed
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
    left = list(tasks)
    while left:
        try:
            for scenario, seed, measurement in _in_one_pool(left, jobs):
                left.remove((scenario, seed))
                yield scenario, seed, measurement
        except BrokenProcessPool:
            suspects, left = left[:jobs], left[jobs:]  # trials are started in their order
            for task in suspects:  # again, each in a process of its own
                try:
                    yield from _in_one_pool([task], 1)
                except BrokenProcessPool:
                    yield *task, Measurement({}, reason="its process died twice")


def run_trial(measure: Callable[[Trial], Measurement], seed: int) -> Measurement:
    """One trial; an error of this project is a failed trial, any other is a bug and is raised."""
    try:
        return measure(Trial(seed))
    except TrialFailed as failed:
        return Measurement({}, reason=str(failed))
    except Go2WbcError as error:
        reason = f"{type(error).__name__}: {str(error).splitlines()[0]}"
        return Measurement({}, reason=reason)
    finally:
        gc.collect()  # robots hold tens of megabytes of records, in cycles


def _in_one_pool(tasks: Sequence[Task], jobs: int) -> Iterator[Done]:
    strangers = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, context, initializer=_settle_in)
    try:
        handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:  # the children inherit it: Ctrl-C interrupts the parent only
            futures = {pool.submit(run_trial, s.measure, seed): (s, seed) for s, seed in tasks}
        finally:
            signal.signal(signal.SIGINT, handler)
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
    threading.Thread(target=_end_with_parent, name="benchmark-parent", daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
