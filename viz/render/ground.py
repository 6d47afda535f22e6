"""The ground below the robot: as it was seen, heights and a picture; or a floor with its shadow."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple
from warnings import catch_warnings

import numpy as np
from jaxtyping import Float, Int
from numpy.lib.stride_tricks import sliding_window_view
from PIL import Image, ImageFilter

from go2_wbc.planning.height_map import CELL
from go2_wbc.records import ArrayNx3
from viz.render.camera import Camera
from viz.render.mesh import Surface, rasterize
from viz.style import MUTED, STYLE, rgb

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS = ("#5c7fb0", "#8fb3a5", "#e3d7a8", "#d59a6a", "#a8584f")
"""From the lowest to the highest."""
LEAST_SPAN = 0.3
"""Heights that differ by less [m] have nearly the same colour: noise is not to be seen."""
MOST_CELLS = 160_000  #: Of a grid; of a larger one only each second cell, or third, is kept
LEAST_AROUND, SPIKE = 5, 0.05
"""Cells that must be known of nine for the middle one to be drawn, and by how much [m] that may
stand out from them."""
_DRAWN, _FADES, _NEAR = 2.6, 1.4, 0.35  # [m] from the target, and ahead of the camera


class Grid(NamedTuple):
    """Heights of a rectangle of ground."""

    x: float  #: of the middle of its first cell [m]
    y: float  #: likewise [m]
    cell: float  #: side of a cell [m]
    z: Float[np.ndarray, "n k"]  #: heights [m] of the cells along x and y, nan where none is known

    def points(self) -> Float[np.ndarray, "n k 3"]:
        """Middles of all cells [m]."""
        n, k = self.z.shape
        xs, ys = self.x + self.cell * np.arange(n), self.y + self.cell * np.arange(k)
        return np.dstack([*np.meshgrid(xs, ys, indexing="ij"), self.z])


def grid_of(ground: ArrayNx3, most: int = MOST_CELLS) -> Grid:
    """The cells of ``Recording.ground``, at least one, as a grid of at most so many cells."""
    index = np.floor(ground[:, :2] / CELL).astype(int)
    low = index.min(axis=0)
    z = np.full(index.max(axis=0) - low + 1, np.nan)
    z[tuple((index - low).T)] = ground[:, 2]
    z = _tidied(z)
    step = int(np.ceil(np.sqrt(z.size / most)))
    x, y = (CELL * (low + 0.5)).tolist()
    return Grid(x, y, step * CELL, z[::step, ::step])


def _tidied(z: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
    """The same without small holes, single cells that stand out, and the torn edge of it all."""
    around = sliding_window_view(np.pad(z, 1, constant_values=np.nan), (3, 3)).reshape(*z.shape, 9)
    known = (~np.isnan(around)).sum(axis=2)
    with catch_warnings(action="ignore", category=RuntimeWarning):  # nothing known around
        middle = np.nanmedian(around, axis=2)
    smooth = np.where(np.abs(z - middle) < SPIKE, z, middle)  # never if z is unknown
    return np.where(known >= LEAST_AROUND, smooth, np.nan)


def shares(z: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Heights [m] as shares of their span, from which their colours are mixed."""
    low, high = np.nanmin(z), np.nanmax(z)
    return (z - 0.5 * (low + high)) / max(high - low, LEAST_SPAN) + 0.5


class Relief:
    """What pictures show of the ground."""

    def __init__(self, ground: ArrayNx3) -> None:
        """Prepare triangles between the cells; they share corners."""
        grid = grid_of(ground)
        slopes = np.gradient(grid.z, grid.cell)
        normals = np.dstack([-slopes[0], -slopes[1], np.ones_like(grid.z)]).reshape(-1, 3)
        normals[np.isnan(normals).any(axis=1)] = 0.0, 0.0, 1.0
        self._normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        self._points = grid.points().reshape(-1, 3)
        rows = np.arange(grid.z.size).reshape(grid.z.shape)
        a, b, c, d = rows[:-1, :-1], rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:]
        both = [np.stack(corners, axis=2).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
        triangles = np.concatenate(both)
        known = ~np.isnan(self._points[triangles, 2]).any(axis=1)
        self._triangles = triangles[known]
        self._middles = self._points[self._triangles].mean(axis=1)
        table, share = np.array([rgb(color) for color in COLORS]), shares(self._middles[:, 2])
        columns = (np.interp(share, np.linspace(0, 1, len(table)), column) for column in table.T)
        self._colors = np.column_stack([*columns])

    def seen_by(self, camera: Camera, robot: Surface, light: Float[np.ndarray, "3"]) -> Surface:
        """What lies around the camera's target, with the robot's shadow, fading at its edge."""
        off = self._middles - camera.p_world_target
        far = np.hypot(off[:, 0], off[:, 1])
        ahead = (camera.p_world_camera - self._middles) @ camera.R_camera_world[2]
        near = (far < _DRAWN) & (ahead > _NEAR)
        used, triangles = np.unique(self._triangles[near], return_inverse=True)
        clear = np.clip((_DRAWN - far[near]) / (_DRAWN - _FADES), 0.0, 1.0)[:, None]
        shadow = _shadow_on(self._middles[near], camera, robot, light)[:, None]
        colors = clear * (1.0 - SHADOW * shadow) * self._colors[near] + (1.0 - clear) * HORIZON
        corners = triangles.reshape(-1, 3)
        return Surface(self._points[used], self._normals[used], corners, colors)


def _shadow_on(
    points: ArrayNx3, camera: Camera, robot: Surface, light: Float[np.ndarray, "3"]
) -> Float[np.ndarray, " n"]:
    """Share of light that the robot takes from points [m], as if its feet stood on one plane."""
    height = float(robot.points[:, 2].min())
    texture, H = shadow_texture(camera, robot, light, height)
    flat = points[:, :2] - (points[:, 2:] - height) * (light[:2] / light[2])
    column, row = (flat @ H[:2, :2].T + H[:2, 2]).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < len(texture)) & (row < len(texture))
    return np.where(inside, texture[row * inside, column * inside], 0.0)


def ground_figure(ground: ArrayNx3, title: str) -> Figure:
    """The heights from above, ahead to the right, as a picture."""
    from matplotlib import rc_context
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

    grid = grid_of(ground)
    length, width = grid.cell * np.array(grid.z.shape)
    low, high = np.nanmin(grid.z), np.nanmax(grid.z)
    room = max(LEAST_SPAN - (high - low), 0.0) / 2
    with rc_context(STYLE):
        figure = Figure(figsize=(5.6, 0.9 + 4.2 * min(width / length, 1.5)), layout="constrained")
        axes = figure.add_subplot()
        half = grid.cell / 2
        ends = (grid.x - half, grid.x - half + length, grid.y - half, grid.y - half + width)
        colors = LinearSegmentedColormap.from_list("ground", COLORS)
        limits = {"vmin": low - room, "vmax": high + room}
        picture = axes.imshow(
            grid.z.T, colors, extent=ends, origin="lower", interpolation="nearest", **limits
        )
        figure.colorbar(picture, label="height [m]", shrink=0.8)
        axes.set_title(title, fontsize=8.0, color=MUTED)
        axes.set(xlabel="x [m]", ylabel="y [m]")
    return figure


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
