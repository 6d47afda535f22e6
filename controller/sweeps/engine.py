"""What carries a sweep: takes a function and items, gives what came of each as it ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

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


class Engine(ABC):
    """Runs a function over items in processes of its own, each of which is done exactly once."""

    @abstractmethod
    def run(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Iterator[Ended[Item]]:
        """What came of each item, in the order in which they end.

        Closing the iterator ends the processes.

        Args:
            function: is pickled, and called in other processes.
            items: are pickled, too.

        Raises:
            SweepError: if the engine cannot be used.
        """
