"""Results computed for motions, kept for motions that are nearly the same.

Most of a check is work on single samples, and most samples of an edited motion are unchanged,
perhaps shifted in time. A ``Memory`` stores each result under its input: for a sample its numbers,
rounded to ``QUANTUM``, which is far below what changes any limit; for a compiled part its keys.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar, final

import numpy as np
from jaxtyping import Float, Int, UInt64

QUANTUM = 1e-7
"""What numbers are rounded to [m, rad and what is made of them]: times that are shifted change
accelerations by 1e-11."""
MOST_ROWS, MOST_PARTS = 40_000, 2_000  #: How many are kept of a kind; beyond that all are let go
LEAST_ROOM = 1024  #: Rows that there is room for at first
Rows = Int[np.ndarray, " rows"]
Numbers = Float[np.ndarray, "n k"]
Keys = UInt64[np.ndarray, " _"]
Kept = TypeVar("Kept")


class _Kind:
    def __init__(self) -> None:
        self.count, self.values = 0, np.empty((0, 0))
        self._keys, self._places = np.empty(0, np.uint64), np.empty(0, int)  # by keys

    def found(self, keys: Keys) -> Rows:
        """Where what is known of these rows is; -1 where nothing is."""
        at = np.searchsorted(self._keys, keys)
        is_known = np.append(self._keys, 0)[at] == keys
        is_known &= at < len(self._keys)
        return np.where(is_known, np.append(self._places, -1)[at], -1)

    def add(self, keys: Keys, found: Numbers) -> Rows:
        """Keep them; where they are."""
        start, self.count = self.count, self.count + len(found)
        if self.count > len(self.values):
            room = np.empty((max(2 * self.count, LEAST_ROOM), found.shape[1]))
            if start:
                room[:start] = self.values[:start]
            self.values = room
        self.values[start : self.count] = found
        places, order = np.arange(start, self.count), np.argsort(keys)
        at = np.searchsorted(self._keys, keys[order])
        self._keys = np.insert(self._keys, at, keys[order])
        self._places = np.insert(self._places, at, places[order])
        return places


@final
class Memory:
    """For one robot in one world."""

    def __init__(self) -> None:
        self._kinds = dict[Hashable, _Kind]()
        self._parts = dict[Hashable, Any]()
        self.last: Any = None  #: What is known of the last motion as a whole
        self._factors = np.random.default_rng(0).integers(2**63, size=256, dtype=np.uint64) | 1

    def part(self, key: Hashable, make: Callable[[], Kept]) -> Kept:
        """What ``make`` gave for this key."""
        if key not in self._parts:
            if len(self._parts) >= MOST_PARTS:
                self._parts.clear()
            self._parts[key] = make()
        return self._parts[key]

    def rows(
        self, name: Hashable, given: Numbers, work: Callable[[Rows], Numbers]
    ) -> Float[np.ndarray, "n m"]:
        """What ``work`` gives for these rows of ``given``, asked only for those that are new."""
        kind, keys = self._kinds.setdefault(name, _Kind()), self._keys(given)
        places = kind.found(keys)
        new = np.flatnonzero(places < 0)
        if len(new):
            if kind.count + len(new) > MOST_ROWS:
                self._kinds[name] = kind = _Kind()
                new = np.arange(len(keys))
            places[new] = kind.add(keys[new], work(new))
        return kind.values[places]

    def _keys(self, given: Numbers) -> Keys:
        """A number of 64 bits for every row: equal for equal ones, else it is a chance in 2^64."""
        whole = np.rint(given / QUANTUM).astype(np.int64).view(np.uint64)
        mixed = whole * self._factors[: whole.shape[1]]
        mixed ^= mixed >> np.uint64(29)
        return np.einsum("ij,j->i", mixed, self._factors[-whole.shape[1] :])


def by_rows(
    memory: Memory | None, name: Hashable, given: Numbers, work: Callable[[Rows], Numbers]
) -> Float[np.ndarray, "n m"]:
    """``work`` on every row of ``given``, or with a ``memory`` on those that are new to it."""
    if memory is None:
        return work(np.arange(len(given)))
    return memory.rows(name, given, work)
