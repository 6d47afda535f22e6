"""Fills the README's table of evidence from what ``go2-wbc bench behaviour --out`` wrote.

python -m benchmarks.evidence README.md behaviour.json [MORE.json ...]
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from go2_wbc.errors import ConfigError

BEGIN, END = "<!-- evidence:begin", "<!-- evidence:end -->"
HEAD = "| what | n | mean | worst | closest peer |\n|---|---|---|---|---|"


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the table: the bench's row, what to call it, how to print it, the peer's figure.

    Attributes:
        row: name of the bench's row.
        what: what the reader reads.
        shown: format of a value.
        peer: the closest peer's figure.
    """

    row: str
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


def table(rows: Mapping[str, Mapping[str, float]]) -> str:
    """The table as Markdown.

    Args:
        rows: results of the bench, by the name of the row.

    Raises:
        ConfigError: if a row is missing or has no value.
    """
    lines = [HEAD]
    for line in LINES:
        found = rows.get(line.row)
        if found is None or found["mean"] is None or found["worst"] is None:
            raise ConfigError(f"the results have no value for {line.row}")
        mean, worst = (line.shown.format(found[key]) for key in ("mean", "worst"))
        lines.append(f"| {line.what} | {found['n']} | {mean} | {worst} | {line.peer} |")
    return "\n".join(lines)


def filled(text: str, rows: Mapping[str, Mapping[str, float]]) -> str:
    """``text`` with the table between its marks replaced.

    Raises:
        ConfigError: if the marks are missing, or a row is.
    """
    begin = text.find(BEGIN)
    end = text.find(END, begin)
    if begin < 0 or end < 0:
        raise ConfigError(f"the text has no {BEGIN} ... {END}")
    start = text.index("\n", begin) + 1
    return f"{text[:start]}{table(rows)}\n{text[end:]}"


def main(argv: Sequence[str]) -> None:
    """Fill the file ``argv[0]`` from the JSON files that follow."""
    readme = Path(argv[0])
    rows = {}
    for name in argv[1:]:
        rows |= {row["name"]: row for row in json.loads(Path(name).read_text())["rows"]}
    readme.write_text(filled(readme.read_text(encoding="utf-8"), rows), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
