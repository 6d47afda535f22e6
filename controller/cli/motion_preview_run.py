"""What ``go2-wbc preview`` does; imports the robot."""

from __future__ import annotations

import argparse
import sys
import time
import webbrowser
from dataclasses import replace
from pathlib import Path

import viz
from controller.cli.common import ExitCode, print_json, print_json_line, shown_path
from controller.cli.motion_args import MotionSource, print_verdict, the_motion
from controller.cli.progress import ProgressLine
from controller.report_view import planned, slider
from controller.sweeps.certificate_view import with_certificate
from controller.sweeps.certify import read_certificate
from controller.sweeps.motion_study import world_of
from go2_wbc.errors import Go2WbcError
from go2_wbc.files import checked_output
from go2_wbc.plant.mujoco.viewer import display_problem
from motions import CheckedMotion, FeasibilityChecker, FeasibilityReport
from viz.content import ReplayContent
from viz.replay.preview_server import PreviewServer

POLL_PERIOD = 0.05
"""Time [s] between two looks at the file."""
VIDEO_RATE = 12.5
"""Pictures per second: 80 ms each, which GIF can store."""


class _Show:
    """Checks motions, and makes of them what is shown: with a certificate, if one is given.

    Attributes:
        checker: for the world of the certificate, or the usual one.
    """

    def __init__(self, certificate: Path | None, line: ProgressLine) -> None:
        """Read the certificate; raises as ``read_certificate``."""
        self._certificate = None if certificate is None else read_certificate(certificate)
        held = self._certificate
        world = None if held is None else world_of(held.about["world"])
        self.checker = FeasibilityChecker(progress=line.solving, world=world)

    def content(self, checked: CheckedMotion) -> ReplayContent:
        """The plan with its verdict and the certificate."""
        content = planned(checked)
        if self._certificate is None:
            return content
        return with_certificate(content, self._certificate, checked.plan)


def write_files(args: argparse.Namespace) -> int:
    """Check the motion and write what was asked for."""
    wanted = {
        "html": (args.html, viz.HTML_SUFFIXES),
        "plot": (args.plot, viz.PLOT_SUFFIXES),
        "video": (args.video, viz.ANIMATION_SUFFIXES),
    }
    files = {kind: checked_output(*item) for kind, item in wanted.items() if item[0] is not None}
    motion = the_motion(args.motion, args.values)
    with ProgressLine(is_quiet=args.json) as line:
        line.update(0.0, f"checking {motion.name}")
        show = _Show(args.certificate, line)
        checked = show.checker.evaluate(motion)
        report, content, title = checked.report, show.content(checked), checked.plan.name
        if page := files.get("html"):
            line.update(0.0, f"writing {page.name}")
            viz.export_html(content, page, title=title)
        if (plot := files.get("plot")) and content.verdict is not None:
            viz.export_plot(content.verdict, plot, title=title)
        if video := files.get("video"):
            viz.export_animation(
                content,
                video,
                speed=1.0,
                fps=VIDEO_RATE,
                progress=lambda share: line.update(share, f"drawing {video.name}"),
            )
    if args.json:
        written = {kind: str(path) for kind, path in files.items()}
        print_json({**report.as_dict(), "files": written})
    else:
        print_verdict(report)
        for path in files.values():
            print(f"wrote {shown_path(path)}: {path.stat().st_size / 1000:.0f} kB")
    return ExitCode.OK if report.ok else ExitCode.FAILED


def serve(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C; the exit code is that of what was saved last."""
    source, line = MotionSource(args.motion, args.values), ProgressLine(is_quiet=args.json)
    show = _Show(args.certificate, line)
    checked = _evaluated(source, show.checker, line)
    content = _content(source, show, checked)
    with PreviewServer(content, source.name, args.port, source.choose) as server:
        ok = checked.report.ok
        try:
            if args.json:
                print_json_line({"url": server.url, "file": str(source.path)})
            else:
                where = shown_path(source.path)
                print(f"{source.name}: {server.url}   (follows {where}; Ctrl-C ends)")
            _tell(checked.report, as_json=args.json)
            if not args.no_open and display_problem() is None:
                webbrowser.open(server.url)
            while True:
                time.sleep(POLL_PERIOD)
                if source.has_changed():
                    ok = _show_again(source, show, server, line, as_json=args.json)
        except KeyboardInterrupt:
            return ExitCode.OK if ok else ExitCode.FAILED


def _evaluated(
    source: MotionSource, checker: FeasibilityChecker, line: ProgressLine
) -> CheckedMotion:
    """The motion as its file says now; ``line`` is away afterwards."""
    with line:
        line.update(0.0, f"checking {source.name}")
        return checker.evaluate(source.motion())


def _show_again(
    source: MotionSource,
    show: _Show,
    server: PreviewServer,
    line: ProgressLine,
    *,
    as_json: bool,
) -> bool:
    """Check and show what the file says now; whether the robot can do it."""
    try:
        checked = _evaluated(source, show.checker, line)
        server.publish(_content(source, show, checked))
    except (Go2WbcError, OSError) as error:
        server.publish_error(str(error))
        if as_json:
            print_json_line({"error": str(error)})
        else:
            print(f"go2-wbc: {error}", file=sys.stderr, flush=True)
        return False
    _tell(checked.report, as_json=as_json)
    return checked.report.ok


def _content(source: MotionSource, show: _Show, checked: CheckedMotion) -> ReplayContent:
    sliders = tuple(slider(*item) for item in source.parameters.items())
    return replace(show.content(checked), sliders=sliders)


def _tell(report: FeasibilityReport, *, as_json: bool) -> None:
    if as_json:
        print_json_line(report.as_dict())
    else:
        print_verdict(report)
