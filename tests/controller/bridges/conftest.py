"""Every test of the bridges talks on the loopback only, in a ROS domain of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from tests.controller.bridges.ros2_graph import HAS_ROS2, Probe, Server, isolate, serving

if HAS_ROS2:
    isolate()


@pytest.fixture(scope="module")
def graph() -> Iterator[None]:
    import rclpy

    import controller.bridges.ros2.imports  # noqa: F401  (sets the discovery profile)

    rclpy.init()
    yield
    rclpy.try_shutdown()


@pytest.fixture(scope="module")
def server(graph: None) -> Iterator[Server]:
    """A robot in real time."""
    with serving("--realtime") as running:
        yield running


@pytest.fixture
def probe(graph: None) -> Iterator[Probe]:
    node = Probe()
    yield node
    node.close()


@pytest.fixture
def real_time(server: Server, probe: Probe) -> Callable[[], None]:
    """Says so if the server could not keep the pace that a test's wall-clock limits count on."""
    before = probe.statistics()["paces_given_up"]

    def check() -> None:
        if probe.statistics()["paces_given_up"] > before:
            pytest.fail("the server lost real time: the loop is too slow, or the machine too busy")

    return check
