"""``python -m benchmarks evidence``: fills tables of the documentation from the results."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks import both_states
from benchmarks.both_states import Pair, Row
from benchmarks.speed_figure import save_speeds
from controller.cli.common import ExitCode, Subparsers, add_parser
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output
from viz.render.figure_style import PLOT_SUFFIXES

BEGIN, SENSED_BEGIN, SPEED_BEGIN, BOTH_BEGIN = (
    "<!-- evidence:begin",
    "<!-- evidence:sensors",
    "<!-- evidence:speed",
    "<!-- evidence:both",
)
"""What stands above a table: of the behaviour, of what is done on sensors, of the speed, and of
locomotion with both columns."""
END = "<!-- evidence:end -->"
HEAD = "| what | n | mean | worst | closest peer |\n|---|---|---|---|---|"
SPEED_HEAD = "| what | runs | mean | worst | before |\n|---|---|---|---|---|"
EXAMPLES = """
python -m benchmarks evidence docs/evidence.md behaviour.json
python -m benchmarks evidence docs/evidence.md locomotion.json balance.json
python -m benchmarks evidence docs/explanation/speed.md speed.json
python -m benchmarks evidence docs/evidence.md behaviour.json more.json
python -m benchmarks evidence docs/evidence.md locomotion.json balance.json
                              --plot docs/images/speeds.svg
"""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a table: a metric, what to call it, how to print it, a value to compare it with."""

    metric: str
    what: str
    shown: str
    peer: str = ""

    @property
    def metrics(self) -> tuple[str, ...]:
        """Those that it needs."""
        return (self.metric,)

    def row(self, rows: Mapping[str, Row]) -> str:
        """The line, from the results by metric.

        Raises:
            ConfigError: if the metric is missing or has no value.
        """
        found = rows.get(self.metric)
        if found is None or found["mean"] is None or found["worst"] is None:
            raise ConfigError(f"the results have no value for {self.metric}")
        mean, worst = (self.shown.format(found[key]) for key in ("mean", "worst"))
        return f"| {self.what} | {found['n']} | {mean} | {worst} | {self.peer} |"


LINES: tuple[Line, ...] = (
    Line("trot.mean_0.5", "forward 0.5 m/s: error of the mean speed", "{:.3f} %", "+7 %"),
    Line("trot.mae_0.5", "forward 0.5 m/s: mean absolute error", "{:.4f} m/s"),
    Line("trot.mean_1.0", "forward 1.0 m/s: error of the mean speed", "{:.3f} %", "+12 %"),
    Line("trot.mae_1.0", "forward 1.0 m/s: mean absolute error", "{:.4f} m/s"),
    Line("trot.torque", "the same: peak torque, of its limit", "{:.0%}"),
    Line("trot.joint_speed", "the same: peak joint speed, of its limit", "{:.0%}"),
    Line(
        "trot.mean_lateral",
        "sideways 0.5 m/s: error of the mean speed",
        "{:.3f} %",
        "+19 % at 0.3 m/s, falls at 0.5",
    ),
    Line("trot.mean_yaw", "turning 1 rad/s: error of the mean rate", "{:.3f} %", "-16 %"),
    Line(
        "trot.push_lateral",
        "trot 0.5 m/s, lateral push of 0.1 s survived in all of 8 phases, at least",
        "{:.0f} N s",
        "14 N s in 0.2 s",
    ),
    Line("trot.push_forward", "the same, forward, at least", "{:.0f} N s", "20 N s in 0.2 s"),
    Line("stand.push_lateral", "standing, lateral push of 0.1 s, no step, at least", "{:.0f} N s"),
    Line("stand.time", "standing up from lying, time", "{:.2f} s", "cannot"),
    Line("stand.torque", "the same: peak torque, of its limit", "{:.0%}", "cannot"),
    Line("goal.miss", "`move_forward(1.0)`: distance from the goal", "{:.1f} mm"),
    Line("goal.turn", "`turn_left(pi/2)`: error of the angle", "{:.2f} deg"),
    Line("five.height", "high five, paw held 2 s at", "{:.3f} m", "cannot"),
    Line("five.margin", "high five, least CoM margin", "{:.1f} cm", "cannot"),
    Line("five.load", "high five, least load of a supporting foot", "{:.0f} N", "cannot"),
    Line("slap.survived", "slaps of 40 N, 0.1 s on the held paw, of 6", "{:.0f}", "cannot"),
    Line("demo.done", "whole demo, share of seeds done", "{:.0%}", "cannot"),
    Line("demo.untrue", "whole demo, a `True` not borne out by the simulator", "{:.0f}"),
    Line("demo.pace", "whole run, real-time factor (processor time)", "{:.1f}", "1.2 to 1.6"),
)

SPEED_LINES: tuple[Line, ...] = (
    Line("solve.4.ours", "tick of the QP, 4 stance feet", "{:.1f} us", "350 us"),
    Line("solve.4.placo", "the same in PlaCo", "{:.1f} us"),
    Line("solve.4.faster", "times faster than PlaCo", "{:.2f}", "0.17"),
    Line("solve.3.ours", "tick of the QP, 3 stance feet", "{:.1f} us", "352 us"),
    Line("solve.3.placo", "the same in PlaCo", "{:.1f} us"),
    Line("solve.3.faster", "times faster than PlaCo", "{:.2f}", "0.16"),
    Line("solve.2.ours", "tick of the QP, 2 stance feet", "{:.1f} us", "342 us"),
    Line("solve.2.placo", "the same in PlaCo", "{:.1f} us"),
    Line("solve.2.faster", "times faster than PlaCo", "{:.2f}", "0.13"),
    Line("solve.4.tail", "99 of 100 ticks, 4 stance feet, by PlaCo's", "{:.2f}"),
    Line("solve.3.tail", "the same, 3 stance feet", "{:.2f}"),
    Line("solve.2.tail", "the same, 2 stance feet", "{:.2f}"),
    Line("tick.trot.median", "whole tick, trot at 0.5 m/s, 2 ms of physics", "{:.0f} us", "740 us"),
    Line("tick.stand.median", "the same, standing up", "{:.0f} us", "727 us"),
    Line("tick.high five.median", "the same, high five", "{:.0f} us", "782 us"),
    Line("tick.bow.median", "the same, a motion of the library", "{:.0f} us"),
    Line("tick.sit.median", "the same, sitting down", "{:.0f} us"),
    Line("tick.lie down.median", "the same, lying down", "{:.0f} us"),
    Line("tick.trot.factor", "real-time factor of the trot, one core", "{:.1f}", "2.7"),
    Line("estimated.median", "whole tick on sensors, forces by the MPC, 1 m/s", "{:.0f} us"),
    Line("estimated.factor", "the same, real-time factor", "{:.1f}"),
    Line("part.read", "part of the trot's tick: read the plant", "{:.1f} us", "13 us"),
    Line("part.snapshot", "part: dynamics of the state", "{:.1f} us", "74 us"),
    Line("part.update", "part: planner", "{:.1f} us", "171 us"),
    Line("part.solve", "part: QP", "{:.1f} us", "305 us"),
    Line("part.write", "part: write, with 2 ms of physics", "{:.1f} us", "89 us"),
    Line("part.record", "part: telemetry", "{:.1f} us", "17 us"),
    Line("part.rest", "part: the rest (checks, glue)", "{:.1f} us", "71 us"),
    Line("commands.worst", "60 s of random commands: worst tick by the median", "{:.1f}"),
    Line("commands.least", "the least of three identical runs: worst by the median", "{:.1f}"),
    Line("commands.bare", "a bare loop beside it: worst by the median", "{:.1f}"),
    Line("commands.peak", "memory allocated in a tick, at most at a time", "{:.1f} kB"),
    Line("check.10 s", "`check` of 10 s of motion, with probability", "{:.0f} ms"),
    Line("startup.robot.cpu", "`GO2Controller()`, with its import", "{:.2f} s", "1.17 s"),
    Line("startup.stand.cpu", "the same, and the first `stand()`", "{:.2f} s", "1.54 s"),
    Line("startup.libraries.cpu", "numpy, Pinocchio, MuJoCo and Numba alone", "{:.2f} s"),
    Line("startup.demo.cpu", "`go2-wbc demo --no-media`", "{:.1f} s"),
    Line("realtime.missed", "500 Hz at the wall clock's pace: late ticks", "{:.2f} %"),
    Line("realtime.bare", "a bare loop after it", "{:.2f} %"),
)
SENSED_LINES: tuple[Line, ...] = (
    Line("sensed-0.5.mean", "trot 0.5 m/s: error of the mean speed", "{:.2f} %", "+7 %"),
    Line("sensed-1.mean", "trot 1.0 m/s: error of the mean speed", "{:.2f} %", "+12 %"),
    Line("sensed-2.mean", "trot 2.0 m/s: error of the mean speed", "{:.2f} %", "limit 0.8 m/s"),
    Line("sensed-3.mean", "trot 3.0 m/s: error of the mean speed", "{:.2f} %", "limit 0.8 m/s"),
    Line(
        "sensed-aside-0.5.mean",
        "trot sideways 0.5 m/s: error of the mean speed",
        "{:.2f} %",
        "+19 % at 0.3 m/s, falls at 0.5",
    ),
    Line(
        "sensed-turn-2.turn",
        "turning 2 rad/s: error of the mean rate",
        "{:.2f} %",
        "-16 % at 1 rad/s",
    ),
    Line("sensed-curve.mean", "(0.8, 0.3) m/s and 1 rad/s: error of the speed", "{:.2f} %"),
    Line("creep", "standing 60 s: creep", "{:.1f} mm"),
    Line("drift", "odometry over 10 m at 0.5 m/s: off, of the way", "{:.1f} %"),
    Line("sensed-boxes.done", "boxes of 8 cm, not known: crossed", "{:.0%}"),
    Line("sensed-stairs.done", "four stairs of 8 cm: climbed", "{:.0%}"),
    Line("sensed-step.done", "step of 10 cm: climbed", "{:.0%}"),
    Line("sensed-up.done", "15 deg up: walked", "{:.0%}"),
    Line("sensed-across.done", "15 deg across: walked", "{:.0%}"),
    Line("sensed-slippery.done", "friction 0.2, not known, 0.5 m/s: walked", "{:.0%}"),
    Line("sensed-heavy.height", "payload of 6 kg, not known: height off", "{:.1f} mm"),
    Line("sensed-heavy.tilt", "the same: trunk off", "{:.1f} deg"),
    Line("sensed-stand-90", "standing, pushed by 36 N s aside: stands again", "{:.0%}"),
    Line("sensed-stand-0", "standing, pushed by 45 N s ahead: stands again", "{:.0%}"),
    Line(
        "sensed-trot-lateral",
        "trot 0.5 m/s, pushed by 26 N s aside at 16 phases: walks on",
        "{:.0%}",
        "14 N s in 0.2 s",
    ),
    Line("sensed-trot-forward", "the same, 50 N s ahead", "{:.0%}", "20 N s in 0.2 s"),
    Line("sensed-recover", "dropped at random, `recover()`: stands", "{:.0%}", "cannot"),
    Line("sensed_library.done", "the motions of the library: done", "{:.0%}", "cannot"),
)
TABLES: dict[str, tuple[str, Sequence[Line | Pair]]] = {
    BEGIN: (HEAD, LINES),
    SENSED_BEGIN: (HEAD, SENSED_LINES),
    SPEED_BEGIN: (SPEED_HEAD, SPEED_LINES),
    BOTH_BEGIN: (both_states.HEAD, both_states.PAIRS),
}
"""Head and lines by the mark above the table."""


def register(subparsers: Subparsers) -> None:
    """Add the arguments of ``evidence``."""
    parser = add_parser(
        subparsers,
        "evidence",
        "Fill those tables of the page of whose metrics there are some in what the\n"
        "benchmarks' `--out` wrote; of several files, the last one that has a metric.",
        examples=EXAMPLES,
    )
    parser.add_argument("page", metavar="PAGE", type=Path)
    parser.add_argument("results", metavar="JSON", type=Path, nargs="+")
    parser.add_argument(
        "--plot", metavar="FILE", type=_figure, help="also draw the trot's errors over its speed"
    )


def run(args: argparse.Namespace) -> int:
    """Fill the file from the results, and draw what is asked for."""
    rows = {}
    for file in args.results:
        rows |= rows_of(file)
    text = filled(args.page.read_text(encoding="utf-8"), rows)
    args.page.write_text(text, encoding="utf-8")
    if args.plot is not None:
        save_speeds(rows, args.plot)
    return ExitCode.OK


def rows_of(file: Path) -> dict[str, Row]:
    """The rows of what a benchmark's ``--out`` wrote, by their names.

    Raises:
        ConfigError: if the file is none of these.
    """
    try:
        return {row["name"]: row for row in json.loads(file.read_text(encoding="utf-8"))["rows"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{file} is not what --out of a benchmark writes: {error}") from error


def _figure(name: str) -> Path:
    """The type of ``--plot``."""
    return checked_output(name, PLOT_SUFFIXES)


def table(rows: Mapping[str, Row], mark: str = BEGIN) -> str:
    """The table as Markdown.

    Args:
        rows: results of the benchmark, by metric.
        mark: what stands above it, a key of ``TABLES``.

    Raises:
        ConfigError: if a metric is missing or has no value.
    """
    head, content = TABLES[mark]
    return "\n".join([head, *(line.row(rows) for line in content)])


def filled(text: str, rows: Mapping[str, Row]) -> str:
    """``text`` with those tables between marks replaced of which ``rows`` has any metric.

    Raises:
        ConfigError: if there is no such table, its end is missing, or one of its metrics.
    """
    metrics = {
        mark: [name for line in lines for name in line.metrics]
        for mark, (_, lines) in TABLES.items()
    }
    marks = [m for m, names in metrics.items() if m in text and not rows.keys().isdisjoint(names)]
    if not marks:
        raise ConfigError(f"the text has no {BEGIN} ... {END} for these results")
    for mark in marks:
        start = text.index("\n", text.index(mark)) + 1
        end = text.find(END, start)
        if end < 0:
            raise ConfigError(f"the text has no {END} after {mark}")
        text = f"{text[:start]}{table(rows, mark)}\n{text[end:]}"
    return text
