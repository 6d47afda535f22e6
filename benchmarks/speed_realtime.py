"""500 ticks a second at the pace of the wall clock: how many are late. Wants a core of its own."""

from __future__ import annotations

import time
from contextlib import closing

from benchmarks.scenario import Measurement, Metric
from benchmarks.speed_bare import BareWork, share_late
from controller.go2_controller import GO2Controller
from controller.sweeps.trials import Trial, TrialFailed

DURATION = 60.0
"""Time [s] of the trot."""

_ITEM = "500 Hz at the wall clock's pace, 60 s of trot"
METRICS = (
    Metric("realtime.missed", _ITEM, "ticks that ended late", "%", 0.1),
    Metric("realtime.bare", _ITEM, "a bare loop after it, late", "%", None),
    Metric("realtime.ticks", _ITEM, "ticks", "", None),
    Metric("realtime.load", _ITEM, "processor time", "%", None),
)


def measure_realtime(trial: Trial) -> Measurement:
    """Trot for a minute; count the ticks that were not done when the next was due."""
    with closing(trial.plant()) as plant, GO2Controller(plant=plant, realtime=True) as go2:
        if not go2.walk():
            raise TrialFailed(go2.last_outcome.reason)
        go2.move(0.5)
        start, used = go2.state.time, time.process_time()
        missed = go2.telemetry.missed_deadlines
        time.sleep(DURATION)
        ticks = (go2.state.time - start) / plant.control_period
        missed = go2.telemetry.missed_deadlines - missed
        used = time.process_time() - used
        if not go2.stand():
            raise TrialFailed(go2.last_outcome.reason)
    work = BareWork(1e6 * used / ticks)
    return Measurement(
        {
            "realtime.bare": share_late(work, plant.control_period, DURATION),
            "realtime.missed": 100.0 * missed / ticks,
            "realtime.ticks": ticks,
            "realtime.load": 100.0 * used / DURATION,
        }
    )
