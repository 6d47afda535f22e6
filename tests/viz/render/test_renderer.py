"""What a rendered picture must show: feet on the floor, a shadow under the robot, a sky."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.legs import LEGS
from go2_wbc.robot.description import find_profile
from tests.viz.synthetic import step_ahead
from viz.render.camera import Camera
from viz.render.frame_renderer import render, towards_lights
from viz.render.ground import Relief, grid_of, paint_floor
from viz.render.mesh import Surface, rasterize
from viz.render.robot_meshes import PosedRobot, load_robot_visuals

FOOT_RADIUS = find_profile().foot_radius

_TOUCH = 2.5  # [px] sole in the picture against the projected contact point


@pytest.fixture(scope="module")
def robot() -> PosedRobot:
    return PosedRobot(load_robot_visuals().simplified(0.008))


@pytest.fixture(scope="module")
def q(robot: PosedRobot) -> np.ndarray:
    """It stands on the floor."""
    q = np.concatenate([[0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0], np.tile([0.0, 0.8, -1.5], 4)])
    q[2] += FOOT_RADIUS - robot.feet(q)[:, 2].min()
    return q


def _camera(size: tuple[int, int] = (480, 300)) -> Camera:
    return Camera(np.array([0.0, 0.0, 0.2]), np.deg2rad(-52), np.deg2rad(17), 1.7, size)


def _no_more(surface: Surface) -> Surface:
    """Without a triangle."""
    return replace(surface, triangles=surface.triangles[:0], colors=surface.colors[:0])


@pytest.mark.parametrize("leg", LEGS)
def test_each_foot_meets_the_floor_where_its_contact_point_is(
    robot: PosedRobot, q: np.ndarray, leg: int
) -> None:
    camera = _camera((960, 600))
    contact = robot.feet(q)[leg] - [0.0, 0.0, FOOT_RADIUS]
    surface = robot.at(q)
    near = np.linalg.norm(surface.points - contact, axis=1) < 2 * FOOT_RADIUS
    faces = surface.triangles[near[surface.triangles].all(axis=1)]
    pixels, _ = rasterize(camera.project(surface.points), faces, camera.size)
    lowest = pixels.max() // camera.size[0]
    foot = camera.project(np.array([contact]))[0]
    sphere = camera.project(contact[None] + np.array([0.0, 0.0, FOOT_RADIUS]))[0]
    radius = FOOT_RADIUS * camera.focal_length * sphere[2]
    assert foot[1] - _TOUCH < lowest + 0.5 < sphere[1] + radius + _TOUCH


def test_the_robot_covers_a_good_part_of_the_picture_above_a_darker_floor(
    robot: PosedRobot, q: np.ndarray
) -> None:
    light = towards_lights()[0]
    camera = _camera()
    with_shadow = paint_floor(camera, robot.at(q), light)
    without = paint_floor(camera, _no_more(robot.at(q)), light)
    column, row = (round(value) for value in camera.project(np.array([[0.0, 0.05, 0.0]]))[0, :2])
    assert with_shadow[row, column].max() < 0.7 * without[row, column].max()
    np.testing.assert_allclose(with_shadow[0], without[0], atol=1e-6)
    camera = _camera()
    surface = robot.at(q)
    picture = render(camera, surface)
    empty = render(camera, _no_more(surface))
    changed = np.any(picture != empty, axis=2).mean()
    assert picture.shape == (300, 480, 3)
    assert 0.12 < changed < 0.6
    assert picture.min() < 60
    assert np.abs(picture[0].astype(int) - empty[0]).max() == 0


def test_the_shadow_falls_away_from_the_light() -> None:
    tower = Surface(
        np.array([[-0.02, 0.0, 0.3], [0.02, 0.0, 0.3], [0.0, 0.03, 0.3]]),
        np.tile([0.0, 0.0, 1.0], (3, 1)),
        np.array([[0, 1, 2]]),
        np.ones((1, 3)),
    )
    light = np.array([0.6, 0.0, 0.8])
    camera = _camera()
    picture = paint_floor(camera, tower, light)
    bare = paint_floor(camera, _no_more(tower), light)
    row, column = np.unravel_index(np.argmin((picture / bare)[:, :, 0]), picture.shape[:2])
    darkest = camera.H_floor_picture @ [column + 0.5, row + 0.5, 1.0]
    np.testing.assert_allclose(darkest[:2] / darkest[2], [-0.3 * 0.75, 0.01], atol=0.02)


def test_more_samples_only_smooth_the_edges(robot: PosedRobot, q: np.ndarray) -> None:
    surface = robot.at(q)
    coarse = render(_camera(), surface, samples=1).astype(float)
    fine = render(_camera(), surface, samples=3).astype(float)
    assert np.abs(coarse - fine).mean() < 3.0
    assert np.abs(coarse - fine).max() > 20.0


def test_ground_that_was_seen_hides_the_floor_and_takes_the_shadow(
    robot: PosedRobot, q: np.ndarray
) -> None:
    camera, surface = _camera(), robot.at(q)
    relief = Relief(step_ahead(0.2, at=0.6))
    empty, seen = render(camera, surface), render(camera, surface, ground=relief)
    assert 0.2 < (np.abs(seen.astype(int) - empty).max(axis=2) > 40).mean() < 0.8
    lit = relief.seen_by(camera, _no_more(surface), towards_lights()[0]).colors
    shaded = relief.seen_by(camera, surface, towards_lights()[0]).colors
    assert 0.01 < (shaded < lit - 0.1).any(axis=1).mean() < 0.2


def test_what_is_torn_or_stands_out_alone_is_not_drawn() -> None:
    ground = step_ahead(0.2, at=0.6)
    hole = np.hypot(ground[:, 0], ground[:, 1]).argmin()
    ground[hole + 7, 2] = 0.3
    ground = np.vstack([np.delete(ground, hole, axis=0), [[1.8, 0.0, 0.1]]])
    z = grid_of(ground).z[:80]
    assert np.isnan(z).sum() == 4  # its corners
    assert set(z[~np.isnan(z)].tolist()) == {0.0, 0.2}
    assert np.isnan(grid_of(ground).z[80:]).all()
    assert grid_of(ground, most=2000).cell == 0.05
