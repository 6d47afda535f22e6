"""``go2-wbc sweep``: a motion, a gait, a push or a function over many seeds, in many processes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json, shown_path
from controller.cli.motion_args import add_values, the_motion
from controller.cli.progress import ProgressLine

if TYPE_CHECKING:
    from controller.sweeps.run import Progress, SweepResult
    from controller.sweeps.summary import Summary

LINES = 20
"""How often progress is told where no line can be rewritten."""
EXAMPLES = """
go2-wbc sweep high_five --n 200
go2-wbc sweep gait:trot@0.5 --n 100 --workers 2 --plot trot.svg
go2-wbc sweep push:12 --n 300 --export pushes.csv
go2-wbc sweep my_study.py:trial --n 1000 --out study.sqlite
go2-wbc sweep my_study.py:trial --n 9000 --engine ray --address auto
"""
WHAT = """a motion: name of the library, FILE.py[:NAME], FILE.json, FILE.plan;
gait:NAME[@VX[,VY[,WZ]]]; push:IMPULSE[@SPEED] (N s, m/s); or a
function (seed) -> row: FILE.py:NAME, MODULE:NAME"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``sweep``."""
    parser = add_parser(
        subparsers,
        "sweep",
        "Run something over many seeds, keep every row in an SQLite file as it is\n"
        "finished, and print rates and means with their 95 % intervals. The same\n"
        "command goes on after an interruption. The rows depend on the seeds only,\n"
        "not on the number or kind of workers. Exit code 0 if every seed gave a row,\n"
        "1 if some did not.",
        examples=EXAMPLES,
    )
    parser.add_argument("what", metavar="WHAT", help=WHAT)
    parser.add_argument("--n", metavar="N", type=int, default=1000, help="seeds, default 1000")
    add_runs(parser)
    parser.add_argument(
        "--keep-going", action="store_true", help="a seed that fails does not end the sweep"
    )
    add_values(parser)
    parser.add_argument(
        "--export", metavar="FILE", nargs="+", type=Path, default=[], help=".csv or .parquet"
    )
    parser.add_argument("--plot", metavar="FILE", type=Path, help=".svg, .png or .pdf")
    parser.add_argument("--json", action="store_true", help="print JSON")


def add_runs(parser: argparse.ArgumentParser) -> None:
    """Add the options that say which seeds run where, and where rows are kept."""
    parser.add_argument(
        "--first-seed", metavar="K", type=int, default=0, help="the first of them, default 0"
    )
    parser.add_argument(
        "--workers", metavar="N", type=int, help="processes, default: all processors"
    )
    parser.add_argument(
        "--engine", metavar="NAME", default="local", help="local (default) or ray: many machines"
    )
    parser.add_argument("--address", help="of the Ray cluster, default: one of this machine")
    parser.add_argument(
        "--out", metavar="FILE", type=Path, help="keep the rows here, default: in out/sweeps"
    )
    parser.add_argument("--fresh", action="store_true", help="begin anew, do not go on")


def run(args: argparse.Namespace) -> int:
    """Run the sweep, print the summary, write what was asked for."""
    from controller.sweeps.export import export_rows, require_exporter
    from controller.sweeps.run import sweep
    from controller.sweeps.summary import summarise
    from go2_wbc.files import checked_output
    from viz import PLOT_SUFFIXES

    for path in args.export:
        require_exporter(path)
    if args.plot is not None:
        checked_output(args.plot, PLOT_SUFFIXES)
    with ProgressLine() as line:
        line.update(0.0, "starting")
        result = sweep(
            _target(args),
            args.n,
            first_seed=args.first_seed,
            workers=args.workers,
            engine=args.engine,
            address=args.address,
            out=args.out,
            fresh=args.fresh,
            keep_going=args.keep_going,
            on_progress=lambda progress: tell(line, progress),
        )
    summary = summarise(result.rows, result.columns)
    written = [export_rows(result, path) for path in args.export]
    if args.plot is not None:
        written.append(_plot(result, summary, args.plot))
    if args.json:
        print_json(_as_dict(result, summary, written))
    else:
        _print(result, summary, written)
    return ExitCode.FAILED if result.failures else ExitCode.OK


def _target(args: argparse.Namespace) -> object:
    """What is swept; a motion with the parameters that were chosen."""
    from controller.sweeps.targets import motion_target

    if not args.values:
        return args.what
    return motion_target(the_motion(args.what, args.values), " ".join([args.what, *args.values]))


def tell(line: ProgressLine, progress: Progress) -> None:
    """Show how far a sweep has come."""
    place = f"{progress.done}/{progress.total}"
    if progress.rate:
        left = _duration(progress.remaining)
        place += f", {progress.rate:.3g} a second, {left} left"
    line.update(progress.share, place)
    step = max(progress.total // LINES, 1)
    if progress.failure is not None:
        line.done(f"{place}: {progress.failure.text}")
    elif progress.rate and (progress.done % step == 0 or progress.done == progress.total):
        line.done(place)


def _duration(seconds: float) -> str:
    """``seconds`` in the largest unit that fits."""
    for size, unit in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} s"


def _plot(result: SweepResult, summary: Summary, path: Path) -> Path:
    from viz import export_distributions

    values = {name: [row[name] for row in result.rows] for name in result.columns}
    numbers = {item.name: [float(v) for v in values[item.name]] for item in summary.spreads}
    rates = {item.name: (item.rate, item.low, item.high) for item in summary.rates}
    title = f"{result.name}, {summary.n} seeds"
    return export_distributions(numbers, rates, path, title=title)


def _as_dict(result: SweepResult, summary: Summary, written: list[Path]) -> dict[str, Any]:
    return {
        "what": result.name,
        "file": str(result.path),
        "failures": {str(seed): text for seed, text in result.failures.items()},
        "written": [str(path) for path in written],
        **summary.as_dict(),
    }


def _print(result: SweepResult, summary: Summary, written: list[Path]) -> None:
    print(f"{result.name:.60}, {summary.n} seeds")
    print("-" * 80)
    for rate in summary.rates:
        interval = f"95 %: {100 * rate.low:.1f} to {100 * rate.high:.1f} %"
        print(f"  {rate.name:<20.20}{100 * rate.rate:>8.1f} %   {interval}")
    if summary.spreads:
        print(f"  {'':<20}{'mean':>11}{'95 %, +-':>11}{'5th':>9}{'95th':>9}{'least':>9}{'most':>9}")
    for item in summary.spreads:
        low, _, high = item.percentiles
        head = f"  {item.name:<20.20}{item.mean:>11.4g}{0.5 * (item.high - item.low):>11.2g}"
        tail = "".join(f"{v:>9.2g}" for v in (low, high, item.least, item.most))
        print(head + tail + ("" if item.n == summary.n else f"\n    in {item.n} rows"))
    for words in summary.words:
        if words.commonest is not None:
            text, count = words.commonest
            print(f"  {words.name:<20.20}{words.n:>8} rows; {count} times: {text!r:.38}")
    print("-" * 80)
    for seed, text in result.failures.items():
        print(f"  seed {seed} gave no row: {text:.55}")
    print(f"rows: {shown_path(result.path)}")
    for path in written:
        print(f"wrote {shown_path(path)}")
