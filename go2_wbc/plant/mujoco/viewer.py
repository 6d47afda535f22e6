"""Opens MuJoCo's own window on a ``MujocoPlant``."""

from __future__ import annotations

import logging
import os
import sys
from typing import Any, final

import mujoco.viewer

from go2_wbc.errors import PlantError
from go2_wbc.plant.base import Plant
from go2_wbc.plant.mujoco.plant import MujocoPlant

_log = logging.getLogger(__name__)

FRAME_RATE = 50.0  #: Frames per second of robot time that ``PlantViewer.show`` shows at most


def display_problem() -> str | None:
    """Why no window can be opened here, in one sentence, or ``None`` if one can."""
    has_display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if has_display or not sys.platform.startswith("linux"):
        return None
    return (
        "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); "
        "run without the viewer, or on a machine with a screen"
    )


@final
class PlantViewer:
    """A window that shows a plant.

    Args:
        plant: what to show; build it with ``visuals=True`` to see the robot's real shape.

    Raises:
        PlantError: if there is no display (MuJoCo itself would end the process), or on macOS
            outside ``mjpython``.
    """

    def __init__(self, plant: MujocoPlant) -> None:
        problem = display_problem()
        if problem is not None:
            raise PlantError(f"cannot open the viewer: {problem}")
        try:
            self._handle: Any = mujoco.viewer.launch_passive(plant.model, plant.data)
        except RuntimeError as error:
            raise PlantError(f"cannot open the viewer: {error}") from error
        self._shown_at = plant.time

    def show(self, time: float) -> None:
        """Shows the plant's state at ``time`` [s], unless the last frame is still recent."""
        if time - self._shown_at >= 1.0 / FRAME_RATE:
            self._shown_at = time
            self._handle.sync()

    def close(self) -> None:
        """Closes the window; idempotent."""
        self._handle.close()


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
