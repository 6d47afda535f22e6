"""Every test of the bridges talks on the loopback only, in a ROS domain of its own."""

import subprocess
from collections.abc import Callable, Iterator
from contextlib import closing

import pytest

from tests.controller.bridges.processes import Process
from tests.controller.bridges.ros2_graph import HAS_ROS2, isolate
from tests.controller.bridges.ros2_probe import WatchingProbe
from tests.controller.bridges.ros2_processes import joined, serving

PACED_ATTEMPTS = 3  #: How often a busy machine gets the chance to keep real time for a demo
Done = subprocess.CompletedProcess[str]

if HAS_ROS2:
    isolate()


@pytest.fixture(scope="module")
def graph() -> Iterator[None]:
    with joined():
        yield


@pytest.fixture(scope="module")
def server(graph: None) -> Iterator[Process]:
    """A robot in real time."""
    with serving(namespace="robot1") as running:
        yield running


@pytest.fixture
def probe(server: Process) -> Iterator[WatchingProbe]:
    """Watches the robot of ``server``."""
    with closing(WatchingProbe()) as node:
        yield node


@pytest.fixture
def paced(probe: WatchingProbe) -> Callable[[Callable[[], Done]], Done]:
    """Runs a program whose limits count on real time, again if the server has lost it."""

    def run(act: Callable[[], Done]) -> Done:
        for left in reversed(range(PACED_ATTEMPTS)):
            before = probe.statistics()["paces_given_up"]
            done = act()
            has_lost_pace = probe.statistics()["paces_given_up"] > before
            if done.returncode == 0 or not (has_lost_pace and left):
                return done
        raise AssertionError("no attempt")

    return run
