"""How a notebook shows a motion, a report, a recording or a sweep: a page, margins, a table.

``go2_wbc.brief.inline_html`` finds ``html_of`` by the entry point ``go2_wbc.inline``, so that the
packages below need not know about pages.
"""

from __future__ import annotations

import base64
import html

from controller.report_view import planned, verdict_of
from controller.sweeps.run import SweepResult
from controller.sweeps.summary import summarise
from controller.telemetry import SeenTerrain
from go2_wbc.errors import Go2WbcError
from go2_wbc.recording import Recording
from motions import CheckedMotion, CompiledPlan, FeasibilityChecker, FeasibilityReport, Timeline
from viz.content import ReplayContent
from viz.render.ground import ground_figure
from viz.render.plots import margin_figure
from viz.replay.page_data import replay_html
from viz.style import png_of

HEIGHT = 620  #: Of a page [px]
LONGEST = 60.0
"""Motions and recordings that last longer [s] are not drawn unasked: the page would be large."""


def html_of(value: object) -> str | None:
    """HTML for ``value``; None if there is nothing to show beyond its ``repr``."""
    try:
        if isinstance(value, FeasibilityReport):
            return _report(value)
        if isinstance(value, SweepResult):
            return _table(value)
        if isinstance(value, Recording):
            return _page(ReplayContent(value), "recording", value.duration)
        if isinstance(value, SeenTerrain):
            return _picture(png_of(ground_figure(value.points(), repr(value))))
        if isinstance(value, Timeline | CompiledPlan):
            value = FeasibilityChecker().evaluate(value)
        if isinstance(value, CheckedMotion):
            report = value.report
            page = _page(planned(value), report.motion, report.duration)
            return f"{page}<pre>{html.escape(report.table())}</pre>" if page else _report(report)
    except Go2WbcError:  # what cannot be drawn is still told in a line
        return None
    return None


def _page(content: ReplayContent, title: str, duration: float) -> str | None:
    if duration > LONGEST:
        return None
    page = html.escape(replay_html(content, title=title))
    return f'<iframe srcdoc="{page}" style="width:100%;height:{HEIGHT}px;border:0"></iframe>'


def _report(report: FeasibilityReport) -> str:
    table, verdict = html.escape(report.table()), verdict_of(report)
    if not verdict.curves:
        return f"<pre>{table}</pre>"
    figure = margin_figure(verdict, title=report.motion)
    return f"<pre>{table}</pre>{_picture(png_of(figure))}"


def _picture(png: bytes) -> str:
    picture = base64.b64encode(png).decode()
    return f'<img style="max-width:100%" src="data:image/png;base64,{picture}">'


def _table(result: SweepResult) -> str:
    summary = summarise(result.rows, result.columns)
    rows = [(item.name, f"{item.count} of {item.n}", item.low, item.high) for item in summary.rates]
    rows += [(item.name, f"{item.mean:.4g}", item.low, item.high) for item in summary.spreads]
    cells = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{middle}</td><td>{low:.4g}</td><td>{high:.4g}</td></tr>"
        for name, middle, low, high in rows
    )
    head = "<tr><th></th><th>mean</th><th>low</th><th>high</th></tr>"
    return f"<p>{html.escape(repr(result))}</p><table>{head}{cells}</table>"
