"""The ground that a robot has seen: a grid of heights, a coloured surface, and a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple
from warnings import catch_warnings

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import sliding_window_view

from go2_wbc.planning.height_map import CELL
from go2_wbc.records import ArrayNx3
from viz.render.camera import Camera
from viz.render.floor import HORIZON, SHADOW, shadow_texture
from viz.render.mesh import Surface
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
    """Heights of a rectangle of ground.

    Attributes:
        x, y: of the middle of its first cell [m].
        cell: side of a cell [m].
        z: heights [m] of the cells along x and y, nan where none is known.
    """

    x: float
    y: float
    cell: float
    z: Float[np.ndarray, "n k"]

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
