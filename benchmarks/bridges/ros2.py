"""ROS 2 between real processes on the loopback: calls, velocity commands, the course's demo."""

import math
import time
from contextlib import closing
from typing import Final

import numpy as np

from benchmarks.study import Study, TrialResult
from controller.sweeps.trials import Trial
from go2_wbc.errors import BridgeError, MissingDependency
from tests.controller.bridges.ros2_processes import Probe, joined, quiet_client, serving

NAMESPACE: Final = "bench"
CALLS: Final = 300
CALL_LIMIT: Final = 5.0  #: Time [s] after which a call counts as lost
UNKNOWN: Final = "no_such_behaviour"
"""A command that moves nothing: what is left is the way there and back."""
SPEED: Final = 0.3  #: Forward speed [m/s] that is commanded
DRIVE_TIME, SETTLE_TIME = 20.0, 2.0
"""Time [s] of the drive, and of its start that does not count for the speed."""
ROS_CPU: Final = ("ros_cpu_in_loop", "cpu_of_other_threads")
"""What of the server's statistics is processor time of the ROS side."""

TABLE: Final = {
    "ROS 2: service call without motion, 300 calls": (
        ("round_trip_p50", "round trip, median", "<= 3 ms"),
        ("round_trip_p99", "round trip, 99 %", "<= 10 ms"),
        ("calls_lost", "calls lost", "<= 0"),
    ),
    "ROS 2: cmd_vel, 50 Hz, 20 s": (
        ("commands_lost", "commands lost", "<= 0"),
        ("speed_error", "0.3 m/s: mean speed error", "<= 2 %"),
        ("pace", "robot time per wall time", ">="),
        ("cpu", "CPU of the ROS side", "<= 10 %"),
    ),
    "ROS 2: the course's demo": (("demo", "steps not confirmed, of 8", "<= 0"),),
}


def measure(_trial: Trial, found: TrialResult) -> None:
    """Three hundred calls, twenty seconds of walking and the demo, with one server."""
    from controller.bridges.ros2.demo import run_steps

    with joined(), serving(namespace=NAMESPACE):
        with closing(Probe(NAMESPACE)) as probe:
            found.values = _round_trips(probe) | _drive(probe)
        with quiet_client(NAMESPACE) as go2:
            undone = [f"{step.label}: {step.reason}" for step in run_steps(go2) if not step.ok]
    found.values["demo"] = float(len(undone))
    if undone:
        found.failures["demo"] = "; ".join(undone)


def _round_trips(probe: Probe) -> dict[str, float]:
    """Call a behaviour that does not exist, one call after the other."""
    times: list[float] = []
    for _ in range(CALLS):
        began = time.perf_counter()
        try:
            answer = probe.result(probe.send(UNKNOWN), CALL_LIMIT)
        except BridgeError:
            continue
        if not answer.success:
            times.append(1000.0 * (time.perf_counter() - began))
    p50, p99 = np.percentile(times or [math.nan], (50, 99)).tolist()
    lost = float(CALLS - len(times))
    return {"round_trip_p50": p50, "round_trip_p99": p99, "calls_lost": lost}


def _drive(probe: Probe) -> dict[str, float]:
    """Walk straight ahead with 50 commands a second; the speed is in the robot's own time."""
    answer = probe.call("walk")
    if not answer.success:
        raise BridgeError(f"the robot does not walk: {answer.message}")
    before = probe.statistics()
    sent = probe.drive(SETTLE_TIME, SPEED)
    start = probe.statistics()
    sent += probe.drive(DRIVE_TIME - SETTLE_TIME, SPEED)
    after = probe.statistics()
    probe.move(0.0)
    way = math.dist(after["position"][:2], start["position"][:2])
    speed = way / (after["robot_time"] - start["robot_time"])
    wall_time = after["wall_time"] - before["wall_time"]
    received = after["cmd_vel"]["received"] - before["cmd_vel"]["received"]
    return {
        "commands_lost": float(sent - received),
        "speed_error": 100.0 * abs(speed / SPEED - 1.0),
        "pace": (after["robot_time"] - before["robot_time"]) / wall_time,
        "cpu": 100.0 * sum(after[name] - before[name] for name in ROS_CPU) / wall_time,
    }


def require() -> None:
    """Make sure that ROS 2 and the interfaces are installed.

    Raises:
        MissingDependency: if not; names what installs them.
    """
    from controller.bridges.ros2 import imports

    missing = imports.missing_interfaces()
    if missing:
        raise MissingDependency(f"{', '.join(missing)} not installed: {imports.BUILD}")


STUDY: Final = Study("ros2-calls", TABLE, measure, "ros2", group="ros2")
