"""The engine of a sweep: takes a function and items, and yields each result as it is finished.

A worker is a process with one BLAS thread that answers item by item, and ends when its parent ends,
in whatever way. On Linux workers are forked by ``multiprocessing``'s fork server, which has loaded
the robot: the server takes the time of one start, its workers next to none, and later sweeps of a
process start at once. Where a fork is not safe (macOS) or not possible (Windows), every worker is
started anew.
"""

from __future__ import annotations

import gc
import logging
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, lru_cache
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import FrameType, ModuleType
from typing import TYPE_CHECKING, Any, Generic, TypeVar, final

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerContext, SpawnContext

Item = TypeVar("Item")

ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "BLIS_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
    "NUMEXPR_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0",
}
"""The environment of every worker. As many threads as cores in each of as many workers would get in
each other's way, and a sum split over another number of threads has other bits; so has one in the
order of a set of strings."""
STARTING = threading.Lock()
"""Held while a process starts: the environment of this one is another meanwhile, in all threads."""


@dataclass(frozen=True, slots=True)
class Failure:
    """Why an item has no value."""

    text: str  #: in one line
    details: str = ""  #: the traceback, or empty
    has_died: bool = False
    """Whether its process ended, again and again, rather than the function raising."""


@dataclass(frozen=True, slots=True)
class Ended(Generic[Item]):
    """What came of one item: a value, or a failure."""

    item: Item  #: which
    value: Any = None  #: what the function returned; None for a failure
    failure: Failure | None = None  #: why there is none


Ends = Generator[Ended[Item], None, None]
"""What came of items, in the order in which they end; closing it ends the processes."""


@final
class Trials(Generic[Item]):
    """The items of a run, by their numbers: what is to be sent, and how often it was."""

    def __init__(self, items: Sequence[Item], attempts: int) -> None:
        """All wait; one whose process dies is tried ``attempts`` times."""
        self.pickled = [pickle.dumps(item) for item in items]  #: the items, to be sent
        self.waiting = deque(range(len(items)))  #: those that no process has
        self._items, self._attempts, self._deaths = items, attempts, Counter[int]()

    def ended(self, number: int, answer: bytes) -> Ended[Item]:
        """What came of an item, as ``worker.answer`` says it."""
        return Ended(self._items[number], *pickle.loads(answer))

    def died(self, number: int, why: str) -> Ended[Item] | None:
        """What came of an item whose process has died; None if it is to be tried again."""
        self._deaths[number] += 1
        if self._deaths[number] < self._attempts:
            return None
        text = f"its process died {self._attempts} times: {why}"
        return Ended(self._items[number], failure=Failure(text, has_died=True))


class Engine(ABC):
    """Runs a function over items in processes of its own, each of which is done exactly once."""

    @abstractmethod
    def run(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Ends[Item]:
        """What came of each item.

        Args:
            function: is pickled, and called in other processes.
            items: are pickled, too.

        Raises:
            SweepError: if the engine cannot be used.
        """


_HERE = Path(__file__).parent


def order_of(function: Callable[..., Any]) -> bytes:
    """The message that tells a worker what to call, and where to look for it."""
    return pickle.dumps((sys.path, pickle.dumps(function)))


def answer(order: bytes, item: bytes) -> bytes:
    """The ``reply``, and nothing of what it took."""
    try:
        return reply(order, item)
    finally:
        tidy_up()


def reply(order: bytes, item: bytes, *memory: object) -> bytes:
    """The message that says what came of an item: the value, or the ``Failure``."""
    try:
        return pickle.dumps((_ordered(order)(pickle.loads(item), *memory), None))
    except (Exception, SystemExit) as error:
        text = traceback.format_exception_only(error)[-1].strip()
        return pickle.dumps((None, Failure(text, _told(error))))


def tidy_up() -> None:
    """Free what an item has left: robots hold tens of megabytes of records, in cycles."""
    gc.collect()
    _keep_the_rest()


def _told(error: BaseException) -> str:
    """The traceback from where it leaves this package: its user looks for what is in their file."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        if Path(trace.tb_frame.f_code.co_filename).parent != _HERE:
            break
        trace = trace.tb_next
    return "".join(traceback.format_exception(type(error), error, trace))


_keep_the_rest = cache(gc.freeze)
"""What the first item has imported and kept is not looked through again: that takes long."""


@lru_cache(maxsize=1)
def _ordered(order: bytes) -> Callable[..., Any]:
    """The function of an order: unpickled once, so that what it keeps is kept."""
    path, function = pickle.loads(order)
    sys.path += [place for place in path if place not in sys.path]  # after one's own
    return pickle.loads(function)


def serve(pipe: Connection, order: bytes, environment: Mapping[str, str], *memory: object) -> None:
    """Answer what comes through ``pipe``, as a process that was started anew with ``environment``.

    The function is called with the ``memory`` that it shares with the parent, if there is any.
    Until the parent closes the pipe, or ends.
    """
    if sys.flags.hash_randomization:
        sys.exit(
            "multiprocessing's fork server runs already, with sets in random order: sweep first"
        )
    gc.freeze()  # the collector passes over what was loaded before the fork, which is shared
    os.setpgid(0, 0)  # out of reach of Ctrl-C, which was put off for the start
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    os.dup2(2, 1)
    os.environ.clear()
    os.environ.update(environment)
    logging.getLogger().addHandler(logging.NullHandler())  # a fall is told by its row
    if (random := sys.modules.get("numpy.random")) is not None:
        random.seed()  # Python's own numbers are seeded anew by a fork
    with suppress(EOFError):
        while True:
            pipe.send_bytes(reply(order, awaited(pipe), *memory))
            tidy_up()  # while nobody waits


def awaited(pipe: Connection) -> bytes:
    """What comes through ``pipe``; a short while it is looked for without falling asleep.

    Raises:
        EOFError: if the other end is closed.
    """
    latest = time.perf_counter() + AWAKE
    while not pipe.poll() and time.perf_counter() < latest:
        pass
    return pipe.recv_bytes()


def _end_with_parent() -> None:
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(0)


ATTEMPTS = 2
"""How often an item is tried whose worker dies: the first time it may have been anything."""
AWAKE = 3e-4
"""Time [s] for which what comes at once is waited for awake: to wake a processor takes 0.05 ms."""
DYING = 0.2
"""Time [s] after which a server of processes that has been killed has ended, and another starts."""
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
        self._workers = workers

    def run(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Ends[Item]:
        """What came of each item; see ``Engine.run``."""
        trials, order = Trials(items, ATTEMPTS), order_of(function)
        busy: dict[Worker, int] = {}
        try:
            while trials.waiting or busy:
                while trials.waiting and len(busy) < self._workers:
                    _give(Worker(order), trials, busy)
                ready = connection.wait([handle for one in busy for handle in one.handles])
                for worker in [one for one in busy if any(map(ready.__contains__, one.handles))]:
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
    if not trials.waiting:
        worker.end()
        return
    busy[worker] = trials.waiting.popleft()
    worker.give(trials.pickled[busy[worker]])


@final
class Worker:
    """A process that calls one function, item by item, until it is ended.

    Attributes:
        handles: one is ready, for ``multiprocessing.connection.wait``, when it has answered or has
            ended.
    """

    def __init__(self, order: bytes, *memory: object) -> None:
        """Start it, in the folder and environment of this process.

        Args:
            order: its function.
            memory: shared with it (``RawArray``); the function is called with it, behind the item.
        """
        context = processes()
        self._pipe, its_end = context.Pipe()
        with its_end:
            arguments = (its_end, order, {**os.environ, **ONE_THREAD}, *memory)
            self._process = context.Process(target=serve, args=arguments, name="worker")
            start(self._process)
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

    def wait(self) -> bytes | None:
        """What comes of the item, as soon as it does; None if the worker has ended."""
        with suppress(EOFError, OSError):
            return awaited(self._pipe)
        return None

    def end(self) -> str:
        """End it at once, if it has not; how it has ended."""
        self._pipe.close()
        self._process.kill()
        self._process.join()
        code = self._process.exitcode or 0
        self._process.close()
        return f"exit code {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"


def processes() -> ForkServerContext | SpawnContext:
    """How processes are made that ``start`` starts."""
    return multiprocessing.get_context("forkserver" if sys.platform == "linux" else "spawn")


@contextmanager
def _later_interrupts() -> Generator[None]:
    """Ctrl-C comes behind the block: another thread may take a signal that this one masks."""
    usual = signal.getsignal(signal.SIGINT)
    if not callable(usual) or threading.current_thread() is not threading.main_thread():
        yield
        return
    came = list[tuple[int, FrameType | None]]()
    signal.signal(signal.SIGINT, lambda *how: came.append(how))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if came:
            usual(*came[0])


def start(process: BaseProcess, *modules: str) -> None:
    """Start a process with the environment of a worker, and before the first one the fork server.

    The server loads these ``modules``, too, and finds all that this process does; some of the
    environment is heeded by an interpreter that starts only. The main module of this process is
    hidden, which a worker would run again. Ctrl-C has to wait, in the process, too: the server
    would end with a traceback.
    """
    with STARTING, _later_interrupts():
        multiprocessing.set_forkserver_preload([*LOADED, *modules])
        resource_tracker.ensure_running()  # it lets Ctrl-C in again when it starts
        main, before = sys.modules["__main__"], dict(os.environ)
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        sys.modules["__main__"] = ModuleType("__main__")
        own = {**ONE_THREAD, "PYTHONPATH": os.pathsep.join(sys.path)}
        os.environ.update(own)
        try:
            process.start()
        except (EOFError, OSError):  # the server of processes is just dying
            time.sleep(DYING)
            process.start()
        finally:
            for name in own:
                del os.environ[name]
            os.environ.update(before)
            sys.modules["__main__"] = main
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
