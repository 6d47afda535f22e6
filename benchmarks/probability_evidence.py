"""What is shown of the stated chances: a table of all runs, and a reliability diagram."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.probability_fit import Calibration
from controller.sweeps.rows import Row
from controller.sweeps.summary import rate_interval
from motions.feasibility.probability import ProbabilityModel
from viz.render.figure_style import save_figure
from viz.render.reliability_plot import reliability_figure

COLUMNS = ("seed", "motion", "half", "stratum", "friction", "payload", "refused", "done", "fell")
"""Of a run, besides the chance that was stated."""
_DIGITS = 3


def csv_of(model: ProbabilityModel, rows: Sequence[Row]) -> bytes:
    """A line for every run: world, verdict, stated chance and outcome."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow((*COLUMNS, "chance"))
    for row in rows:
        chance = model.probability(json.loads(str(row["margins"])))
        values = [row[name] for name in COLUMNS]
        values = [int(v) if isinstance(v, bool) else v for v in values]
        values = [round(v, _DIGITS) if isinstance(v, float) else v for v in values]
        table.writerow([*values, round(chance, _DIGITS)])
    return text.getvalue().encode()


def save_reliability(judged: Calibration, path: Path) -> Path:
    """Draw the share of the runs that were done over the chance stated, in bins.

    The intervals (Clopper-Pearson, 95 %) take runs for independent, which those of one motion
    are not.
    """
    stated, done, counts = (np.array(column) for column in zip(*judged.bins, strict=True))
    intervals = np.array(
        [rate_interval(round(s * n), int(n)) for s, n in zip(done, counts, strict=True)]
    )
    low, high = judged.error_interval
    title = (
        f"{int(counts.sum())} runs of the test half; expected error {judged.error:.3f} "
        f"({low:.3f} to {high:.3f})"
    )
    figure = reliability_figure(stated, done, counts.astype(float), intervals, title=title)
    return save_figure(figure, path)
