"""The rasteriser against brute force and against geometry known in closed form."""

import numpy as np
import pytest

from viz.render.camera import Camera
from viz.render.mesh import rasterize


@pytest.mark.parametrize("seed", range(5))
def test_every_sample_shows_the_nearest_of_the_triangles_that_cover_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    width, height = 37, 23
    points = rng.uniform((-10, -10, 0.2), (width + 10, height + 10, 1.0), (60, 3))
    triangles = rng.permutation(60).reshape(20, 3)
    ahead, aside = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    is_behind = ahead[:, 0] * aside[:, 1] > ahead[:, 1] * aside[:, 0]
    triangles[is_behind] = triangles[is_behind, ::-1]
    pixels, shown = rasterize(points, triangles, (width, height))
    found = np.full(width * height, -1)
    found[pixels] = shown
    for pixel in range(width * height):
        row, column = divmod(pixel, width)
        nearness = [_nearness(points[triangle], column + 0.5, row + 0.5) for triangle in triangles]
        best = max(nearness)
        if found[pixel] < 0:
            assert best == 0
        else:
            assert nearness[found[pixel]] == pytest.approx(best, abs=1e-5)


def _nearness(corners: np.ndarray, x: float, y: float) -> float:
    """Third coordinate of a triangle at a point, 0 outside, by solving for its weights."""
    system = np.vstack([corners[:, :2].T, np.ones(3)])
    weights = np.linalg.solve(system, np.array([x, y, 1.0]))
    return float(weights @ corners[:, 2]) if np.all(weights >= 0) else 0.0


def test_a_triangle_seen_from_behind_is_dropped() -> None:
    points = np.array([[2.0, 2.0, 1.0], [2.0, 12.0, 1.0], [12.0, 2.0, 1.0]])
    front, back = np.array([[0, 1, 2]]), np.array([[0, 2, 1]])
    assert len(rasterize(points, front, (16, 16))[0]) > 40
    assert len(rasterize(points, back, (16, 16))[0]) == 0


def test_neighbouring_triangles_leave_no_crack_between_them() -> None:
    rng = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0)), axis=-1) * 5
    grid[1:-1, 1:-1] += rng.uniform(-1.5, 1.5, (7, 7, 2))
    points = np.column_stack([grid.reshape(-1, 2), np.ones(81)])
    rows = np.arange(81).reshape(9, 9)
    a, b, c, d = (
        part.ravel() for part in (rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:])
    )
    triangles = np.vstack([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    assert len(rasterize(points, triangles, (40, 40))[0]) == 40 * 40


def test_the_floor_under_a_pixel_projects_back_onto_it() -> None:
    camera = Camera(np.array([0.4, -0.2, 0.3]), 0.7, 0.4, 2.0, (64, 48))
    for column, row in ((3.0, 40.0), (50.5, 30.25)):
        x, y, scale = camera.H_floor_picture @ [column, row, 1.0]
        assert scale > 0
        back = camera.project(np.array([[x / scale, y / scale, 0.0]]))[0]
        np.testing.assert_allclose(back[:2], [column, row], atol=1e-9)
