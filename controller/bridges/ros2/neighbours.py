"""Other servers in the same graph: two of one namespace would fight for every call.

Those of this machine are kept away by a ``Claim``; what is found here runs on another one, or has
been killed a moment ago.
"""

from __future__ import annotations

import logging
import os
import time
from typing import Any

from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.claim import already_served
from controller.bridges.ros2.names import SERVER_NODE

_log = logging.getLogger(__name__)

DISCOVERY = 1.2
"""Time [s] that other nodes get to be found before the robot is served."""
LEASE = 6.0
"""Time [s] after which the graph has forgotten a process that was killed; four, and some."""
PERIOD = 5.0
"""Time [s] between two looks for a second server, which may have come at the same moment."""


class Neighbours:
    """Looks for other servers of one namespace, from a node of its own."""

    def __init__(self, context: Any, namespace: str) -> None:
        """Look for servers of ``namespace``."""
        self._namespace = f"/{namespace}"
        self._node = ros.Node(
            f"go2_wbc_lookout_{os.getpid()}",
            namespace=namespace,
            context=context,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._next = time.monotonic() + PERIOD
        self.have_clock = False

    def check(self) -> None:
        """Give the others time to be found, and a dead one to be forgotten.

        Raises:
            BridgeError: if one of them serves this namespace.
        """
        end = time.monotonic() + DISCOVERY
        while time.monotonic() < end and not self._servers():
            time.sleep(0.05)
        end = time.monotonic() + LEASE
        while self._servers():
            if time.monotonic() > end:
                raise already_served(self._namespace.removeprefix("/"))
            time.sleep(0.05)
        self.have_clock = self._node.count_publishers("/clock") > 0
        if self.have_clock:
            _log.warning("another process publishes /clock: this one does not; use --realtime")

    def look(self) -> None:
        """Report, once in a while, if a second server has come after all."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + PERIOD
        if self._servers() > 1:
            _log.error("%s is served twice: end one of the servers", self._namespace)

    def _servers(self) -> int:
        found = self._node.get_node_names_and_namespaces()
        return found.count((SERVER_NODE, self._namespace))

    def close(self) -> None:
        """Release the node."""
        self._node.destroy_node()
