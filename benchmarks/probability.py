"""``python -m benchmarks probability``: is the chance that the check states the one that it has?

Every motion of the exam is checked and played in random worlds. ``--fit`` fits the model of
``motions.feasibility.probability`` to the train half and to random sentences of the language, and
stores it; what is reported is of the test half, whose families no threshold and no fit has seen.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.command import add_sweep, positive, publish, run_sweep
from benchmarks.probability_fit import Calibration, Sample, calibration, fit
from benchmarks.probability_runs import DRAWN, seeds, trial
from benchmarks.validation_set.drawing import TEST, TRAIN
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.sweeps.rows import Row
from controller.sweeps.summary import rate_interval
from go2_wbc.files import checked_output, write_atomically
from motions.feasibility.probability import FILE, ProbabilityModel, fitted
from viz.render.evidence_plot import reliability_figure
from viz.style import PLOT_SUFFIXES, save_figure

FITTED = (TRAIN, DRAWN)
"""What the model may be fitted to."""
ERROR, BRIER_SHARE = 0.05, 0.5
"""Greatest expected calibration error, and Brier score over that of the base rate."""
COLUMNS = ("seed", "motion", "half", "stratum", "friction", "payload", "refused", "done", "fell")
"""Of a run, besides the chance that was stated."""
DIGITS = 3
EXAMPLES = """
python -m benchmarks probability         two worlds to fit, five to judge,
                                         3,000 sentences to fit
python -m benchmarks probability --motions 60
python -m benchmarks probability --fit   also fit the model, and store it
python -m benchmarks probability --data docs/data/probability.csv
                                 --plot docs/images/reliability.svg
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``probability``."""
    parser = add_parser(
        subparsers,
        "probability",
        "Is the chance that the check states the one that a motion has? The motions of\n"
        "the exam are checked and played in random worlds. Exit code 0 if the test half\n"
        "is calibrated and no motion that passed fell, 1 if not.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "--motions", metavar="N", type=positive, help="only the first N, and no sentences"
    )
    parser.add_argument(
        "--fit", action="store_true", help="fit to train half and sentences, and store"
    )
    parser.add_argument(
        "--data", metavar="FILE", type=Path, help="write a .csv with a line for every run"
    )
    parser.add_argument("--plot", metavar="FILE", type=Path, help="draw the reliability: .svg, ...")
    add_sweep(parser, jobs=2)


def run(args: argparse.Namespace) -> int:
    """Run what is not kept, fit if asked, and judge the test half."""
    data = args.data and checked_output(args.data, [".csv"])
    plot = args.plot and checked_output(args.plot, PLOT_SUFFIXES)
    result = run_sweep(args, trial, seeds(args.motions))
    model = fitted()
    if args.fit:
        model = fit(_samples(_of_halves(result.rows, *FITTED)))
        store(model, result.rows, result.about["code"])
    judged, falls = judge(model, _of_halves(result.rows, TEST)), passed_that_fell(result.rows)
    if data:
        write_atomically(data, csv_of(model, result.rows))
    if plot:
        save_reliability(judged, plot)
    is_ok = is_calibrated(judged) and falls[0] == 0 and not result.failures
    values = {
        "passed": is_ok,
        "error": judged.error,
        "error_interval": judged.error_interval,
        "brier": judged.brier,
        "brier_of_base_rate": judged.brier_of_base_rate,
        "bins": judged.bins,
        "passed_that_fell": falls,
        "lost": result.failures,
    }
    publish(args, values, render(judged, result.rows, result.failures))
    return ExitCode.OK if is_ok else ExitCode.FAILED


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
    motions = {row["motion"] for row in fitted_to}
    about = {
        "fitted_by": "python -m benchmarks probability --fit",
        "motions": len(motions),
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


def is_calibrated(judged: Calibration) -> bool:
    """Whether both bars are met."""
    return judged.error <= ERROR and judged.brier <= BRIER_SHARE * judged.brier_of_base_rate


def passed_that_fell(rows: Sequence[Row]) -> tuple[int, int]:
    """How many of the motions that the check passed in their world fell there, of how many."""
    passed = [row for row in rows if not row["refused"]]
    return sum(bool(row["fell"]) for row in passed), len(passed)


def render(judged: Calibration, rows: Sequence[Row], lost: dict[int, str]) -> str:
    """The reliability table and the verdicts, at most 80 columns wide."""
    falls = passed_that_fell(rows)
    lines = ["chance stated    done    runs", "-" * 80]
    for chance, share, count in judged.bins:
        low, high = rate_interval(round(share * count), count)
        bar = "#" * round(40 * share)
        lines.append(f"{chance:>13.2f}{share:>8.2f}{count:>8}   {low:.2f}-{high:.2f}  {bar}")
    low, high = judged.error_interval
    lines += [
        "-" * 80,
        f"expected calibration error {judged.error:.3f} (95 %: {low:.3f} to {high:.3f}), "
        f"bar {ERROR:g}",
        f"Brier score {judged.brier:.3f}, of the base rate {judged.brier_of_base_rate:.3f}, "
        f"bar half of it",
        f"motions that passed in their world and fell there: {falls[0]} of {falls[1]}",
    ]
    lines += [
        f"seed {row['seed']}: {row['motion']:.40}, friction {row['friction']:.2f}, "
        f"{row['payload']:.1f} kg"
        for row in rows
        if row["fell"] and not row["refused"]
    ]
    lines += [f"seed {seed} gave no row: {why:.55}" for seed, why in lost.items()]
    return "\n".join(lines)


def csv_of(model: ProbabilityModel, rows: Sequence[Row]) -> bytes:
    """A line for every run: world, verdict, stated chance and outcome."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow((*COLUMNS, "chance"))
    for row in rows:
        chance = model.probability(json.loads(str(row["margins"])))
        values = [row[name] for name in COLUMNS]
        values = [int(v) if isinstance(v, bool) else v for v in values]
        values = [round(v, DIGITS) if isinstance(v, float) else v for v in values]
        table.writerow([*values, round(chance, DIGITS)])
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
