"""What carries a sweep: takes a function and items, gives what came of each as it ends."""

from __future__ import annotations

import pickle
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, final

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


@dataclass(frozen=True, slots=True)
class Failure:
    """Why an item has no value.

    Attributes:
        text: in one line.
        details: the traceback, or empty.
        has_died: whether its process ended, again and again, rather than the function raising.
    """

    text: str
    details: str = ""
    has_died: bool = False


@dataclass(frozen=True, slots=True)
class Ended(Generic[Item]):
    """What came of one item: a value, or a failure.

    Attributes:
        item: which.
        value: what the function returned; None for a failure.
        failure: why there is none.
    """

    item: Item
    value: Any = None
    failure: Failure | None = None


Ends = Generator[Ended[Item], None, None]
"""What came of items, in the order in which they end; closing it ends the processes."""


@final
class Trials(Generic[Item]):
    """The items of a run, by their numbers: what is to be sent, and how often it was.

    Attributes:
        pickled: the items, to be sent.
        waiting: those that no process has.
    """

    def __init__(self, items: Sequence[Item], attempts: int) -> None:
        """All wait; one whose process dies is tried ``attempts`` times."""
        self.pickled = [pickle.dumps(item) for item in items]
        self.waiting = deque(range(len(items)))
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
