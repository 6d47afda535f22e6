"""Opens the viewer where there is one to open."""

from __future__ import annotations

import logging

from go2_wbc.errors import PlantError
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.plant.mujoco.viewer import PlantViewer

_log = logging.getLogger(__name__)


def open_viewer(plant: Plant) -> PlantViewer | None:
    """A window on ``plant``; None, with a warning, if it cannot be shown here."""
    if not isinstance(plant, MujocoPlant):
        _log.warning("the viewer shows MuJoCo plants only; going on without")
        return None
    try:
        return PlantViewer(plant)
    except PlantError as error:
        _log.warning("no viewer: %s", error)
        return None
