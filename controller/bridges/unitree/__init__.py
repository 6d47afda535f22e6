"""Unitree's own protocol (DDS): their ``SportClient`` moves our robot, our controller their robot.

Only ``bus.py`` imports the DDS library, and it is imported by what needs it.
"""

from __future__ import annotations

import importlib
import sys

from go2_wbc.errors import needing

LOOPBACK = "lo0" if sys.platform == "darwin" else "lo"
"""Where simulators live, which need not have a motion switcher; a robot has one."""


def require_dds() -> None:
    """Raise MissingDependency, with the install line, unless the DDS library is there and works."""
    with needing("unitree", "Unitree's protocol needs CycloneDDS"):
        importlib.import_module("cyclonedds.core")
