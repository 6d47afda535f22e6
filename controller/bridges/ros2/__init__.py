"""ROS 2: the robot as a node (``serve``), and a client with ``GO2Controller``'s methods.

Nothing of ROS is imported until one of these names is asked for; without the extra ``[ros2]`` that
raises ``MissingDependency``, which names the line that installs it.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from controller.bridges.ros2.client import GO2ControllerNode
    from controller.bridges.ros2.server import serve

__all__ = ["GO2ControllerNode", "serve"]

_HOMES = {"GO2ControllerNode": "client", "serve": "server"}


def __getattr__(name: str) -> object:
    """Import ROS when it is first needed."""
    if name not in _HOMES:
        raise AttributeError(f"module 'controller.bridges.ros2' has no attribute {name!r}")
    return getattr(importlib.import_module(f"controller.bridges.ros2.{_HOMES[name]}"), name)
