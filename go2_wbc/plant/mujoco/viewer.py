"""Opens MuJoCo's own window on a ``MujocoPlant``."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import Any, final

import mujoco.viewer

from go2_wbc.errors import PlantError
from go2_wbc.plant.mujoco.plant import MujocoPlant

_DISPLAY_VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY")


def display_problem(environment: Mapping[str, str] | None = None) -> str | None:
    """Why no window can be opened here, in one sentence, or ``None`` if one can.

    Args:
        environment: the environment variables; ``None`` takes the process's own.
    """
    variables = os.environ if environment is None else environment
    if not sys.platform.startswith("linux"):
        return None
    if any(variables.get(name) for name in _DISPLAY_VARIABLES):
        return None
    return (
        "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); "
        "run without the viewer, or on a machine with a screen"
    )


@final
class PlantViewer:
    """A window that shows a plant; call ``sync`` whenever it should catch up.

    Args:
        plant: what to show; build it with ``visuals=True`` to see the robot's real shape.

    Raises:
        PlantError: if there is no display. MuJoCo itself would end the process.
    """

    def __init__(self, plant: MujocoPlant) -> None:
        problem = display_problem()
        if problem is not None:
            raise PlantError(f"cannot open the viewer: {problem}")
        self._handle: Any = mujoco.viewer.launch_passive(plant.model, plant.data)

    @property
    def is_running(self) -> bool:
        """Whether the window is still open."""
        return bool(self._handle.is_running())

    def sync(self) -> None:
        """Shows the plant's present state."""
        self._handle.sync()

    def close(self) -> None:
        """Closes the window; idempotent."""
        self._handle.close()
