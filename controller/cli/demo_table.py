"""The report of a demo as text, at most 80 columns wide."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from controller.demo.report import DemoReport, DemoTotals, Measurement, StepResult

WIDTH = 80
_HEADER = f"     {'step':<21}{'time':>7}  {'figure':<23}{'asked':>9}{'measured':>9}"
_INDENT = " " * 5
_DECIMALS = {"deg": 1}
"""Decimals of a unit's numbers; 3 for any other."""


def render(report: DemoReport, encoding: str | None = None) -> str:
    """The table of steps, the totals and the verdict.

    Args:
        encoding: of the terminal; ticks and crosses become words where it lacks them.
    """
    done = sum(step.ok for step in report.steps)
    verdict = f"{done} of {len(report.steps)} steps done."
    if report.ok:
        verdict = f"All {done} steps done, each judged by what was measured."
    return "\n".join(
        [render_steps(report.steps, encoding), *_total_rows(report.totals), "", verdict]
    )


def render_steps(steps: Sequence[StepResult], encoding: str | None = None) -> str:
    """The table of steps alone, with a line below; see ``render``."""
    marks = _marks(encoding)
    rows = [_HEADER, "-" * WIDTH]
    for step in steps:
        head = f"{marks[step.ok]:>4} {step.label:<21}{step.duration:>5.1f} s  "
        first, *others = [_cells(figure) for figure in step.figures] or [""]
        rows += [(head + first).rstrip(), *(" " * len(head) + cells for cells in others)]
        if not step.ok:
            rows += textwrap.wrap(
                step.reason, WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT
            )
    return "\n".join([*rows, "-" * WIDTH])


def _marks(encoding: str | None) -> dict[bool, str]:
    try:
        "✓✗".encode(encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return {True: "ok", False: "FAIL"}
    return {True: "✓", False: "✗"}


def _cells(figure: Measurement) -> str:
    decimals = _DECIMALS.get(figure.unit, 3)
    asked = "" if figure.asked is None else f"{figure.asked:.{decimals}f}"
    measured = f"{figure.measured:.{decimals}f}" if math.isfinite(figure.measured) else "-"
    return f"{figure.name:<23}{asked:>9}{measured:>9} {figure.unit}"


def _total_rows(totals: DemoTotals) -> list[str]:
    lines = (
        ("peak joint torque", f"{100 * totals.peak_torque_ratio:.0f} % of its limit"),
        ("peak joint speed", f"{100 * totals.peak_speed_ratio:.0f} % of its limit"),
        ("on three legs: least support margin", _or_dash(totals.least_support_margin, "m", 3)),
        ("on three legs: least load of a foot", _or_dash(totals.least_foot_load, "N", 0)),
        ("control ticks without a QP solution", str(totals.qp_failures)),
        ("robot time", f"{totals.robot_time:.1f} s"),
        ("CPU time of control and physics", f"{totals.cpu_time:.1f} s"),
        ("real-time factor", f"{totals.real_time_factor:.1f}"),
    )
    return [f"{_INDENT}{name:<38}{value}" for name, value in lines]


def _or_dash(value: float, unit: str, decimals: int) -> str:
    return f"{value:.{decimals}f} {unit}" if math.isfinite(value) else "-"
