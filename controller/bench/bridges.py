"""The bench of the bridges: a server in a process of its own, measured from this one."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from controller.bench.report import bar_text
from controller.bench.rows import Row
from go2_wbc.errors import BridgeError

if TYPE_CHECKING:
    from controller.bridges.ros2.measure import Meter

NAMESPACE = "bench"
START_LIMIT = 60.0
"""Time [s] in which a server must be ready."""
_TRIP, _DRIVE, _DEMO = "service call without motion, 300 calls", "cmd_vel at 50 Hz, 20 s", "demo"

ROS2_ROWS: tuple[Row, ...] = (
    Row("ros2.round_trip_p50", _TRIP, "round trip, median", "ms", 3.0),
    Row("ros2.round_trip_p99", _TRIP, "round trip, 99 %", "ms", 10.0),
    Row("ros2.calls_lost", _TRIP, "lost", "", 0.0),
    Row("ros2.commands_lost", _DRIVE, "lost", "", 0.0),
    Row("ros2.speed_error", _DRIVE, "speed error", "%", 2.0),
    Row("ros2.pace", _DRIVE, "robot time per wall time", "", None),
    Row("ros2.cpu", _DRIVE, "CPU of the ROS side", "%", 10.0),
    Row("ros2.demo", _DEMO, "steps not borne out", "", 0.0),
)


@dataclass(frozen=True, slots=True)
class BridgeReport:
    """What was measured.

    Attributes:
        values: by row name.
        reasons: of the demo's steps that were not done, in words.
    """

    values: Mapping[str, float]
    reasons: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether every bar is met."""
        return all(self.passed(row) for row in ROS2_ROWS)

    def passed(self, row: Row) -> bool:
        """Whether the bar of ``row`` is met; a row without one needs a value only."""
        value = self.values.get(row.name)
        if value is None or row.bar is None:
            return value is not None
        return row.direction.meets(value, row.bar)

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        rows = [
            {
                "name": row.name,
                "item": row.item,
                "quantity": row.quantity,
                "unit": row.unit,
                "bar": row.bar,
                "value": self.values.get(row.name),
                "passed": self.passed(row),
            }
            for row in ROS2_ROWS
        ]
        return {"passed": self.ok, "rows": rows, "reasons": list(self.reasons)}


def measure_bridges(on_progress: Callable[[str], None] = lambda _text: None) -> BridgeReport:
    """Measure the ROS 2 bridge; takes about a minute and a half.

    Raises:
        MissingDependency: if ROS 2 is not installed.
        BridgeError: if the server does not start or stops answering.
    """
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    from controller.bridges.ros2.measure import with_meter

    values: dict[str, float] = {}
    reasons: list[str] = []
    with _server():
        with_meter(NAMESPACE, lambda meter: _measure(meter, values, reasons, on_progress))
    return BridgeReport(values, tuple(reasons))


def _measure(
    meter: Meter, values: dict[str, float], reasons: list[str], on_progress: Callable[[str], None]
) -> None:
    from controller.bridges.ros2.demo import run_steps
    from controller.bridges.ros2.measure import SPEED

    on_progress(_TRIP)
    trips = meter.round_trips()
    values["ros2.round_trip_p50"] = trips.percentile(50)
    values["ros2.round_trip_p99"] = trips.percentile(99)
    values["ros2.calls_lost"] = float(trips.lost)
    on_progress(_DRIVE)
    drive = meter.drive()
    values["ros2.commands_lost"] = float(drive.sent - drive.received)
    values["ros2.speed_error"] = 100.0 * abs(drive.speed / SPEED - 1.0)
    values["ros2.pace"] = drive.pace
    values["ros2.cpu"] = 100.0 * drive.cpu_share
    on_progress(_DEMO)
    results = run_steps(meter.go2)
    reasons += [f"{step.label}: {step.reason}" for step in results if not step.ok]
    values["ros2.demo"] = float(len(reasons))


@contextmanager
def _server() -> Iterator[None]:
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "server.log"
        with log.open("w") as stream:
            process = subprocess.Popen(
                [sys.executable, "-m", "controller.cli.main", "ros2", "--realtime"]
                + ["--namespace", NAMESPACE],
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
            )
        try:
            _await_ready(process, log)
            yield
        finally:
            process.terminate()
            try:
                process.wait(10.0)
            except subprocess.TimeoutExpired:
                process.kill()


def _await_ready(process: subprocess.Popen[bytes], log: Path) -> None:
    end = time.monotonic() + START_LIMIT
    while "serving" not in log.read_text():
        if process.poll() is not None or time.monotonic() > end:
            raise BridgeError(f"the server did not start: {log.read_text().strip()}")
        time.sleep(0.1)


def render(report: BridgeReport) -> str:
    """The rows and their verdicts; at most 80 columns wide."""
    lines, item = [], ""
    for row in ROS2_ROWS:
        if row.item != item:
            item = row.item
            lines.append(item)
        value = report.values.get(row.name)
        shown = "-" if value is None else f"{value:.2f}"
        verdict = "ok" if report.passed(row) else "NO"
        lines.append(f"  {row.quantity:<30}{bar_text(row):>16}{shown:>12}  {verdict}")
    return "\n".join([*lines, *report.reasons])
