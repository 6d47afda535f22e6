"""Plants: what a robot or simulator must do, and MuJoCo doing it."""

from __future__ import annotations

from go2_wbc.plant.base import Plant
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.plant.mujoco.worlds import plant_in_world

__all__ = ["MujocoPlant", "Plant", "plant_in_world"]
