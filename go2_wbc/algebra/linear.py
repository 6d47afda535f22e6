"""Small systems of linear equations: Gauss-Jordan elimination, and H = L L' (Cholesky)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine

Vector = Float[np.ndarray, " n"]
Square = Float[np.ndarray, "n n"]
DEFINITE = 1e-14
"""Share of a diagonal entry of H that must be left as its pivot."""


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


@subroutine
def factorise(H: Square, L: Square) -> bool:
    """The lower triangle of L in H = L L', from that of H; False if H is not positive definite."""
    for j in range(H.shape[0]):
        pivot = H[j, j]
        for k in range(j):
            pivot -= L[j, k] * L[j, k]
        if not pivot > DEFINITE * H[j, j]:  # a nan fails too
            return False
        root = np.sqrt(pivot)
        inverse = 1.0 / root
        L[j, j] = root
        for i in range(j + 1, H.shape[0]):
            value = H[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            L[i, j] = value * inverse
    return True


@subroutine
def solve_factorised(L: Square, g: Vector, x: Vector) -> None:
    """x = -(L L')^-1 g."""
    n = len(g)
    for i in range(n):
        value = -g[i]
        for k in range(i):
            value -= L[i, k] * x[k]
        x[i] = value / L[i, i]
    for i in range(n - 1, -1, -1):
        value = x[i]
        for k in range(i + 1, n):
            value -= L[k, i] * x[k]
        x[i] = value / L[i, i]
