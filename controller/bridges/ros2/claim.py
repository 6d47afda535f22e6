"""A namespace is claimed by one process of a machine; the claim ends with it, however it ends."""

from __future__ import annotations

import errno
import socket
import sys

from go2_wbc.errors import BridgeError


class Claim:
    """Holds a namespace of a ROS domain, among the processes that share a loopback.

    Discovery cannot tell which of two servers that start in the same second is the first. The
    kernel can: it gives a socket's name to one process, and takes it back at its end, also after
    ``kill -9``. Nothing is written to disk. Servers of different machines are not kept apart.
    """

    def __init__(self, namespace: str, domain: int) -> None:
        """Claim ``namespace``.

        Args:
            namespace: of the server.
            domain: of ROS, by number.

        Raises:
            BridgeError: if another process of this machine has claimed it.
        """
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        if not sys.platform.startswith("linux"):
            return  # only Linux has names of sockets that are no files
        try:
            self._socket.bind(f"\0go2-wbc/ros2/{domain}/{namespace}")
        except OSError as error:
            self._socket.close()
            if error.errno == errno.EADDRINUSE:
                raise already_served(namespace) from error
            raise BridgeError(f"/{namespace} cannot be claimed: {error}") from error

    def close(self) -> None:
        """Give it back."""
        self._socket.close()


def already_served(namespace: str) -> BridgeError:
    """What is wrong, and what helps."""
    return BridgeError(
        f"/{namespace} is already served by another process; choose another --namespace, or "
        "another ROS_DOMAIN_ID"
    )
