"""A lidar like the L1 below a Go2's nose, on the terrain of a simulated plant.

Its rays fill a cone evenly, along a spiral that begins anew in each scan, as the sensor never
repeats its pattern. They are cast against a model of the ground alone: against the meshes of the
robot as well it took 100 times as long. The legs stand in the way all the same: a ray that passes
within ``LEG_RADIUS`` of one's axis returns nothing, as a driver leaves the robot itself out.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.arguments import typed
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.plant.base import Scan
from go2_wbc.plant.mujoco.model import add_floor, add_terrain
from go2_wbc.plant.mujoco.setup import PlantSetup
from go2_wbc.plant.terrain import Terrain
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged

LEG_RADIUS, LEG_POINTS = 0.04, 4
"""Distance [m] of a ray from the axis of a link that it hits, and points of that axis looked at."""
ROUNDING = 1e-9
"""Of a time [s]."""
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, noise=NOT_NEGATIVE, latency=NOT_NEGATIVE)
class LidarConfig:
    """Numbers of the lidar; Unitree's of the L1, but for the latency, which is a guess.

    Attributes:
        rate: scans a second; with ``rays`` the L1's 21600 points a second.
        rays: of a scan. One is taken in an instant; the L1 takes its time.
        noise: standard deviation of a distance [m].
        nearest, farthest: range [m].
        latency: time [s] from a scan until it is told.
        pitch: angle [rad] of its axis below the horizontal.
        cone: angle [rad] of the rays with its axis, at most.
    """

    rate: float = 15.0
    rays: int = 1440
    noise: float = 0.015
    nearest: float = 0.05
    farthest: float = 10.0
    latency: float = 0.02
    pitch: float = math.radians(45.0)
    cone: float = math.radians(80.0)


PLACE = np.array((0.30, 0.0, -0.03))
"""Of the lidar, in the base frame [m]."""


def ground_model(terrain: Terrain | None) -> mujoco.MjModel:
    """The floor and what lies on it, without a robot."""
    spec = mujoco.MjSpec()
    add_floor(spec)
    if terrain is not None:
        add_terrain(spec, terrain, 1.0)
    return spec.compile()


class Lidar:
    """Takes scans of a terrain."""

    def __init__(
        self,
        config: LidarConfig,
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
        turns = np.arange(config.rays) + 0.5
        self._cosine = 1.0 - (1.0 - math.cos(config.cone)) * turns / config.rays
        self._turns = GOLDEN_ANGLE * turns

    @staticmethod
    def on(
        lidar: LidarConfig | bool,
        setup: PlantSetup,
        robot: tuple[mujoco.MjModel, mujoco.MjData],
    ) -> Lidar:
        """That of a robot, in the place that its ``setup`` tells."""
        config = lidar if isinstance(lidar, LidarConfig) else LidarConfig()
        return Lidar(config, setup.terrain, robot, np.random.default_rng((setup.seed, config.rays)))

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
        rays = self._rays(rng.uniform(0.0, 2.0 * math.pi))
        origin, world = robot.xpos[self._base] + R @ PLACE, rays @ R.T
        distance, hit = np.empty(config.rays), np.empty(config.rays, dtype=np.int32)
        settings = None, 1, -1, hit, distance, None, config.rays, config.farthest
        mujoco.mj_multiRay(self._model, self._data, origin, world.ravel(), *settings)
        shown = (hit >= 0) & (distance >= config.nearest)
        shown &= ~self._behind_legs(origin, world, distance)
        distance += config.noise * rng.standard_normal(config.rays)
        points = PLACE + distance[:, None] * rays
        return Scan(time, points[shown], config.noise)

    def _rays(self, turn: float) -> Float[np.ndarray, "n 3"]:
        """Directions in the base frame."""
        c, s = math.cos(self._config.pitch), math.sin(self._config.pitch)
        sine = np.sqrt(1.0 - self._cosine**2)
        aside = sine * np.cos(self._turns + turn)
        x, y, z = self._cosine, sine * np.sin(self._turns + turn), aside
        return np.column_stack([c * x + s * z, y, c * z - s * x])

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
