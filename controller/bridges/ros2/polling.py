"""Subscriptions and services that are polled from the control loop instead of an executor.

An executor takes 0.1 ms a turn to find that there is nothing to do, and half a millisecond for a
callback; asking a handle takes 2 us. The handles are not documented: that is why the extra pins
the version of rclpy.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from controller.bridges.ros2.names import COMMAND_QUEUE
from controller.jobs import Answer, Reply


class PolledSubscription:
    """Takes the messages of a topic when asked."""

    def __init__(self, node: Any, kind: Any, name: str, act: Callable[[Any], None]) -> None:
        """Subscribe ``node`` to the topic ``name``; ``act`` is given each message."""
        self._kind, self._act = kind, act
        self._handle = node.create_subscription(kind, name, _never, COMMAND_QUEUE).handle

    def poll(self) -> None:
        """Take the messages that have come since, at most one queue full."""
        for _ in range(COMMAND_QUEUE):
            with self._handle:
                taken = self._handle.take_message(self._kind, False)
            if taken is None:
                return
            self._act(taken[0])


class PolledService:
    """Takes the calls of a service that answers ``success`` and ``message`` when asked."""

    def __init__(self, node: Any, kind: Any, name: str, act: Callable[[Any, Reply], None]) -> None:
        """Offer the service ``name`` on ``node``; ``act`` is given each request and its reply."""
        self._kind, self._act = kind, act
        self._service = node.create_service(kind, name, _never)

    def poll(self) -> None:
        """Take the calls that have come since, at most one queue full."""
        handle = self._service.handle
        for _ in range(COMMAND_QUEUE):
            with handle:
                request, header = handle.service_take_request(self._kind.Request)
            if request is None:
                return
            self._act(request, partial(self._answer, header))

    def _answer(self, header: Any, answer: Answer) -> None:
        response = self._kind.Response(success=answer.ok, message=answer.reason)
        self._service.send_response(response, header)


def _never(*_arguments: Any) -> None:
    """The callback that ROS wants; no executor ever calls it."""
