"""Over many seeds: ``go2-wbc sweep``, ``certify`` and ``replay``."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from controller.cli.common import (
    ExitCode,
    Html,
    Json,
    ProgressLine,
    plot_file,
    print_json,
    shown_path,
)
from controller.cli.motion_args import Friction, MotionWord, Payload, Settings, the_motion
from go2_wbc.errors import CommandError

if TYPE_CHECKING:
    from controller.sweeps.certify import Certificate
    from controller.sweeps.run import Progress, SweepResult
    from controller.sweeps.summary import Summary
    from go2_wbc.world import World
    from motions import CompiledPlan, Timeline

LINES = 20  #: How often progress is told where no line can be rewritten
WHAT = """a motion: name of the library, FILE.py[:NAME], FILE.json, FILE.plan;
gait:NAME[@VX[,VY[,WZ]]]; push:IMPULSE[@SPEED] (N s, m/s); or a
function (seed) -> row: FILE.py:NAME, MODULE:NAME"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """Which seeds run where, and where rows are kept: see ``controller.sweep``."""

    first_seed: Annotated[int, "K", "the first of them, default 0"] = 0
    workers: Annotated[int | None, "N", "processes, default: all processors"] = None
    engine: Annotated[str, "NAME", "local (default) or ray: many machines"] = "local"
    address: Annotated[str | None, "of the Ray cluster, default: one of this machine"] = None
    out: Annotated[Path | None, "FILE", "keep the rows here, default: in out/sweeps"] = None
    fresh: Annotated[bool, "begin anew, do not go on"] = False


def sweep_command(
    what: Annotated[str, "WHAT", WHAT],
    *,
    n: Annotated[int, "N", "seeds, default 1000"] = 1000,
    runs: Runs,
    keep_going: Annotated[bool, "a seed that fails does not end the sweep"] = False,
    set: Settings = (),
    export: Annotated[tuple[Path, ...], "FILE", ".csv or .parquet"] = (),
    plot: Annotated[Path | None, "FILE", ".svg, .png or .pdf", plot_file] = None,
    over: Annotated[tuple[str, ...], "NAME", "columns that --plot draws it over, one or two"] = (),
    json: Json = False,
) -> int:
    """Run something over many seeds, and keep every row in an SQLite file as it is finished.

    It prints rates and means with their 95 % intervals. The same command goes on after an
    interruption. The rows depend on the seeds only, not on the number or kind of workers. Exit code
    0 if every seed gave a row, 1 if some did not.

    Examples:
        go2-wbc sweep high_five --n 200
        go2-wbc sweep gait:trot@0.5 --n 100 --workers 2 --plot trot.svg
        go2-wbc sweep bow --n 300 --plot bow.svg --over friction mass_scale
        go2-wbc sweep push:12 --n 300 --export pushes.csv
        go2-wbc sweep my_study.py:trial --n 1000 --out study.sqlite
        go2-wbc sweep my_study.py:trial --n 9000 --engine ray --address auto
    """
    from controller.sweeps.run import export_rows, require_exporter, sweep
    from controller.sweeps.summary import summarise
    from controller.sweeps.targets import motion_target

    if over and plot is None:
        raise CommandError("--over says what --plot draws: give --plot FILE, too")
    for path in export:
        require_exporter(path)
    with ProgressLine() as line:
        line.update(0.0, "starting")
        target = motion_target(the_motion(what, set), " ".join([what, *set])) if set else what
        progress = partial(tell, line)
        result = sweep(target, n, keep_going=keep_going, on_progress=progress, **asdict(runs))
    summary = summarise(result.rows, result.columns)
    written = [export_rows(result, path) for path in export]
    if plot is not None:
        written.append(_plot(result, summary, plot, over))
    if json:
        print_json(_as_dict(result, summary, written))
    else:
        _print(result, summary, written)
    return ExitCode.FAILED if result.failures else ExitCode.OK


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


def _plot(result: SweepResult, summary: Summary, path: Path, over: tuple[str, ...]) -> Path:
    """The outcomes over what was varied; how each is spread, where that is not known."""
    from controller.sweeps.relation import relations
    from viz import export_distributions, export_relations

    title = f"{result.name}, {summary.n} seeds"
    found = relations(result.rows, result.columns, over)
    if found:
        return export_relations(found, path, title=title)
    values = {name: [row[name] for row in result.rows] for name in result.columns}
    numbers = {item.name: [float(v) for v in values[item.name]] for item in summary.spreads}
    rates = {item.name: (item.rate, item.low, item.high) for item in summary.rates}
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


# --- certify --------------------------------------------------------------------------------------


def certify_command(
    motion: MotionWord,
    *,
    set: Settings = (),
    n: Annotated[int, "N", "runs, default %(default)s"] = 200,
    friction: Friction = None,
    payload: Payload = None,
    width: Annotated[
        float | None, "SHARE", "end early once the interval is no wider than this, such as 0.05"
    ] = None,
    at_least: Annotated[
        float | None, "RATE", "the lower end of the interval must reach this, such as 0.95"
    ] = None,
    runs: Runs,
    html: Annotated[Html, "write the 3D page of the plan with all this"] = None,
    json: Json = False,
) -> int:
    """Play a motion in many random worlds in MuJoCo, and say how often it is done.

    Friction, mass, heading and start differ. It prints the 95 % interval of the rate
    (Clopper-Pearson) and the worst runs. Exit code 1 if the rate is below --at-least.

    Examples:
        go2-wbc certify high_five
        go2-wbc certify my_motion.py:bow --at-least 0.95
        go2-wbc certify bow --friction 0.4 --payload 3
        go2-wbc certify jump_up --n 1000 --width 0.05
        go2-wbc certify wave --set times=5 --json
        go2-wbc certify high_five --html high_five.html
    """
    from controller.sweeps.certify import certify
    from go2_wbc.world import DOUBTFUL, World

    if at_least is not None and not 0.0 < at_least < 1.0:
        raise CommandError(f"--at-least must be between 0 and 1, got {at_least:g}")
    meant, world = the_motion(motion, set), World.of(friction, payload, DOUBTFUL)
    with ProgressLine() as line:
        line.update(0.0, "starting")
        progress = partial(tell, line)
        found = certify(meant, n, world=world, width=width, on_progress=progress, **asdict(runs))
        if html is not None:
            line.update(1.0, "writing the page")
            _write_page(meant, found, html, world)
    if json:
        print_json(found.as_dict())
    else:
        print(found.table())
        print(f"rows: {shown_path(found.path)}")
        if html is not None:
            print(f"3D page, offline: {shown_path(html)}")
    is_enough = at_least is None or found.meets(at_least)
    if not is_enough and not json:
        print(f"below {at_least:g}: the interval begins at {found.interval[0]:.3f}")
    return ExitCode.OK if is_enough else ExitCode.FAILED


def _write_page(
    motion: Timeline | CompiledPlan, certificate: Certificate, page: Path, world: World
) -> None:
    """The plan with the verdict on it in ``world``, its chance and the certificate."""
    from controller.report_view import planned
    from controller.sweeps.certify import with_certificate
    from motions import FeasibilityChecker
    from viz import export_html

    checked = FeasibilityChecker(world=world).evaluate(motion)
    content = with_certificate(planned(checked), certificate, checked.plan)
    export_html(content, page, title=certificate.motion)


# --- replay ---------------------------------------------------------------------------------------


def replay_command(
    file: Annotated[Path, "FILE", "of `go2-wbc sweep`"],
    row: Annotated[int, "ROW", "the seed of the row"],
    *,
    html: Html = None,
    json: Json = False,
) -> int:
    """Run a row of a motion's sweep again, in the world of its seed, and say what came of it.

    It writes a 3D page of the run, the plan as a ghost. Exit code 0 if it gave the row that is
    kept, 1 if it gave another one (another version, or kind of processor).

    Examples:
        go2-wbc sweep high_five --n 200
        go2-wbc replay out/sweeps/high_five.sqlite 17 --html seed_17.html
    """
    from controller.sweeps.motion_study import replay
    from viz import export_html

    with ProgressLine() as line:
        line.update(0.0, "running it again")
        shown = replay(file, row)
        if html is not None:
            line.update(0.9, "writing the page")
            export_html(shown.content, html, title=shown.title)
    if json:
        print_json({"row": dict(shown.row), "differences": list(shown.differences)})
    else:
        print(shown.title)
        print("-" * 80)
        for name, value in shown.row.items():
            mark = "   another than in the file" if name in shown.differences else ""
            print(f"  {name:<20.20}{value!s:.30}{mark}")
        print("-" * 80)
        if html is not None:
            print(f"3D replay, offline: {shown_path(html)}")
    return ExitCode.FAILED if shown.differences else ExitCode.OK
