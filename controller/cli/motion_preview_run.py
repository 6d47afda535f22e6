"""What ``go2-wbc preview`` does; imports the robot."""

from __future__ import annotations

import argparse
import json
import sys
import time
import webbrowser
from pathlib import Path
from typing import final

import viz
from controller.cli.common import ExitCode, print_json
from controller.cli.motion_args import MotionSource, the_motion
from controller.cli.progress import ProgressLine
from controller.report_view import planned
from go2_wbc.errors import Go2WbcError
from go2_wbc.files import checked_output
from go2_wbc.plant.mujoco.viewer import display_problem
from motions import CheckedMotion, FeasibilityChecker, FeasibilityReport
from viz.replay.preview_server import PreviewServer

POLL_PERIOD = 0.05
"""Time [s] between two looks at the file."""
VIDEO_RATE = 12.5
"""Pictures per second: 80 ms each, which GIF can store."""


def write_files(args: argparse.Namespace) -> int:
    """Check the motion and write what was asked for."""
    targets: dict[str, Path] = {}
    if args.html is not None:
        targets["html"] = checked_output(args.html, viz.HTML_SUFFIXES)
    if args.plot is not None:
        targets["plot"] = checked_output(args.plot, viz.PLOT_SUFFIXES)
    if args.video is not None:
        targets["video"] = checked_output(args.video, viz.ANIMATION_SUFFIXES)
    checked = FeasibilityChecker().evaluate(the_motion(args.motion, args.values))
    written = _written(checked, targets)
    report = checked.report
    if args.json:
        files = {kind: str(path) for kind, path in written.items()}
        print_json({**report.as_dict(), "files": files})
    else:
        _print_verdict(report)
        for path in written.values():
            print(f"wrote {_short(path)}: {path.stat().st_size / 1000:.0f} kB")
    return _code(report)


def _written(checked: CheckedMotion, targets: dict[str, Path]) -> dict[str, Path]:
    content, title = planned(checked), checked.plan.name
    written = {}
    with ProgressLine() as line:
        if "html" in targets:
            line.update(0.0, f"writing {targets['html'].name}")
            written["html"] = viz.export_html(content, targets["html"], title=title)
        if "plot" in targets and content.verdict is not None:
            written["plot"] = viz.export_plot(content.verdict, targets["plot"], title=title)
        if "video" in targets:
            video = targets["video"]
            written["video"] = viz.export_animation(
                content,
                video,
                speed=1.0,
                fps=VIDEO_RATE,
                progress=lambda share: line.update(share, f"drawing {video.name}"),
            )
    return written


def serve(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C."""
    source = MotionSource(args.motion, args.values)
    checker = FeasibilityChecker()
    checked = checker.evaluate(source.timeline())
    with PreviewServer(planned(checked), source.name, args.port) as server:
        live = _Live(source, checker, server, is_json=args.json)
        try:
            live.announce(checked.report)
            if not args.no_open and display_problem() is None:
                webbrowser.open(server.url)
            while True:
                time.sleep(POLL_PERIOD)
                live.update()
        except KeyboardInterrupt:
            return live.code


@final
class _Live:
    """Follows the file.

    Attributes:
        code: exit code for what was saved last.
    """

    def __init__(
        self,
        source: MotionSource,
        checker: FeasibilityChecker,
        server: PreviewServer,
        *,
        is_json: bool,
    ) -> None:
        self._source, self._checker, self._server = source, checker, server
        self._is_json = is_json
        self.code = ExitCode.OK

    def announce(self, report: FeasibilityReport) -> None:
        """Say where the page is, and the first verdict."""
        if self._is_json:
            self._print_line({"url": self._server.url, "file": str(self._source.path)})
        else:
            where = _short(self._source.path)
            print(f"{self._source.name}: {self._server.url}   (follows {where}; Ctrl-C ends)")
        self._report(report)

    def update(self) -> None:
        """Look at the file; if it was saved, check and show what it says now."""
        if not self._source.has_changed():
            return
        try:
            checked = self._checker.evaluate(self._source.timeline())
            self._server.publish(planned(checked))
        except (Go2WbcError, OSError) as error:
            self._report_error(str(error))
        else:
            self._report(checked.report)

    def _report(self, report: FeasibilityReport) -> None:
        self.code = _code(report)
        if self._is_json:
            self._print_line(report.as_dict())
        else:
            _print_verdict(report)

    def _report_error(self, message: str) -> None:
        self.code = ExitCode.FAILED
        self._server.publish_error(message)
        if self._is_json:
            self._print_line({"error": message})
        else:
            print(f"go2-wbc: {message}", file=sys.stderr, flush=True)

    def _print_line(self, value: dict[str, object]) -> None:
        print(json.dumps(value), flush=True)


def _print_verdict(report: FeasibilityReport) -> None:
    print(report.summary())
    for finding in report.failures:
        print(f"     {finding}")
    sys.stdout.flush()


def _code(report: FeasibilityReport) -> ExitCode:
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _short(path: Path) -> Path:
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path
