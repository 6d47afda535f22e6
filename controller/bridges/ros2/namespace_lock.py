"""One server per namespace: a lock among the processes of a machine, and a check of the ROS graph.

Discovery cannot tell which of two servers that start in the same second is the first. The kernel
can: it gives a socket's name to one process, and releases it when that process ends, also after
``kill -9``. Servers on other machines are only seen in the graph, some time after they have
started.
"""

from __future__ import annotations

import errno
import logging
import socket
import sys
import time
from typing import Any, final

from controller.bridges.ros2 import SERVER_NODE
from go2_wbc.errors import BridgeError

_log = logging.getLogger(__name__)

DISCOVERY = 1.2  #: Time [s] that other nodes get to be found before the robot is served
LEASE = 6.0
"""Time [s] after which the graph has forgotten a process that was killed; four, and some."""
PERIOD = 5.0
"""Time [s] between two looks for a second server, which may have come at the same moment."""


def lock_namespace(namespace: str, domain: int) -> socket.socket:
    """A socket that holds ``namespace`` of the ROS domain number ``domain`` until it is closed.

    It does so among the processes that share a loopback, and writes nothing to disk.

    Raises:
        BridgeError: if another process of this machine has it.
    """
    lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    if not sys.platform.startswith("linux"):
        return lock  # only Linux has names of sockets that are no files
    try:
        lock.bind(f"\0go2-wbc/ros2/{domain}/{namespace}")
    except OSError as error:
        lock.close()
        if error.errno == errno.EADDRINUSE:
            raise _already_served(namespace) from error
        raise BridgeError(f"/{namespace} cannot be locked: {error}") from error
    return lock


@final
class GraphWatch:
    """Looks for other servers of a namespace in the graph: two would answer every call."""

    def __init__(self, node: Any, namespace: str) -> None:
        """Look by ``node``, which is not the server's own."""
        self._node, self._namespace = node, f"/{namespace}"
        self._next = time.monotonic() + PERIOD

    def check(self) -> None:
        """Give the others time to be found, and a dead one to be forgotten.

        Raises:
            BridgeError: if one of them serves this namespace.
        """
        began = time.monotonic()
        while (passed := time.monotonic() - began) < DISCOVERY or self._servers():
            if passed > LEASE:
                raise _already_served(self._namespace.removeprefix("/"))
            time.sleep(0.05)

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


def _already_served(namespace: str) -> BridgeError:
    return BridgeError(
        f"/{namespace} is already served by another process; choose another --namespace, or "
        "another ROS_DOMAIN_ID"
    )
