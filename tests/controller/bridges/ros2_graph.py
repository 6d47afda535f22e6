"""What the tests of the ROS 2 bridge need: the extra, the loopback, and a domain of their own.

Importing this module needs no ROS: ``needs_ros2`` skips what does.
"""

import importlib.util
import os
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
HAS_ROS2 = importlib.util.find_spec("rclpy") is not None
HAS_INTERFACES = importlib.util.find_spec("quadropted_msgs") is not None
IS_REQUIRED = "GO2_WBC_REQUIRE_ROS2" in os.environ
"""Set by ``make test-ros2``: what is missing is then a failure, not a test that is skipped."""
needs_ros2 = pytest.mark.skipif(
    not (HAS_ROS2 and HAS_INTERFACES) and not IS_REQUIRED,
    reason="ROS 2 is not here: run `make test-ros2`, which installs the extra [ros2]",
)


def isolate() -> None:
    """Keep this process and its children on the loopback, in a ROS domain of their own."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_DOMAIN_ID"] = str(20 + (os.getppid() + 7 * worker) % 70)
    os.environ.setdefault("ROS_LOG_DIR", str(Path(tempfile.gettempdir()) / "go2-wbc-ros-log"))
