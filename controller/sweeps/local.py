"""Workers on this machine: each a Python of its own, started anew, with one thread for its BLAS."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from queue import SimpleQueue
from typing import IO, Any, final

from controller.sweeps.engine import ONE_THREAD, Ended, Engine, Failure, Item
from controller.sweeps.worker import order_of, read_message, write_message

ATTEMPTS = 2
"""How often an item is tried whose worker dies: the first time it may have been anything."""
_START = "import sys; sys.path[:] = {}; from controller.sweeps.worker import main; main()"
"""What a worker runs: it finds the same modules as its parent."""


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

    def run(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Iterator[Ended[Item]]:
        """What came of each item; see ``Engine.run``."""
        pool = _Pool(order_of(function), [pickle.dumps(item) for item in items], self._workers)
        try:
            while not pool.is_done:
                for number, value, failure in pool.wait():
                    yield Ended(items[number], value, failure)
        finally:
            pool.close()


class _Pool:
    """Some workers, and which of them does which item."""

    def __init__(self, order: bytes, items: Sequence[bytes], size: int) -> None:
        self._order, self._items, self._size = order, items, size
        self._waiting, self._deaths = deque(range(len(items))), Counter[int]()
        self._busy: dict[_Worker, int] = {}
        self._answers: _Answers = SimpleQueue()

    @property
    def is_done(self) -> bool:
        return not (self._waiting or self._busy)

    def wait(self) -> Iterator[tuple[int, Any, Failure | None]]:
        """Until a worker says something: the item that has ended by it, if one has."""
        while self._waiting and len(self._busy) < self._size:
            self._give(_Worker(self._order, self._answers))
        worker, message = self._answers.get()
        number = self._busy.pop(worker, None)
        if number is None:  # a worker has ended that had nothing left to do
            return
        if isinstance(message, bytes):
            self._give(worker)  # before the caller takes its time with the value
            yield number, *pickle.loads(message)
            return
        self._deaths[number] += 1
        if self._deaths[number] < ATTEMPTS:
            self._waiting.appendleft(number)
            return
        text = f"its process died {ATTEMPTS} times: {_cause(message)}"
        yield number, None, Failure(text, has_died=True)

    def close(self) -> None:
        for worker in self._busy:
            worker.end()

    def _give(self, worker: _Worker) -> None:
        if not self._waiting:
            worker.end()
            return
        self._busy[worker] = self._waiting.popleft()
        worker.give(self._items[self._busy[worker]])


class _Worker:
    """A worker process, and the thread that listens to it."""

    def __init__(self, order: bytes, answers: _Answers) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _START.format(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **ONE_THREAD},
            process_group=0,  # out of reach of Ctrl-C
        )
        self.give(order)
        threading.Thread(target=self._listen, args=(answers,), name="worker", daemon=True).start()

    def give(self, message: bytes) -> None:
        """Send the order, or an item; if the worker has died, the listener tells."""
        with suppress(OSError, ValueError):  # a pipe that is broken, or closed
            write_message(_pipe(self._process.stdin), message)

    def end(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.wait()

    def _listen(self, answers: _Answers) -> None:
        with suppress(OSError), self._process:
            while (message := read_message(_pipe(self._process.stdout))) is not None:
                answers.put((self, message))
        answers.put((self, self._process.returncode))


def _pipe(stream: IO[bytes] | None) -> IO[bytes]:
    if stream is None:
        raise ValueError("a worker was started without pipes")
    return stream


_Answers = SimpleQueue[tuple[_Worker, bytes | int]]
"""What workers say, or with which code they ended."""


def _cause(code: int) -> str:
    """What an exit code of ``subprocess`` says."""
    with suppress(ValueError):
        return f"killed by {signal.Signals(-code).name}"
    return f"exit code {code}"
