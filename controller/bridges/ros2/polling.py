"""Subscriptions and services that are polled from the control loop instead of an executor.

An executor takes 0.1 ms a turn to find that there is nothing to do, and half a millisecond for a
callback; asking a handle takes 2 us. The handles are not documented: that is why the extra pins
the version of rclpy.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from controller.bridges.ros2.names import COMMAND_QUEUE


class PolledSubscription:
    """The messages of a topic, taken when asked."""

    def __init__(self, node: Any, kind: Any, name: str) -> None:
        """Subscribe ``node`` to the topic ``name``."""
        self._kind = kind
        self._handle = node.create_subscription(kind, name, _never, COMMAND_QUEUE).handle

    def take(self) -> Iterator[Any]:
        """The messages that have come since, at most one queue full."""
        for _ in range(COMMAND_QUEUE):
            with self._handle:
                taken = self._handle.take_message(self._kind, False)
            if taken is None:
                return
            yield taken[0]


@dataclass(frozen=True, slots=True)
class Call:
    """A call of a service that waits for its answer."""

    request: Any
    _kind: Any
    _service: Any
    _header: Any

    def answer(self, *, success: bool, message: str) -> None:
        """Send the response; nobody minds if the caller has gone."""
        response = self._kind.Response(success=success, message=message)
        self._service.send_response(response, self._header)


class PolledService:
    """The calls of a service that answers ``success`` and ``message``, when their time has come."""

    def __init__(self, node: Any, kind: Any, name: str) -> None:
        """Offer the service ``name`` on ``node``."""
        self._kind = kind
        self._service = node.create_service(kind, name, _never)

    def take(self) -> Iterator[Call]:
        """The calls that have come since, at most one queue full."""
        handle = self._service.handle
        for _ in range(COMMAND_QUEUE):
            with handle:
                request, header = handle.service_take_request(self._kind.Request)
            if request is None:
                return
            yield Call(request, self._kind, self._service, header)


def _never(*_arguments: Any) -> None:
    """The callback that ROS wants; no executor ever calls it."""
