"""The trot's errors over its speed, on the true state and on sensors, beside the closest peer's."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.both_states import SPEEDS, Row, names_of
from go2_wbc.errors import ConfigError
from viz.palette import ACCENT, MUTED, TIGHT
from viz.render.figure_style import save_figure
from viz.render.speed_plot import SpeedLine, SpeedPanel, speed_figure

STATES = (("true state", ACCENT), ("own sensors", TIGHT))
PEER = {0.5: 7.0, 0.8: 9.5, 1.0: 12.0}
"""Mean error [%] of go2-convex-mpc over its speed [m/s], on the true state (measured 2026-11)."""
PANELS = (
    ("mean", "error of the mean speed, %", True),
    ("mae", "mean absolute error, m/s", False),
    ("saturated", "ticks with a motor at all it has, %", False),
)


def save_speeds(rows: Mapping[str, Row], path: Path) -> Path:
    """Draw mean and worst of the results over the speed.

    Raises:
        ConfigError: if none of the results is of a speed.
    """
    panels = [
        SpeedPanel(title, _lines(rows, metric), is_logarithmic)
        for metric, title, is_logarithmic in PANELS
    ]
    if not any(panel.lines for panel in panels):
        raise ConfigError("the results have no speeds to draw: run `benchmarks locomotion` first")
    return save_figure(speed_figure(panels), path)


def _lines(rows: Mapping[str, Row], metric: str) -> list[SpeedLine]:
    lines = []
    for state, (label, color) in enumerate(STATES):
        found = {
            float(speed): row
            for speed in SPEEDS
            if (row := rows.get(f"{names_of(speed)[state]}.{metric}")) and row["mean"] is not None
        }
        if found:
            means = np.array([row["mean"] for row in found.values()], float)
            worst = np.array([row["worst"] for row in found.values()], float)  # None is nan
            lines.append(SpeedLine(label, color, np.array([*found]), means, worst))
    if metric == "mean" and lines:
        speeds, errors = np.array([*PEER]), np.array([*PEER.values()])
        lines.append(SpeedLine("closest peer, true state", MUTED, speeds, errors, errors))
    return lines
