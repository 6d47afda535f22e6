"""The floor of a rendered picture: filtered checker, fog, and the robot's soft shadow."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from PIL import Image, ImageFilter

from viz.render.camera import Camera
from viz.render.mesh import Surface
from viz.render.rasterizer import rasterize

_LEAST_SCALE = 1e-4  # pixels closer than this to the horizon count as sky
# Red, green, blue in 0..1: the two tiles, and the background from the picture's top to the horizon.
_LIGHT_TILE, _DARK_TILE = (0.965, 0.970, 0.978), (0.905, 0.916, 0.934)
_SKY_TOP, HORIZON = (0.985, 0.988, 0.994), (0.930, 0.940, 0.955)
_TILE = 0.25  # [m] edge of a tile
_FOG_START, _FOG_END = 1.2, 4.5  # [m] from the target: tiles begin to fade there, and are gone
SHADOW = 0.62  # darkness of a full shadow, 0..1
_TEXELS = 320  # [px] edge of the square shadow texture
_TEXELS_PER_METRE = _TEXELS / 2.0  # it covers a square of 2 m
_SHARP_BELOW = 0.12  # [m] casters lower than this throw a sharp shadow
_BLUR_LOW, _BLUR_HIGH = 0.010, 0.028  # [m] standard deviation of the blur for low and high casters


def paint_floor(
    camera: Camera, casters: Surface, light: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "h w 3"]:
    """The picture without the robot: floor, background, and the shadow of ``casters``.

    ``light`` is the unit vector towards the light in the world.
    """
    horizon, x, y = _floor_points(camera)
    visible = _visibility(x, y, camera)
    checker = _checker(x, y)
    lit = 1 - np.float32(SHADOW) * _shadow_on_picture(camera, casters, light)
    width, height = camera.size
    picture = np.empty((height, width, 3), dtype=np.float32)
    ramp = np.linspace(0, 1, height, dtype=np.float32)[:, None] ** np.float32(0.7)
    colors = zip(_SKY_TOP, HORIZON, _DARK_TILE, _LIGHT_TILE, strict=True)
    for channel, (top, bottom, dark, light_tile) in enumerate(colors):
        sky = top + (bottom - top) * ramp
        picture[:, :, channel] = sky
        tiles = dark + (light_tile - dark) * checker
        tiles -= sky[horizon:]
        tiles *= visible
        picture[horizon:, :, channel] += tiles
    picture *= lit[:, :, None]
    return picture


def _floor_points(camera: Camera) -> tuple[int, Float[np.ndarray, "r w"], Float[np.ndarray, "r w"]]:
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
    x: Float[np.ndarray, "r w"], y: Float[np.ndarray, "r w"], camera: Camera
) -> Float[np.ndarray, "r w"]:
    """1 near the target, falling to 0 where the fog hides the tiles."""
    distance = np.hypot(x - float(camera.p_world_target[0]), y - float(camera.p_world_target[1]))
    clear = (_FOG_END - distance) / (_FOG_END - _FOG_START)
    return np.clip(clear, 0, 1, out=clear) ** 2


def _checker(x: Float[np.ndarray, "r w"], y: Float[np.ndarray, "r w"]) -> Float[np.ndarray, "r w"]:
    """Box-filtered checkerboard in 0..1 (Quilez, "Filtering the checkerboard pattern", 2016)."""
    columns = np.abs(np.diff(x[:, :2])), np.abs(np.diff(y[:, :2]))
    product = np.ones((), dtype=np.float32)
    for value, across in zip((x, y), columns, strict=True):
        along = np.abs(np.gradient(value[:, value.shape[1] // 2]))[:, None]
        spread = np.maximum(np.maximum(across, along), _LEAST_SCALE) / (2 * _TILE)
        middle = value / (2 * _TILE)
        filtered = _triangle_wave(middle + spread / 2) - _triangle_wave(middle - spread / 2)
        filtered /= spread
        product = product * filtered
    return 0.5 - 0.5 * product


def _triangle_wave(value: Float[np.ndarray, "r w"]) -> Float[np.ndarray, "r w"]:
    """Minus the integral of the square wave that is +1 on [0, 0.5) and -1 on [0.5, 1); in place."""
    value -= np.floor(value)
    value -= np.float32(0.5)
    return np.abs(value, out=value)


def shadow_texture(
    camera: Camera, casters: Surface, light: Float[np.ndarray, "3"], height: float = 0.0
) -> tuple[Float[np.ndarray, "s s"], Float[np.ndarray, "3 3"]]:
    """Share of light that the robot takes from level ground of a height [m], 0..1.

    With it goes the homography from a place there, (x, y, 1) [m], to its texel.
    """
    scale, half = _TEXELS_PER_METRE, _TEXELS / 2
    left, top = (scale * float(value) for value in camera.p_world_target[:2])
    to_texel = np.array([[scale, 0, half - left], [0, -scale, half + top], [0, 0, 1]])
    flat = casters.points[:, :2] - (casters.points[:, 2:] - height) * (light[:2] / light[2])
    texels = np.column_stack([flat, np.ones(len(flat))]) @ to_texel.T
    is_low = casters.points[:, 2][casters.triangles[:, 0]] < _SHARP_BELOW
    lit = 1.0
    for mask, blur in ((is_low, _BLUR_LOW), (~is_low, _BLUR_HIGH)):
        lit = lit * (1 - _blurred_mask(texels, casters.triangles[mask], blur * scale))
    return 1 - lit, to_texel


def _shadow_on_picture(
    camera: Camera, casters: Surface, light: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "h w"]:
    """Share of light that the robot takes from each pixel of the floor, 0..1."""
    taken, to_texel = shadow_texture(camera, casters, light)
    texture = Image.fromarray(np.round(255 * taken).astype(np.uint8))
    H = to_texel @ camera.H_floor_picture
    coefficients = tuple((H / H[2, 2]).ravel()[:8])
    shadow = texture.transform(
        camera.size, Image.Transform.PERSPECTIVE, coefficients, Image.Resampling.BILINEAR
    )
    return np.asarray(shadow, dtype=np.float32) / 255


def _blurred_mask(
    texels: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "m 3"], blur: float
) -> Float[np.ndarray, "s s"]:
    covered = np.zeros((_TEXELS, _TEXELS), dtype=np.uint8)
    covered.reshape(-1)[rasterize(texels, triangles, covered.shape)[0]] = 255
    image = Image.fromarray(covered).filter(ImageFilter.GaussianBlur(blur))
    return np.asarray(image, dtype=np.float32) / 255
