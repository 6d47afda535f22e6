"""Workers on this machine: each a process of its own, with one thread for its BLAS.

On Linux they are forked by ``multiprocessing``'s fork server, which has loaded the robot: it takes
the time of one start, its workers next to none, and later sweeps of a process are under way at
once. Where a fork is not safe (macOS) or unknown (Windows), every worker is started anew.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import connection, resource_tracker
from types import ModuleType
from typing import Any, final

from controller.sweeps.engine import ONE_THREAD, Ends, Engine, Item, Trials
from controller.sweeps.worker import order_of, serve

ATTEMPTS = 2
"""How often an item is tried whose worker dies: the first time it may have been anything."""
LOADED = ("controller.sweeps.motion_study",)
"""What the fork server loads: with it the robot, the simulator and the motions."""


def processors() -> int:
    """How many processors this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@final
class LocalEngine(Engine):
    """Runs items in a number of workers on this machine.

    A worker that dies costs no other item its result; its own is tried once more. Ctrl-C reaches
    the parent only, which ends the workers; and they end with the parent, however that came.
    """

    def __init__(self, workers: int) -> None:
        """Use at most ``workers`` processes at a time."""
        self._workers = workers

    def run(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Ends[Item]:
        """What came of each item; see ``Engine.run``."""
        trials, order = Trials(items, ATTEMPTS), order_of(function)
        busy: dict[Worker, int] = {}
        try:
            while trials.waiting or busy:
                while trials.waiting and len(busy) < self._workers:
                    _give(Worker(order), trials, busy)
                for worker in _with_news(busy):
                    number, answer = busy.pop(worker), worker.answer()
                    if answer is not None:
                        _give(worker, trials, busy)  # before the caller takes its time
                        yield trials.ended(number, answer)
                    elif (ended := trials.died(number, worker.end())) is not None:
                        yield ended
                    else:
                        trials.waiting.appendleft(number)
        finally:
            for worker in busy:
                worker.end()


def _give(worker: Worker, trials: Trials[Any], busy: dict[Worker, int]) -> None:
    """Have a worker do what waits, or end it."""
    if not trials.waiting:
        worker.end()
        return
    busy[worker] = trials.waiting.popleft()
    worker.give(trials.pickled[busy[worker]])


def _with_news(workers: Collection[Worker]) -> list[Worker]:
    """Those that have answered or ended, at least one."""
    ready = connection.wait([handle for worker in workers for handle in worker.handles])
    return [worker for worker in workers if any(handle in ready for handle in worker.handles)]


@final
class Worker:
    """A process that calls one function, item by item, until it is ended.

    Attributes:
        handles: one is ready, for ``multiprocessing.connection.wait``, when it has answered or has
            ended.
    """

    def __init__(self, order: bytes) -> None:
        """Start it, in the folder and environment of this process; ``order`` is its function."""
        context = multiprocessing.get_context("forkserver" if sys.platform == "linux" else "spawn")
        self._pipe, its_end = context.Pipe()
        arguments = (its_end, order, {**os.environ, **ONE_THREAD})
        self._process = context.Process(target=serve, args=arguments, name="worker")
        with its_end, _start():
            try:
                self._process.start()
            except (EOFError, OSError):  # the server of processes has just died: another one
                self._process.start()
        self.handles = (self._pipe, self._process.sentinel)

    def give(self, item: bytes) -> None:
        """Send an item; if the worker has died, ``answer`` tells."""
        with suppress(OSError):
            self._pipe.send_bytes(item)

    def answer(self) -> bytes | None:
        """What came of the item; None if the worker has ended."""
        with suppress(EOFError, OSError):
            if self._pipe.poll():
                return self._pipe.recv_bytes()
        return None

    def end(self) -> str:
        """End it at once, if it has not; how it has ended."""
        self._pipe.close()
        self._process.kill()
        self._process.join()
        code = self._process.exitcode or 0
        self._process.close()
        return f"exit code {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"


@contextmanager
def _start() -> Iterator[None]:
    """While a worker starts, and with the first one the fork server.

    The server finds the modules that this process does, and has the environment of a worker: some
    of it is heeded by an interpreter that starts only. The main module of this process is hidden,
    which a worker would run again. Ctrl-C has to wait: the server would end with a traceback.
    """
    multiprocessing.set_forkserver_preload(list(LOADED))
    resource_tracker.ensure_running()  # it lets Ctrl-C in again when it starts
    main, before = sys.modules["__main__"], dict(os.environ)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    sys.modules["__main__"] = ModuleType("__main__")
    own = {**ONE_THREAD, "PYTHONPATH": os.pathsep.join(sys.path)}
    os.environ.update(own)
    try:
        yield
    finally:
        for name in own:
            del os.environ[name]
        os.environ.update(before)
        sys.modules["__main__"] = main
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
