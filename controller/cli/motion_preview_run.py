"""What ``go2-wbc preview`` does; imports the robot."""

from __future__ import annotations

import argparse
import sys
import time
import webbrowser
from dataclasses import replace

import viz
from controller.cli.common import ExitCode, print_json, print_json_line, shown_path
from controller.cli.motion_args import MotionSource, print_verdict, the_motion
from controller.cli.progress import ProgressLine
from controller.report_view import planned, slider
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
        checked = FeasibilityChecker(progress=line.solving).evaluate(motion)
        report, content, title = checked.report, planned(checked), checked.plan.name
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
    checker = FeasibilityChecker(progress=line.solving)
    checked = _evaluated(source, checker, line)
    content = _content(source, checked)
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
                    ok = _show_again(source, checker, server, line, as_json=args.json)
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
    checker: FeasibilityChecker,
    server: PreviewServer,
    line: ProgressLine,
    *,
    as_json: bool,
) -> bool:
    """Check and show what the file says now; whether the robot can do it."""
    try:
        checked = _evaluated(source, checker, line)
        server.publish(_content(source, checked))
    except (Go2WbcError, OSError) as error:
        server.publish_error(str(error))
        if as_json:
            print_json_line({"error": str(error)})
        else:
            print(f"go2-wbc: {error}", file=sys.stderr, flush=True)
        return False
    _tell(checked.report, as_json=as_json)
    return checked.report.ok


def _content(source: MotionSource, checked: CheckedMotion) -> ReplayContent:
    sliders = tuple(slider(*item) for item in source.parameters.items())
    return replace(planned(checked), sliders=sliders)


def _tell(report: FeasibilityReport, *, as_json: bool) -> None:
    if as_json:
        print_json_line(report.as_dict())
    else:
        print_verdict(report)
