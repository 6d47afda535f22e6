"""Maps of terrains, for tests of sight."""

import mujoco
import numpy as np

from go2_wbc.planning.height_map import CELL, HeightMap, fuse
from go2_wbc.plant.mujoco.lidar import ground_model
from go2_wbc.plant.terrain import Terrain

DOWN = np.array([0.0, 0.0, -1.0])
ABOVE, BASE = 3.0, np.array([0.0, 0.0, 0.3])


def true_heights(terrain: Terrain | None, places: np.ndarray) -> np.ndarray:
    """Heights [m] of a terrain, by MuJoCo."""
    model = ground_model(terrain)
    data, hit = mujoco.MjData(model), np.zeros(1, dtype=np.int32)
    mujoco.mj_kinematics(model, data)
    rays = (np.array([x, y, ABOVE]) for x, y in places)
    found = [mujoco.mj_ray(model, data, ray, DOWN, None, 1, -1, hit, None) for ray in rays]
    return ABOVE - np.array(found)


def grid(start: float, end: float, aside: float = 0.35) -> np.ndarray:
    """Middles of the cells from ``start`` to ``end`` [m] ahead."""
    axes = (np.arange(round(a / CELL), round(b / CELL)) for a, b in ((start, end), (-aside, aside)))
    return CELL * (np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2) + 0.5)


def exact_map(
    terrain: Terrain | None, start: float = -1.0, end: float = 1.8, aside: float = 0.35
) -> HeightMap:
    """The map of a terrain on which the robot stands at the origin."""
    heights, places = HeightMap(), grid(start, end, aside)
    points = np.column_stack([places, true_heights(terrain, places) - BASE[2]])
    fuse(heights, points, BASE, np.eye(3), 0.001)
    return heights
