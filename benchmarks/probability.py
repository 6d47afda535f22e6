"""``python -m benchmarks probability``: is the chance that the check states the one that it has?

Every motion of the exam is checked and played in random worlds. ``--fit`` fits the model of
``motions.feasibility.report`` to the train half and to random sentences of the language, and
stores it; what is reported is of the test half, whose families no threshold and no fit has seen.
"""

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from benchmarks.command import FOLDER, Jobs, Output, RowsFile, positive, run_sweep
from benchmarks.probability_fit import Calibration, Sample, calibration, fit_model
from benchmarks.probability_runs import DRAWN, exam, motion_and_world, seeds, trial
from benchmarks.validation_set.drawing import TEST, TRAIN
from controller.cli.common import output, plot_file
from controller.sweeps.summary import rate_interval
from controller.sweeps.sweep_file import Row
from go2_wbc.errors import CommandError
from go2_wbc.files import write_atomically
from motions.feasibility.report import FILE, ProbabilityModel, fitted
from viz.style import ACCENT, INK, MUTED, STYLE, TRACK, save_figure

FITTED = (TRAIN, DRAWN)  # What the model may be fitted to
ERROR, BRIER_SHARE = 0.05, 0.5
"""Greatest expected calibration error, and Brier score over that of the base rate."""
COLUMNS = ("seed", "motion", "half", "stratum", "friction", "payload", "refused", "done", "fell")
"""Of a run, besides the chance that was stated."""
DIGITS = 3
FIGURE_SIZE = (4.6, 4.0)  # [inch]


def run(
    *,
    motions: Annotated[int | None, "N", "only the first N, and no sentences", positive] = None,
    fit: Annotated[bool, "fit to train half and sentences, and store"] = False,
    data: Annotated[
        Path | None, "FILE", "write a .csv with a line for every run", output(".csv")
    ] = None,
    plot: Annotated[Path | None, "FILE", "draw the reliability: .svg, ...", plot_file] = None,
    rows: RowsFile = FOLDER / "probability.sqlite",
    jobs: Jobs = 2,
    output: Output,
) -> int:
    """Is the chance that the check states the one that a motion has?

    The motions of the exam are checked and played in random worlds. Exit code 0 if the test half
    is calibrated and no motion that passed fell, 1 if not.

    Examples:
    python -m benchmarks probability         two worlds to fit, five to judge,
                                             3,000 sentences to fit
    python -m benchmarks probability --motions 60
    python -m benchmarks probability --fit   also fit the model, and store it
    python -m benchmarks probability --data docs/data/probability.csv
                                     --plot docs/images/reliability.svg
    """
    least = 1 + next(n for n, one in enumerate(exam()) if one.family.half == TEST)
    if motions is not None and motions < least:
        told = f"none of the first {motions} is of the test half, which judges"
        raise CommandError(f"--motions must be {least} or more: {told}")
    result = run_sweep(trial, seeds(motions), rows, jobs)
    found, model = result.rows, fitted()
    if fit:
        model = fit_model(_samples(_of_halves(found, *FITTED)))
        store(model, found, result.about["code"])
    judged, falls = judge(model, _of_halves(found, TEST)), passed_that_fell(found)
    if data:
        write_atomically(data, csv_of(model, found))
    if plot:
        save_reliability(judged, plot)
    is_ok = judged.error <= ERROR and judged.brier <= BRIER_SHARE * judged.brier_of_base_rate
    is_ok = is_ok and not falls and not result.failures
    counts = len(falls), sum(not row["refused"] for row in found)
    about = {"passed_that_fell": counts, "lost": result.failures}
    values = {"passed": is_ok, **asdict(judged), **about}
    return output.publish(values, render(judged, found, result.failures))


def _of_halves(rows: Sequence[Row], *halves: str) -> list[Row]:
    return [row for row in rows if row["half"] in halves]


def _samples(rows: Sequence[Row]) -> list[Sample]:
    return [
        Sample(str(row["motion"]), json.loads(str(row["margins"])), bool(row["done"]))
        for row in rows
    ]


def store(model: ProbabilityModel, rows: Sequence[Row], code: str, file: Path = FILE) -> None:
    """Write the model where the package looks for it, with what it was fitted to.

    ``code`` names that of the check and of physics, as files of sweeps do.
    """
    fitted_to = _of_halves(rows, *FITTED)
    about = {
        "fitted_by": "python -m benchmarks probability --fit",
        "motions": len({row["motion"] for row in fitted_to}),
        "runs": len(fitted_to),
        "code": code,
    }
    text = json.dumps({"about": about, **model.as_dict()}, indent=1)
    write_atomically(file, (text + "\n").encode())


def judge(model: ProbabilityModel, rows: Sequence[Row]) -> Calibration:
    """How well the chances of ``model`` foretell what happened."""
    samples = _samples(rows)
    chances = np.array([model.probability(sample.margins) for sample in samples])
    done = np.array([sample.is_done for sample in samples])
    return calibration(chances, done, [sample.motion for sample in samples])


def passed_that_fell(rows: Sequence[Row]) -> list[Row]:
    """The motions that the check passed in their world and that fell there."""
    return [row for row in rows if row["fell"] and not row["refused"]]


def render(judged: Calibration, rows: Sequence[Row], lost: dict[int, str]) -> str:
    """The reliability table and the verdicts, at most 80 columns wide."""
    lines = ["chance stated    done    runs", "-" * 80]
    for chance, share, count in judged.bins:
        low, high = rate_interval(round(share * count), count)
        bar = "#" * round(40 * share)
        lines.append(f"{chance:>13.2f}{share:>8.2f}{count:>8}   {low:.2f}-{high:.2f}  {bar}")
    low, high = judged.error_interval
    fallen = passed_that_fell(rows)
    of = sum(not row["refused"] for row in rows)
    error, rate = f"{judged.error:.3f} (95 %: {low:.3f} to {high:.3f})", judged.brier_of_base_rate
    lines += [
        "-" * 80,
        f"expected calibration error {error}, bar {ERROR:g}",
        f"Brier score {judged.brier:.3f}, of the base rate {rate:.3f}, bar half of it",
        f"motions that passed in their world and fell there: {len(fallen)} of {of}",
        *(f"seed {row['seed']}: {motion_and_world(row)}" for row in fallen),
        *(f"seed {seed} gave no row: {why:.55}" for seed, why in lost.items()),
    ]
    return "\n".join(lines)


def csv_of(model: ProbabilityModel, rows: Sequence[Row]) -> bytes:
    """A line for every run: world, verdict, stated chance and outcome."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow((*COLUMNS, "chance"))
    for row, sample in zip(rows, _samples(rows), strict=True):
        values = (*(row[name] for name in COLUMNS), model.probability(sample.margins))
        values = (int(v) if isinstance(v, bool) else v for v in values)
        table.writerow(round(v, DIGITS) if isinstance(v, float) else v for v in values)
    return text.getvalue().encode()


def save_reliability(judged: Calibration, path: Path) -> Path:
    """Draw the share of the runs that were done over the chance stated, in bins.

    The intervals (Clopper-Pearson, 95 %) take runs for independent, which those of one motion
    are not.
    """
    low, high = judged.error_interval
    title = f"{sum(n for *_, n in judged.bins)} runs of the test half; expected error "
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=FIGURE_SIZE, layout="constrained")
        axes = figure.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1.0], color=TRACK, lw=1.2)
        for stated, done, n in judged.bins:
            axes.vlines(stated, *rate_interval(round(done * n), n), color=ACCENT, lw=1.6)
            axes.plot(stated, done, "o", color=INK, ms=4)
            place = {"xytext": (5, -8), "textcoords": "offset points"}
            axes.annotate(f"{n}", (stated, done), color=MUTED, **place)
        axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
        axes.set(xlabel="chance stated", ylabel="share done", aspect="equal")
        axes.set_xticks(np.linspace(0.0, 1.0, 11), minor=True)
        axes.spines[["top", "right"]].set_visible(False)
        said = f"{title}{judged.error:.3f} ({low:.3f} to {high:.3f})"
        axes.set_title(said, loc="left", size=8.0, color=INK)
    return save_figure(figure, path)
