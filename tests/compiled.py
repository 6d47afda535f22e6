"""Compiled against plain: a kernel does what the Python that it is written in does."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from go2_wbc.compilation import Kernel, all_kernels, call_plain, load_kernels

NEAR = 1e-9
"""Relative and absolute: libraries of sines differ in the last bit, and sums of their values."""


@dataclass(slots=True)
class Tally:
    """How often a kernel was called, and how far its Python was off at most."""

    calls: int = 0
    worst: float = 0.0


def copied(value: object) -> object:
    """A record that looks at a copy of its row, a copy of an array, or a number."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if not isinstance(row := getattr(value, "row", None), np.ndarray):
        return value
    if isinstance(getattr(type(value), "row", None), property):  # has its row made
        return SimpleNamespace(row=row.copy())
    copy = object.__new__(type(value))
    object.__setattr__(copy, "row", row.copy())
    return copy


def difference(ours: object, theirs: object) -> float:
    """The greatest difference of two arrays, records or numbers, of the greater of 1 and value."""
    if ours is None:
        return 0.0
    pair = (np.asarray(getattr(value, "row", value), dtype=float) for value in (ours, theirs))
    compiled, plain = (array.ravel() for array in pair)
    with np.errstate(invalid="ignore"):  # inf less inf
        apart = np.abs(compiled - plain) / np.maximum(1.0, np.abs(plain))
    is_same = (compiled == plain) | (np.isnan(compiled) & np.isnan(plain))
    return float(np.max(np.where(is_same, 0.0, apart), initial=0.0))


def assert_plain_is_compiled(
    kernel: Callable[..., object], *arguments: object, tolerance: float = NEAR
) -> None:
    """Both ways, each on copies: what is returned and what is filled must be the same."""
    assert isinstance(kernel, Kernel)
    ours, theirs = ([copied(value) for value in arguments] for _ in range(2))
    given, expected = kernel(*ours), call_plain(kernel, *theirs)
    for compiled, plain in [*zip(ours, theirs, strict=True), (given, expected)]:
        assert difference(compiled, plain) <= tolerance


@contextmanager
def every_call_compared() -> Iterator[dict[str, Tally]]:
    """Until left, kernels that Python calls are run both ways; tallies by name."""
    load_kernels()
    kernels = {kernel.python.__name__: kernel for kernel in all_kernels()}
    before = {name: type(kernel).__call__ for name, kernel in kernels.items()}
    tallies = {name: Tally() for name in kernels}
    for name, kernel in kernels.items():
        type(kernel).__call__ = _compared(kernel, tallies[name])
    try:
        yield tallies
    finally:
        for name, kernel in kernels.items():
            type(kernel).__call__ = before[name]


def _compared(kernel: Kernel, tally: Tally) -> Callable[..., Any]:
    """What calls the kernel and then its Python on copies of what it was given."""
    compiled = type(kernel).__call__

    def call(self: Kernel, *arguments: object) -> object:
        copies = [copied(value) for value in arguments]
        made = compiled(self, *arguments)
        expected = call_plain(self, *copies)
        pairs = [*zip(arguments, copies, strict=True), (made, expected)]
        tally.calls += 1
        tally.worst = max(tally.worst, *(difference(*pair) for pair in pairs))
        return made

    return call
