"""``GO2Controller``: the ROS 2 client of go2-wbc under the name that this package promises."""

from controller.bridges.ros2.client import GO2ControllerNode


class GO2Controller(GO2ControllerNode):
    """A Go2 that a ROS 2 server drives; see ``GO2ControllerNode`` for what it can do."""
