"""Draws one picture of the robot on its floor, in numpy and Pillow alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int, UInt8

from go2_wbc.robot.rotations import yaw_rotation
from viz.render.camera import Camera
from viz.render.floor import paint_floor
from viz.render.ground import Relief
from viz.render.mesh import Surface
from viz.render.rasterizer import plane_coefficients, rasterize

# Towards the key light and a weak fill light, world frame.
_LIGHTS = np.array([[0.35, -0.55, 0.95], [-0.8, -0.3, 0.35]])
_KEY_STRENGTH, _FILL_STRENGTH = 0.64, 0.16  # diffuse intensities
_SKY, _GROUND = 0.53, 0.30  # ambient intensities on faces that look up and down
_GLOSS, _SHININESS = 0.26, 28.0  # strength and exponent of the highlight (Blinn-Phong)
_EXTRAS_LEAD = 1.1  # extras count as nearer: an arrow shows in front of the leg that it stands in


def render(
    camera: Camera,
    robot: Surface,
    extras: Sequence[Surface] = (),
    *,
    ground: Relief | None = None,
    samples: int = 2,
    turn: float = 0.0,
) -> UInt8[np.ndarray, "h w 3"]:
    """One picture.

    Args:
        camera: view and picture size.
        robot: the robot's surface; throws the shadow.
        extras: more geometry, without shadow and in front, such as arrows.
        ground: the robot has seen.
        samples: edge of the sample grid in each pixel; 2 gives four samples.
        turn: of the lights about the vertical [rad], as when they move with the camera.
    """
    width, height = camera.size
    lights = towards_lights(turn)
    picture = paint_floor(camera, robot, lights[0])
    relief = [] if ground is None else [ground.seen_by(camera, robot, lights[0])]
    solids = Surface.joined([robot, *extras, *relief])
    finer = replace(camera, size=(samples * width, samples * height))
    projected = finer.project(solids.points)
    shown_through = sum(len(extra.points) for extra in extras)
    projected[len(robot.points) :, 2][:shown_through] *= _EXTRAS_LEAD
    brightness = _vertex_brightness(solids.normals, camera.R_camera_world[2], lights)
    color, coverage = _solids(solids, projected, brightness, camera.size, samples)
    picture *= 1 - coverage.reshape(height, width, 1)
    picture += color.reshape(height, width, 3)
    return np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)


def towards_lights(turn: float = 0.0) -> Float[np.ndarray, "2 3"]:
    """Unit vectors towards the key and the fill light, turned about the vertical [rad]."""
    lights = _LIGHTS @ yaw_rotation(turn).T
    return lights / np.linalg.norm(lights, axis=1, keepdims=True)


def _solids(
    solids: Surface,
    projected: Float[np.ndarray, "n 3"],
    brightness: Float[np.ndarray, "n 2"],
    size: tuple[int, int],
    samples: int,
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, " k"]]:
    """Colour (times coverage) and coverage of each pixel by solid geometry."""
    width, height = size
    sample, triangle = rasterize(projected, solids.triangles, (width * samples, height * samples))
    is_seen = np.bincount(triangle, minlength=len(solids.triangles)) > 0
    faces, slot = np.flatnonzero(is_seen), (np.cumsum(is_seen) - 1)[triangle]
    row, column = np.divmod(sample, width * samples)
    corners = solids.triangles[faces].T
    diffuse, highlight = _interpolated(projected, corners, brightness, (row, column, slot))
    pixel = (row // samples) * width + column // samples
    count = width * height
    share = 1 / samples**2
    color = np.empty((count, 3), dtype=np.float32)
    for channel in range(3):
        tint = solids.colors[faces, channel].astype(np.float32)[slot]
        value = np.minimum(tint * diffuse + highlight, 1)
        color[:, channel] = np.bincount(pixel, value, count) * share
    return color, (np.bincount(pixel, minlength=count) * share).astype(np.float32)


def _interpolated(
    projected: Float[np.ndarray, "n 3"],
    corners: Int[np.ndarray, "3 f"],
    values: Float[np.ndarray, "n c"],
    samples: tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"], Int[np.ndarray, " k"]],
) -> list[Float[np.ndarray, " k"]]:
    """Vertex values at samples, linear over each triangle and never beyond its corners.

    ``samples`` are row and column of each, and its column of ``corners``, the visible triangles.
    """
    row, column, slot = samples
    x, y = projected[:, 0][corners], projected[:, 1][corners]
    result = []
    for value in values.T[:, corners]:
        planes = plane_coefficients(x, y, value)
        step_x, step_y, start = (plane.astype(np.float32)[slot] for plane in planes)
        level = start + step_x * (column + np.float32(0.5)) + step_y * (row + np.float32(0.5))
        low, high = value.min(axis=0).astype(np.float32), value.max(axis=0).astype(np.float32)
        result.append(np.clip(level, low[slot], high[slot]))
    return result


def _vertex_brightness(
    normals: Float[np.ndarray, "n 3"],
    back: Float[np.ndarray, "3"],
    lights: Float[np.ndarray, "2 3"],
) -> Float[np.ndarray, "n 2"]:
    """Diffuse (times the material's colour) and white highlight, seen from the way ``back``."""
    key, fill = lights
    half = key + back
    half /= np.linalg.norm(half)
    upward = 0.5 + 0.5 * normals[:, 2]
    diffuse = _GROUND + (_SKY - _GROUND) * upward
    diffuse += _KEY_STRENGTH * np.maximum(normals @ key, 0)
    diffuse += _FILL_STRENGTH * np.maximum(normals @ fill, 0)
    highlight = _GLOSS * np.maximum(normals @ half, 0) ** _SHININESS
    return np.column_stack([diffuse, highlight])
