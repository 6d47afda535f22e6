"""Small systems of linear equations."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine


@subroutine
def solve_linear(A: Float[np.ndarray, "n m"], n: int) -> bool:
    """Gauss-Jordan with pivoting: the columns from n on become (A[:, :n])^-1 A[:, n:].

    False for a singular matrix.
    """
    columns = A.shape[1]
    for j in range(n):
        pivot = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[pivot, j]):
                pivot = i
        if not abs(A[pivot, j]) > 0.0:
            return False
        if pivot != j:
            for k in range(j, columns):
                A[j, k], A[pivot, k] = A[pivot, k], A[j, k]
        inverse = 1.0 / A[j, j]
        for k in range(j + 1, columns):
            A[j, k] *= inverse
        for i in range(n):
            if i == j:
                continue
            factor = A[i, j]
            for k in range(j + 1, columns):
                A[i, k] -= factor * A[j, k]
    return True
