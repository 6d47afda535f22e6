"""``python -m benchmarks evidence``: fills the table of evidence from the results."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from controller.cli.common import ExitCode, Subparsers, add_parser
from go2_wbc.errors import ConfigError

BEGIN, END = "<!-- evidence:begin", "<!-- evidence:end -->"
HEAD = "| what | n | mean | worst | closest peer |\n|---|---|---|---|---|"
EXAMPLES = """
python -m benchmarks evidence docs/evidence.md behaviour.json
python -m benchmarks evidence docs/evidence.md behaviour.json more.json
"""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the table: a metric, what to call it, how to print it, the closest peer's value."""

    metric: str
    what: str
    shown: str
    peer: str = ""


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


def register(subparsers: Subparsers) -> None:
    """Add the arguments of ``evidence``."""
    parser = add_parser(
        subparsers,
        "evidence",
        "Fill the page's table from what `behaviour --out` wrote; a metric that is in\n"
        "several files is taken from the last.",
        examples=EXAMPLES,
    )
    parser.add_argument("page", metavar="PAGE", type=Path)
    parser.add_argument("results", metavar="JSON", type=Path, nargs="+")


def run(args: argparse.Namespace) -> int:
    """Fill the file from the results."""
    rows = {}
    for file in args.results:
        rows |= {row["name"]: row for row in json.loads(file.read_text())["rows"]}
    text = filled(args.page.read_text(encoding="utf-8"), rows)
    args.page.write_text(text, encoding="utf-8")
    return ExitCode.OK


def table(rows: Mapping[str, Mapping[str, float]]) -> str:
    """The table as Markdown.

    Args:
        rows: results of the benchmark, by metric.

    Raises:
        ConfigError: if a metric is missing or has no value.
    """
    lines = [HEAD]
    for line in LINES:
        found = rows.get(line.metric)
        if found is None or found["mean"] is None or found["worst"] is None:
            raise ConfigError(f"the results have no value for {line.metric}")
        mean, worst = (line.shown.format(found[key]) for key in ("mean", "worst"))
        lines.append(f"| {line.what} | {found['n']} | {mean} | {worst} | {line.peer} |")
    return "\n".join(lines)


def filled(text: str, rows: Mapping[str, Mapping[str, float]]) -> str:
    """``text`` with the table between its marks replaced.

    Raises:
        ConfigError: if the marks are missing, or a metric is.
    """
    begin = text.find(BEGIN)
    end = text.find(END, begin)
    if begin < 0 or end < 0:
        raise ConfigError(f"the text has no {BEGIN} ... {END}")
    start = text.index("\n", begin) + 1
    return f"{text[:start]}{table(rows)}\n{text[end:]}"
