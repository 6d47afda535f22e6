"""The floor of a rendered picture: filtered checker, fog, and the robot's soft shadow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from PIL import Image, ImageFilter

from viz.render.camera import Camera
from viz.render.mesh import Surface
from viz.render.rasterizer import rasterize

_LEAST_SCALE = 1e-4  # pixels closer than this to the horizon count as sky


@dataclass(frozen=True, slots=True)
class FloorStyle:
    """How the floor looks. Colours are red, green, blue in 0..1.

    Attributes:
        light, dark: the two tiles.
        sky_top, horizon: the background, from the picture's top to the horizon.
        tile: edge of a tile [m].
        fog_start, fog_end: distances from the target [m] where tiles begin to fade and are gone.
        shadow: darkness of a full shadow, 0..1.
        shadow_texels: edge of the square shadow texture [px].
        shadow_width: edge of the floor square that the texture covers [m].
        sharp_below: casters lower than this [m] throw a sharp shadow.
        blur_low, blur_high: standard deviation of the blur for low and high casters [m].
    """

    light: tuple[float, float, float] = (0.965, 0.970, 0.978)
    dark: tuple[float, float, float] = (0.905, 0.916, 0.934)
    sky_top: tuple[float, float, float] = (0.985, 0.988, 0.994)
    horizon: tuple[float, float, float] = (0.930, 0.940, 0.955)
    tile: float = 0.25
    fog_start: float = 1.2
    fog_end: float = 4.5
    shadow: float = 0.62
    shadow_texels: int = 320
    shadow_width: float = 2.0
    sharp_below: float = 0.12
    blur_low: float = 0.010
    blur_high: float = 0.028


def paint_floor(
    camera: Camera, casters: Surface, light: Float[np.ndarray, "3"], style: FloorStyle
) -> Float[np.ndarray, "h w 3"]:
    """The picture without the robot: floor, background and shadow.

    Args:
        camera: where the picture is taken from.
        casters: what throws a shadow.
        light: unit vector towards the light in the world.
        style: colours and sizes.
    """
    horizon, x, y = _floor_points(camera)
    visible = _visibility(x, y, camera, style)
    checker = _checker(x, y, camera, style.tile)
    lit = 1 - np.float32(style.shadow) * _shadow_on_picture(camera, casters, light, style)
    width, height = camera.size
    picture = np.empty((height, width, 3), dtype=np.float32)
    ramp = np.linspace(0, 1, height, dtype=np.float32)[:, None] ** np.float32(0.7)
    for channel in range(3):
        sky = style.sky_top[channel] + (style.horizon[channel] - style.sky_top[channel]) * ramp
        picture[:, :, channel] = sky
        tiles = style.dark[channel] + (style.light[channel] - style.dark[channel]) * checker
        tiles -= sky[horizon:]
        tiles *= visible
        picture[horizon:, :, channel] += tiles
    picture *= lit[:, :, None]
    return picture


def _floor_points(
    camera: Camera,
) -> tuple[int, Float[np.ndarray, "r w"], Float[np.ndarray, "r w"]]:
    """First row that shows the floor, and the floor's x and y [m] in the pixels from there on.

    The camera has no roll, so distance along the view depends on the row alone.
    """
    width, height = camera.size
    H = camera.H_floor_picture.astype(np.float32)
    columns = np.arange(width, dtype=np.float32) + np.float32(0.5)
    rows = np.arange(height, dtype=np.float32)[:, None] + np.float32(0.5)
    scale = H[2, 1] * rows + H[2, 2]
    horizon = int(np.count_nonzero(scale <= _LEAST_SCALE))
    rows, inverse = rows[horizon:], 1 / scale[horizon:]
    x = (H[0, 0] * columns + (H[0, 1] * rows + H[0, 2])) * inverse
    y = (H[1, 0] * columns + (H[1, 1] * rows + H[1, 2])) * inverse
    return horizon, x, y


def _visibility(
    x: Float[np.ndarray, "r w"], y: Float[np.ndarray, "r w"], camera: Camera, style: FloorStyle
) -> Float[np.ndarray, "r w"]:
    """1 near the target, falling to 0 where the fog hides the tiles."""
    distance = np.hypot(x - float(camera.p_world_target[0]), y - float(camera.p_world_target[1]))
    clear = (style.fog_end - distance) / (style.fog_end - style.fog_start)
    return np.clip(clear, 0, 1, out=clear) ** 2


def _checker(
    x: Float[np.ndarray, "r w"], y: Float[np.ndarray, "r w"], camera: Camera, tile: float
) -> Float[np.ndarray, "r w"]:
    """Box-filtered checkerboard in 0..1 (Quilez, "Filtering the checkerboard pattern", 2016)."""
    columns = np.abs(np.diff(x[:, :2])), np.abs(np.diff(y[:, :2]))
    product = np.ones((), dtype=np.float32)
    for value, across in zip((x, y), columns, strict=True):
        along = np.abs(np.gradient(value[:, value.shape[1] // 2]))[:, None]
        spread = np.maximum(np.maximum(across, along), _LEAST_SCALE) / (2 * tile)
        middle = value / (2 * tile)
        filtered = _triangle_wave(middle + spread / 2) - _triangle_wave(middle - spread / 2)
        filtered /= spread
        product = product * filtered
    return 0.5 - 0.5 * product


def _triangle_wave(value: Float[np.ndarray, "r w"]) -> Float[np.ndarray, "r w"]:
    """Minus the integral of the square wave that is +1 on [0, 0.5) and -1 on [0.5, 1); in place."""
    value -= np.floor(value)
    value -= np.float32(0.5)
    return np.abs(value, out=value)


def _shadow_on_picture(
    camera: Camera, casters: Surface, light: Float[np.ndarray, "3"], style: FloorStyle
) -> Float[np.ndarray, "h w"]:
    """Share of light that the robot takes from each pixel of the floor, 0..1."""
    per_metre = style.shadow_texels / style.shadow_width
    left = float(camera.p_world_target[0]) - style.shadow_width / 2
    top = float(camera.p_world_target[1]) + style.shadow_width / 2
    to_texel = per_metre * np.array([[1, 0, -left], [0, -1, top], [0, 0, 1 / per_metre]])
    flat = casters.points[:, :2] - casters.points[:, 2:] * (light[:2] / light[2])
    texels = np.column_stack([flat, np.ones(len(flat))]) @ to_texel.T
    is_low = casters.points[:, 2][casters.triangles[:, 0]] < style.sharp_below
    lit = 1.0
    for mask, blur in ((is_low, style.blur_low), (~is_low, style.blur_high)):
        lit = lit * (1 - _blurred_mask(texels, casters.triangles[mask], blur * per_metre, style))
    texture = Image.fromarray(np.round(255 * (1 - lit)).astype(np.uint8))
    H = to_texel @ camera.H_floor_picture
    coefficients = tuple((H / H[2, 2]).ravel()[:8])
    shadow = texture.transform(
        camera.size, Image.Transform.PERSPECTIVE, coefficients, Image.Resampling.BILINEAR
    )
    return np.asarray(shadow, dtype=np.float32) / 255


def _blurred_mask(
    texels: Float[np.ndarray, "n 3"],
    triangles: Int[np.ndarray, "m 3"],
    blur: float,
    style: FloorStyle,
) -> Float[np.ndarray, "s s"]:
    size = (style.shadow_texels, style.shadow_texels)
    covered = np.zeros(size[0] * size[1], dtype=np.uint8)
    covered[rasterize(texels, triangles, size).pixel] = 255
    image = Image.fromarray(covered.reshape(size)).filter(ImageFilter.GaussianBlur(blur))
    return np.asarray(image, dtype=np.float32) / 255
