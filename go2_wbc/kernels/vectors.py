"""Vectors in rows, for kernels that take rows; ``algebra.vectors`` has the rest."""

from __future__ import annotations

from go2_wbc.kernels.compilation import subroutine

V3 = "UniTuple(f8, 3)"
"""A vector, in the notation of signatures."""
AXES = f"UniTuple({V3}, 3)"
"""The three axes of a frame."""


@subroutine(f"{V3}(f8[::1], i8)")
def vector(numbers, start):
    """Three numbers of a row."""
    return numbers[start], numbers[start + 1], numbers[start + 2]


@subroutine(f"void(f8[::1], i8, {V3})")
def put(row, start, a):
    """Put a vector in its place in a row."""
    row[start], row[start + 1], row[start + 2] = a
