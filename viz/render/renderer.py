"""Draws one picture of the robot on its floor, in numpy and Pillow alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int, UInt8

from viz.render.camera import Camera
from viz.render.floor import FloorStyle, paint_floor
from viz.render.mesh import Surface
from viz.render.rasterizer import doubled_area, plane_coefficients, rasterize


@dataclass(frozen=True, slots=True)
class Lighting:
    """A key light, a weak fill light and a sky that is brighter above than below.

    Attributes:
        key: towards the key light, world frame, need not be unit.
        fill: towards the fill light.
        key_strength, fill_strength: diffuse intensities.
        sky, ground: ambient intensity on faces that look up and down.
        gloss: strength of the highlight.
        shininess: exponent of the highlight (Blinn-Phong).
    """

    key: tuple[float, float, float] = (0.35, -0.55, 0.95)
    fill: tuple[float, float, float] = (-0.8, -0.3, 0.35)
    key_strength: float = 0.64
    fill_strength: float = 0.16
    sky: float = 0.53
    ground: float = 0.30
    gloss: float = 0.26
    shininess: float = 28.0

    def turned(self, angle: float) -> Lighting:
        """The same lights turned about the vertical [rad], as when they move with the camera."""
        c, s = np.cos(angle), np.sin(angle)
        (kx, ky, kz), (fx, fy, fz) = self.key, self.fill
        return replace(
            self,
            key=(float(c * kx - s * ky), float(s * kx + c * ky), kz),
            fill=(float(c * fx - s * fy), float(s * fx + c * fy), fz),
        )

    @property
    def towards_key(self) -> Float[np.ndarray, "3"]:
        """Unit vector towards the key light."""
        key = np.array(self.key)
        return key / np.linalg.norm(key)


@dataclass(frozen=True, slots=True)
class RenderStyle:
    """How a picture is drawn.

    Attributes:
        samples: edge of the sample grid in each pixel; 2 gives four samples.
        floor: the floor.
        lighting: the lights.
        extras_lead: extras count as nearer by this factor, so that an arrow shows in front of the
            leg that it stands in.
    """

    samples: int = 2
    extras_lead: float = 1.1
    floor: FloorStyle = field(default_factory=FloorStyle)
    lighting: Lighting = field(default_factory=Lighting)


def render(
    camera: Camera,
    robot: Surface,
    style: RenderStyle,
    *,
    extras: Sequence[Surface] = (),
) -> UInt8[np.ndarray, "h w 3"]:
    """One picture.

    Args:
        camera: view and picture size.
        robot: the robot's surface; throws the shadow.
        style: lights, floor, samples per pixel.
        extras: more geometry, without shadow and in front, such as arrows.
    """
    width, height = camera.size
    picture = paint_floor(camera, robot, style.lighting.towards_key, style.floor)
    solids = Surface.joined([robot, *extras]) if extras else robot
    projected = camera.scaled(style.samples).project(solids.points)
    projected[len(robot.points) :, 2] *= style.extras_lead
    color, coverage = _solids(camera, solids, projected, style)
    picture *= 1 - coverage.reshape(height, width, 1)
    picture += color.reshape(height, width, 3)
    return np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)


def _solids(
    camera: Camera,
    solids: Surface,
    projected: Float[np.ndarray, "n 3"],
    style: RenderStyle,
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, " k"]]:
    """Colour (times coverage) and coverage of each pixel by solid geometry."""
    fine = camera.scaled(style.samples)
    seen = rasterize(projected, solids.triangles, fine.size)
    is_seen = np.zeros(len(solids.triangles), dtype=bool)
    is_seen[seen.triangle] = True
    faces, slot = np.flatnonzero(is_seen), (np.cumsum(is_seen) - 1)[seen.triangle]
    row, column = np.divmod(seen.pixel, fine.size[0])
    corners = solids.triangles[faces].T
    brightness = _vertex_brightness(camera, solids, style.lighting)
    diffuse, highlight = _interpolated(projected, corners, brightness, (row, column, slot))
    pixel = (row // style.samples) * camera.size[0] + column // style.samples
    count = camera.size[0] * camera.size[1]
    share = 1 / style.samples**2
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

    Args:
        projected: the vertices in the picture.
        corners: vertices of each visible triangle.
        values: the quantities, a column each.
        samples: row, column and triangle of each sample.
    """
    row, column, slot = samples
    x, y = projected[:, 0][corners], projected[:, 1][corners]
    area = doubled_area(x, y)
    result = []
    for channel in range(values.shape[1]):
        value = values[:, channel][corners]
        planes = plane_coefficients(x, y, area, value)
        step_x, step_y, start = (plane.astype(np.float32)[slot] for plane in planes)
        level = start + step_x * (column + np.float32(0.5)) + step_y * (row + np.float32(0.5))
        low, high = value.min(axis=0).astype(np.float32), value.max(axis=0).astype(np.float32)
        result.append(np.clip(level, low[slot], high[slot]))
    return result


def _vertex_brightness(
    camera: Camera, solids: Surface, lighting: Lighting
) -> Float[np.ndarray, "n 2"]:
    """Diffuse (times the material's colour) and white highlight at each vertex."""
    normals = solids.normals
    key = lighting.towards_key
    fill = np.array(lighting.fill) / np.linalg.norm(lighting.fill)
    half = key + camera.R_camera_world[2]
    half /= np.linalg.norm(half)
    upward = 0.5 + 0.5 * normals[:, 2]
    diffuse = lighting.ground + (lighting.sky - lighting.ground) * upward
    diffuse += lighting.key_strength * np.maximum(normals @ key, 0)
    diffuse += lighting.fill_strength * np.maximum(normals @ fill, 0)
    highlight = lighting.gloss * np.maximum(normals @ half, 0) ** lighting.shininess
    return np.column_stack([diffuse, highlight])
