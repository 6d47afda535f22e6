"""ROS 2 between real processes on the loopback: calls, velocity commands, the course's demo."""

from __future__ import annotations

from typing import Final

from benchmarks.bridges.ros2_processes import serving, stay_on_this_machine
from benchmarks.rows import Direction, Family, Measurement, Row
from benchmarks.trials import Trial
from go2_wbc.errors import MissingDependency

NAMESPACE: Final = "bench"
_TRIP = "ROS 2: service call without motion, 300 calls"
_DRIVE = "ROS 2: cmd_vel, 50 Hz, 20 s"
_DEMO = "ROS 2: the course's demo"
ROWS: Final = (
    Row("ros2.round_trip_p50", _TRIP, "round trip, median", "ms", 3.0),
    Row("ros2.round_trip_p99", _TRIP, "round trip, 99 %", "ms", 10.0),
    Row("ros2.calls_lost", _TRIP, "calls lost", "", 0.0),
    Row("ros2.commands_lost", _DRIVE, "commands lost", "", 0.0),
    Row("ros2.speed_error", _DRIVE, "0.3 m/s: mean speed error", "%", 2.0),
    Row("ros2.pace", _DRIVE, "robot time per wall time", "", None, Direction.AT_LEAST),
    Row("ros2.cpu", _DRIVE, "CPU of the ROS side", "%", 10.0),
    Row("ros2.demo", _DEMO, "steps not borne out, of 8", "", 0.0),
)


def measure(_trial: Trial) -> Measurement:
    """Three hundred calls, twenty seconds of walking and the demo, with one server.

    Raises:
        MissingDependency: if ROS 2 is not installed.
        BridgeError: if the server does not start or stops answering.
    """
    stay_on_this_machine()
    from benchmarks.bridges.ros2_measure import SPEED, metering
    from controller.bridges.ros2.demo import run_steps

    with serving(namespace=NAMESPACE), metering(NAMESPACE) as meter:
        trips, drive, steps = meter.round_trips(), meter.drive(), run_steps(meter.go2)
    undone = [f"{step.label}: {step.reason}" for step in steps if not step.ok]
    values = {
        "ros2.round_trip_p50": trips.percentile(50),
        "ros2.round_trip_p99": trips.percentile(99),
        "ros2.calls_lost": float(trips.lost),
        "ros2.commands_lost": float(drive.sent - drive.received),
        "ros2.speed_error": 100.0 * abs(drive.speed / SPEED - 1.0),
        "ros2.pace": drive.pace,
        "ros2.cpu": 100.0 * drive.cpu_share,
        "ros2.demo": float(len(undone)),
    }
    return Measurement(values, {"ros2.demo": "; ".join(undone)} if undone else {})


def require() -> None:
    """Make sure that ROS 2 and the interfaces are installed.

    Raises:
        MissingDependency: if not; names what installs them.
    """
    from controller.bridges.ros2 import imports

    missing = imports.missing_interfaces()
    if missing:
        raise MissingDependency(f"{', '.join(missing)} not installed: {imports.BUILD}")


FAMILY: Final = Family("ros2-calls", ROWS, measure)
