"""What is shown of the stated chances: a table of all runs, and a reliability diagram."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from benchmarks.probability_fit import BINS, Calibration
from controller.sweeps.rows import Row
from controller.sweeps.summary import rate_interval
from motions.feasibility.probability import ProbabilityModel
from viz.palette import ACCENT, INK, MUTED, TRACK
from viz.render.figure_style import STYLE

COLUMNS = ("seed", "motion", "half", "stratum", "friction", "payload", "refused", "done", "fell")
"""Of a run, besides the chance that was stated."""
_DIGITS = 3
_SIZE = (4.6, 4.0)
"""Of the figure [inch]."""


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


def reliability_figure(judged: Calibration) -> Figure:
    """Share of the runs that were done over the chance stated, in bins, with 95 % intervals.

    The intervals (Clopper-Pearson) take runs for independent, which those of one motion are not.
    """
    stated, done, counts = (np.array(column) for column in zip(*judged.bins, strict=True))
    low, high = np.array(
        [rate_interval(round(s * n), int(n)) for s, n in zip(done, counts, strict=True)]
    ).T
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=_SIZE, layout="constrained")
        axes = figure.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1.0], color=TRACK, lw=1.2)
        axes.vlines(stated, low, high, color=ACCENT, lw=1.6)
        axes.plot(stated, done, "o", color=INK, ms=4)
        for x, y, n in zip(stated, done, counts, strict=True):
            axes.annotate(f"{n:.0f}", (x, y), (5, -8), textcoords="offset points", color=MUTED)
        axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
        axes.set(xlabel="chance stated", ylabel="share done")
        axes.set_xticks(np.linspace(0.0, 1.0, BINS + 1), minor=True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_aspect("equal")
        low_error, high_error = judged.error_interval
        axes.set_title(
            f"{int(counts.sum())} runs of the test half; expected error {judged.error:.3f} "
            f"({low_error:.3f} to {high_error:.3f})",
            loc="left",
            size=8.0,
            color=INK,
        )
    return figure
