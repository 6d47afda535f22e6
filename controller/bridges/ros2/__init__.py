"""ROS 2: the robot as a node (``serve``), and a client with ``GO2Controller``'s methods.

Nothing of ROS is imported until one of these names is asked for; without the extra ``[ros2]`` that
raises ``MissingDependency``, which names the line that installs it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.bridges.ros2.client import GO2ControllerNode
    from controller.bridges.ros2.server import serve

__all__ = ["GO2ControllerNode", "serve"]

__getattr__ = lazy_exports(__name__)
