"""Compiled against plain: a kernel does what the Python that it is written in does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from go2_wbc.compilation import Kernel, _call_plain

SAME = 1e-9
"""Relative and absolute: libraries of sines differ in the last bit, and sums of their values."""


def assert_plain_is_compiled(
    kernel: Callable[..., object], *arguments: object, tolerance: float = SAME
) -> None:
    """Both ways, each on copies: what is returned and what is filled must be the same."""
    assert isinstance(kernel, Kernel)
    ours, theirs = ([_copied(value) for value in arguments] for _ in range(2))
    given, expected = kernel(*ours), _call_plain(kernel, *theirs)
    pairs = [(given, expected)] if given is not None else []
    pairs += [
        (getattr(a, "row", a), getattr(b, "row", b)) for a, b in zip(ours, theirs, strict=True)
    ]
    for compiled, plain in pairs:
        np.testing.assert_allclose(
            np.asarray(compiled, float), np.asarray(plain, float), tolerance, tolerance
        )


def _copied(value: object) -> object:
    """A record that looks at a copy of its row, a copy of an array, or a number."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if not isinstance(row := getattr(value, "row", None), np.ndarray):
        return value
    copy = object.__new__(type(value))
    object.__setattr__(copy, "row", row.copy())
    return copy
