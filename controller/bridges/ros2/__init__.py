"""ROS 2: the robot as a node (``serve``), and a client with ``GO2Controller``'s methods.

This module has the names that the server offers. ROS is imported only when ``serve`` or
``GO2ControllerNode`` is used; without the extra ``[ros2]`` that raises ``MissingDependency``, with
the line that installs it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from controller.bridges.ros2.client import GO2ControllerNode
    from controller.bridges.ros2.server import serve

__all__ = ["GO2ControllerNode", "serve"]

__getattr__ = lazy_exports(__name__)

BEHAVIOR_SERVICE, STATISTICS_SERVICE = "robot_behavior_command", "statistics"
MOTION_ACTION = "play_motion"
CMD_VEL, ODOM = "cmd_vel", "odom"
SERVER_NODE = "go2_wbc"
COMMAND_PERIOD = 0.02  #: Time [s] between two sendings of a velocity command that lasts
COMMAND_QUEUE = 100
"""Commands that are kept for the loop: two seconds' worth, should the machine be that busy."""


def topic(namespace: str, name: str) -> str:
    """Full name of a topic, service or action of one robot."""
    return f"/{namespace}/{name}"
