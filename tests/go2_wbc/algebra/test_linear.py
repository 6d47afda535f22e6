"""Vectors are numpy's, rotation vectors and quaternions scipy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.algebra.linear import (
    cross,
    dot,
    plus,
    plus_scaled,
    quaternion_of,
    rotation_by,
    rotation_vector,
    solve_linear,
    triple,
    turned,
    turned_back,
)


def test_vectors_are_added_multiplied_and_turned_as_by_numpy() -> None:
    rng = np.random.default_rng(8)
    a, b, R = rng.normal(size=3), rng.normal(size=3), Rotation.random(rng=rng).as_matrix()
    u, v = triple(a), triple(b)
    found = [plus(u, v), plus_scaled(u, 0.3, v), cross(u, v), turned(R, u), turned_back(R, u)]
    np.testing.assert_allclose(found, [a + b, a + 0.3 * b, np.cross(a, b), R @ a, R.T @ a])
    assert dot(u, v) == pytest.approx(a @ b)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 0.3, 2.0, 3.1, np.pi - 1e-7])
def test_a_rotation_and_its_vector(angle: float) -> None:
    rng = np.random.default_rng(6)
    for axis in (*np.eye(3), *-np.eye(3), *rng.normal(size=(20, 3))):
        x, y, z = angle * axis / np.linalg.norm(axis)
        R, truth = np.empty((3, 3)), Rotation.from_rotvec([x, y, z])
        rotation_by((x, y, z), R)
        np.testing.assert_allclose(R, truth.as_matrix(), atol=1e-14)
        np.testing.assert_allclose(rotation_vector(R), (x, y, z), atol=1e-8)


def test_a_quaternion_is_that_of_its_rotation_whichever_part_is_largest() -> None:
    for rotation in (
        *Rotation.random(200, rng=np.random.default_rng(7)),
        *Rotation.create_group("O"),
    ):
        q = np.empty(4)
        quaternion_of(rotation.as_matrix(), q)
        truth = rotation.as_quat()
        np.testing.assert_allclose(q * np.sign(q @ truth), truth, atol=1e-14)


def test_equations_are_solved_where_the_diagonal_is_zero_too_and_singular_ones_are_told() -> None:
    rng = np.random.default_rng(9)
    for n in (1, 3, 6):
        for M in (rng.normal(size=(n, n)), rng.permutation(np.eye(n)), np.eye(n)[::-1] * 1e-3):
            b = rng.normal(size=(n, 2))
            A = np.hstack([M, b])
            assert solve_linear(A, n)
            np.testing.assert_allclose(A[:, n:], np.linalg.solve(M, b), rtol=1e-9)
    assert not solve_linear(np.array([[1.0, 2.0, 1.0], [2.0, 4.0, 1.0]]), 2)
