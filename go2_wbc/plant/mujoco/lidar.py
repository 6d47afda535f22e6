"""A lidar like the L1 below a Go2's nose, or a depth camera in it, on a simulated plant's terrain.

The lidar's rays fill a cone evenly, along a spiral that starts differently in each scan, as the
sensor never repeats its pattern; the camera's rays are those of few, large pixels. Rays are cast
against a model of the ground alone: against the meshes of the robot as well it took 100 times as
long. The legs block rays nevertheless: a ray that passes within ``LEG_RADIUS`` of a leg's axis
returns nothing, just as a driver removes points on the robot itself.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.plant.base import Scan
from go2_wbc.plant.mujoco.model import add_floor, add_terrain
from go2_wbc.plant.terrain import Terrain
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged

LEG_RADIUS, LEG_POINTS = 0.04, 4
"""Distance [m] of a ray from the axis of a link that it hits, and points of that axis looked at."""
ROUNDING = 1e-9  #: Of a time [s]
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, noise=NOT_NEGATIVE, latency=NOT_NEGATIVE)
class LidarConfig:
    """Numbers of the lidar; Unitree's of the L1, but for the latency, which is a guess."""

    rate: float = 15.0  #: scans a second; with ``rays`` the L1's 21600 points a second
    rays: int = 1440
    """Of a scan. One is taken in an instant; the L1 takes its time."""
    noise: float = 0.015  #: standard deviation of a distance [m]
    nearest: float = 0.05  #: least distance seen [m]
    farthest: float = 10.0  #: greatest [m]
    latency: float = 0.02  #: time [s] from a scan until it is told
    pitch: float = math.radians(45.0)  #: angle [rad] of its axis below the horizontal
    cone: float = math.radians(80.0)  #: angle [rad] of the rays with its axis, at most

    @property
    def place(self) -> Float[np.ndarray, "3"]:
        """Where it is, in the base frame [m]."""
        return PLACE

    def deviation(self, _distance: Float[np.ndarray, " n"]) -> float:
        """Of the distances [m]."""
        return self.noise

    def directions(self, rng: np.random.Generator) -> Float[np.ndarray, "n 3"]:
        """Of the rays of a scan, its axis along x."""
        turns = np.arange(self.rays) + 0.5
        cosine = 1.0 - (1.0 - math.cos(self.cone)) * turns / self.rays
        turns, sine = GOLDEN_ANGLE * turns, np.sqrt(1.0 - cosine**2)
        turn = rng.uniform(0.0, 2.0 * math.pi)
        return np.column_stack([cosine, sine * np.sin(turns + turn), sine * np.cos(turns + turn)])


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, noise=NOT_NEGATIVE, latency=NOT_NEGATIVE)
class DepthConfig:
    """Numbers of the depth camera; range and angles of a RealSense D435, the others guessed."""

    rate: float = 15.0  #: pictures a second
    columns: int = 48  #: of a picture
    rows: int = 32  #: of a picture
    noise: float = 0.004
    """Standard deviation of a distance d, over d^2 [1/m]; the D435's is 0.08 pixels of 425 in its
    focal length, over the 5 cm between its eyes."""
    nearest: float = 0.3  #: least distance seen [m]
    farthest: float = 3.0  #: greatest [m]
    latency: float = 0.03  #: time [s] from a picture until it is told
    pitch: float = math.radians(30.0)  #: angle [rad] of its axis below the horizontal
    width: float = math.radians(87.0)  #: angle of view [rad]
    height: float = math.radians(58.0)  #: angle of view [rad]

    @property
    def rays(self) -> int:
        """Of a picture."""
        return self.columns * self.rows

    @property
    def place(self) -> Float[np.ndarray, "3"]:
        """Where it is, in the base frame [m]: that of the Go2's camera."""
        return np.array((0.327, 0.0, 0.043))

    def deviation(self, distance: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Of the distances [m]."""
        return self.noise * distance**2

    def directions(self, _rng: np.random.Generator) -> Float[np.ndarray, "n 3"]:
        """Of the rays of a picture, its axis along x."""
        columns, rows = (
            math.tan(0.5 * angle) * (2.0 * np.arange(n) + 1.0 - n) / n
            for angle, n in ((self.width, self.columns), (self.height, self.rows))
        )
        left, up = (part.ravel() for part in np.meshgrid(columns, rows))
        rays = np.column_stack([np.ones(self.rays), left, up])
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)


SKY, DOWN = (
    20.0,
    np.array((0.0, 0.0, -1.0)),
)  #: From where [m] the ground is looked at, and where to
PLACE = np.array((0.30, 0.0, -0.03))  #: Of the lidar, in the base frame [m]


def ground_model(terrain: Terrain | None) -> mujoco.MjModel:
    """The floor and what lies on it, without a robot."""
    spec = mujoco.MjSpec()
    add_floor(spec)
    if terrain is not None:
        add_terrain(spec, terrain, 1.0)
    return spec.compile()


def heights_of(
    terrain: Terrain | None, places: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, " n"]:
    """Heights [m] of the ground at places x, y [m]; of steep sides that of their upper edge."""
    model = ground_model(terrain)
    data, hit, found = mujoco.MjData(model), np.zeros((1, 1), np.int32), np.empty(len(places))
    mujoco.mj_forward(model, data)
    for row, place in enumerate(places):
        top = np.append(place, SKY)
        found[row] = SKY - mujoco.mj_ray(model, data, top, DOWN, None, True, -1, hit)
    return found


@typed("lidar", "depth")
def chosen(
    lidar: LidarConfig | bool, depth: DepthConfig | bool, mjcf: Path | str | None
) -> LidarConfig | DepthConfig | None:
    """The numbers of what a robot sees with; None of a blind one.

    Raises:
        ConfigError: for both, what is neither, or where the ground is not known.
    """
    if lidar and depth:
        raise ConfigError("the robot sees with a lidar or with a depth camera, not with both")
    if (lidar or depth) and mjcf is not None:
        name = "lidar" if lidar else "depth"
        raise ConfigError(f"{name} is only for the built model: of an mjcf nobody knows the ground")
    if lidar:
        return lidar if isinstance(lidar, LidarConfig) else LidarConfig()
    return (depth if isinstance(depth, DepthConfig) else DepthConfig()) if depth else None


class RangeSensor:
    """Takes scans of a terrain: a lidar or a depth camera."""

    def __init__(
        self,
        config: LidarConfig | DepthConfig,
        terrain: Terrain | None,
        robot: tuple[mujoco.MjModel, mujoco.MjData],
        rng: np.random.Generator,
    ) -> None:
        """On a ``robot``; every error is drawn from ``rng``."""
        self._config, self._rng = config, rng
        self._model = ground_model(terrain)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)
        model, self._robot = robot
        self._links = model.jnt_bodyid[[model.joint(name).id for name in JOINT_NAMES]]
        self._base = model.body_rootid[self._links[0]]
        self._feet = [model.geom(name).id for name in FOOT_NAMES]
        self._told: deque[Scan] = deque()
        self._next = 0.0

    def scan(self, time: float) -> Scan | None:
        """What it tells at a ``time`` [s]; ask in every control period."""
        if time >= self._next - ROUNDING:
            self._next = time + 1.0 / self._config.rate
            self._told.append(self._take(time))
        if self._told and time >= self._told[0].time + self._config.latency - ROUNDING:
            return self._told.popleft()
        return None

    def save(self) -> Mapping[str, Any]:
        """All that the next scans depend on, besides the robot."""
        state = self._rng.bit_generator.state
        return {"noise": state, "told": tuple(self._told), "next": self._next}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to what ``save`` returned."""
        self._rng.bit_generator.state = saved["noise"]
        self._told, self._next = deque(saved["told"]), saved["next"]

    def _take(self, time: float) -> Scan:
        config, rng, robot = self._config, self._rng, self._robot
        R = robot.xmat[self._base].reshape(3, 3)
        c, s = math.cos(config.pitch), math.sin(config.pitch)
        x, y, z = config.directions(rng).T
        rays = np.column_stack([c * x + s * z, y, c * z - s * x])
        origin, world = robot.xpos[self._base] + R @ config.place, rays @ R.T
        distance, hit = np.empty(config.rays), np.empty(config.rays, dtype=np.int32)
        settings = None, 1, -1, hit, distance, None, config.rays, config.farthest
        mujoco.mj_multiRay(self._model, self._data, origin, world.ravel(), *settings)
        shown = (hit >= 0) & (distance >= config.nearest) & (distance <= config.farthest)
        shown &= ~self._behind_legs(origin, world, distance)
        deviation = np.broadcast_to(config.deviation(distance), distance.shape)
        points = (
            config.place + (distance + deviation * rng.standard_normal(config.rays))[:, None] * rays
        )
        typical = math.sqrt(np.mean(deviation[shown] ** 2)) if shown.any() else 0.0
        return Scan(time, points[shown], typical)

    def _behind_legs(
        self,
        origin: Float[np.ndarray, "3"],
        rays: Float[np.ndarray, "n 3"],
        distance: Float[np.ndarray, " n"],
    ) -> Bool[np.ndarray, " n"]:
        """Which rays pass a leg before they have come so far."""
        thighs, knees = (self._robot.xpos[self._links[part::3]] for part in (1, 2))
        feet = self._robot.geom_xpos[self._feet]
        shares = np.linspace(0.0, 1.0, LEG_POINTS)[:, None, None]
        links = [(1.0 - shares) * a + shares * b for a, b in ((thighs, knees), (knees, feet))]
        points = np.array(links).reshape(-1, 3) - origin
        along = rays @ points.T
        aside = (points**2).sum(axis=1) - along**2
        is_met = (aside < LEG_RADIUS**2) & (along > 0.0) & (along < distance[:, None])
        return is_met.any(axis=1)
