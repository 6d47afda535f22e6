"""Workers on this machine: each a process of its own, with one thread for its BLAS."""

from __future__ import annotations

import os
import pickle
import sys
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from queue import SimpleQueue
from typing import Any, final

from controller.sweeps.engine import Ended, Engine, Failure, Item
from controller.sweeps.processes import start_process
from controller.sweeps.worker import modules_of, order_of, read_message, write_message

ATTEMPTS = 2
"""How often an item is tried whose worker dies: the first time it may have been anything."""


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
        pickled = [pickle.dumps(item) for item in items]
        modules = modules_of(pickle.dumps(function), *pickled[:1])
        pool = _Pool(partial(_Worker, modules, order_of(function)), pickled, self._workers)
        try:
            while not pool.is_done:
                for number, value, failure in pool.wait():
                    yield Ended(items[number], value, failure)
        finally:
            pool.close()


class _Pool:
    """Some workers, and which of them does which item."""

    def __init__(
        self, start: Callable[[_Answers], _Worker], items: Sequence[bytes], size: int
    ) -> None:
        self._start, self._items, self._size = start, items, size
        self._waiting, self._deaths = deque(range(len(items))), Counter[int]()
        self._busy: dict[_Worker, int] = {}
        self._answers: _Answers = SimpleQueue()

    @property
    def is_done(self) -> bool:
        return not (self._waiting or self._busy)

    def wait(self) -> Iterator[tuple[int, Any, Failure | None]]:
        """Until a worker says something: the item that has ended by it, if one has."""
        while self._waiting and len(self._busy) < self._size:
            self._give(self._start(self._answers))
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
        text = f"its process died {ATTEMPTS} times: {message}"
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

    def __init__(self, modules: Sequence[str], order: bytes, answers: _Answers) -> None:
        self._process = start_process(modules)
        self.give(order)
        self._listener = threading.Thread(
            target=self._listen, args=(answers,), name="worker", daemon=True
        )
        self._listener.start()

    def give(self, message: bytes) -> None:
        """Send the order, or an item; if the worker has died, the listener tells."""
        with suppress(OSError, ValueError):  # a pipe that is broken, or closed
            write_message(self._process.stdin, message)

    def end(self) -> None:
        """End it at once."""
        self._process.kill()
        self._listener.join()

    def _listen(self, answers: _Answers) -> None:
        while (message := read_message(self._process.stdout)) is not None:
            answers.put((self, message))
        answers.put((self, self._process.close()))


_Answers = SimpleQueue[tuple[_Worker, bytes | str]]
"""What workers say, or how they ended."""
