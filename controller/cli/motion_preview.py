"""``go2-wbc preview``: watch a motion while it is written, or write its page, film and plot."""

from __future__ import annotations

import sys
import time
import webbrowser
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import viz
from controller.cli.common import (
    ExitCode,
    ProgressLine,
    page_file,
    plot_file,
    print_json,
    print_json_line,
    reader,
    shown_path,
    video_file,
)
from controller.cli.motion_args import MotionSource, MotionWord, Settings, print_verdict, the_motion
from go2_wbc.errors import Go2WbcError

if TYPE_CHECKING:
    from motions import CheckedMotion, CompiledPlan, FeasibilityReport, Timeline
    from viz.content import ReplayContent
    from viz.replay.preview_server import PreviewServer

POLL_PERIOD = 0.05  #: Time [s] between two looks at the file
VIDEO_RATE = 12.5  #: Pictures per second: 80 ms each, which GIF can store


_port = reader(int, lambda value: 0 <= value <= 65535, "a port from 0 to 65535")


@dataclass(frozen=True, slots=True, kw_only=True)
class Files:
    """What is written; None for what is not."""

    html: Annotated[Path | None, "FILE", "one offline page; ends in .html or .htm", page_file] = (
        None
    )
    video: Annotated[Path | None, "FILE", "ends in .webp, .gif or .mp4", video_file] = None
    plot: Annotated[Path | None, "FILE", "the margins; ends in .svg, .png or .pdf", plot_file] = (
        None
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Live:
    """The page that is served."""

    port: Annotated[int, "N", "default: %(default)s; 0 takes any that is free", _port] = 7000
    no_open: Annotated[bool, "open no browser"] = False


def run(
    motion: MotionWord,
    *,
    set: Settings = (),
    certificate: Annotated[
        Path | None, "FILE", "of `go2-wbc certify`: show it, and check in its world"
    ] = None,
    files: Annotated[Files, "files, instead of the live page"],
    live: Annotated[Live, "live page"],
    json: Annotated[bool, "print JSON; of the live page, a line for every save"] = False,
) -> int:
    """Check a motion and show it in 3D. Nothing is simulated.

    Support polygon, CoM, foot paths, contact forces, what is left to every limit, and in red what
    is broken, where and when. The page is served to this machine only and follows every save of the
    motion's file; Ctrl-C ends it. With --html, --video or --plot files are written instead. Exit
    code 0 if the robot can do the motion (as last saved), 1 if it cannot.

    Examples:
        go2-wbc preview bow                       in the browser, until Ctrl-C
        go2-wbc preview my_motion.py              again after every save
        go2-wbc preview wave --set side=left --port 8080 --no-open
        go2-wbc preview high_five --html high_five.html
        go2-wbc preview dance --video dance.webp --plot margins.svg
        go2-wbc preview bow --certificate out/sweeps/bow.sqlite
    """
    show = _Show(certificate, as_json=json)
    if files == Files():
        ok = _serve(MotionSource(motion, set), show, live)
    else:
        ok = _write(the_motion(motion, set), show, files)
    return ExitCode.OK if ok else ExitCode.FAILED


class _Show:
    """Checks motions, and makes of them what is shown: with a certificate, if one is given.

    Attributes:
        as_json: whether what is told is for a program.
        line: how far the work has come.
        checker: for the world of the certificate, or the usual one.
    """

    def __init__(self, certificate: Path | None, *, as_json: bool) -> None:
        """Read the certificate; raises as ``read_certificate``."""
        from controller.sweeps.certify import read_certificate
        from controller.sweeps.motion_study import world_of
        from motions import FeasibilityChecker

        self.as_json, self.line = as_json, ProgressLine(is_quiet=as_json)
        self._certificate = None if certificate is None else read_certificate(certificate)
        held = self._certificate
        world = None if held is None else world_of(held.about["world"])
        self.checker = FeasibilityChecker(progress=self.line.solving, world=world)

    def content(self, checked: CheckedMotion) -> ReplayContent:
        """The plan with its verdict and the certificate."""
        from controller.report_view import planned
        from controller.sweeps.certify import with_certificate

        content = planned(checked)
        if self._certificate is None:
            return content
        return with_certificate(content, self._certificate, checked.plan)

    def of(self, source: MotionSource) -> tuple[ReplayContent, FeasibilityReport]:
        """The motion as its file says now, with its parameters to be set, and its report."""
        from controller.report_view import slider

        with self.line:
            self.line.update(0.0, f"checking {source.name}")
            checked = self.checker.evaluate(source.motion())
        sliders = tuple(slider(*item) for item in source.parameters.items())
        return replace(self.content(checked), sliders=sliders), checked.report

    def tell(self, report: FeasibilityReport) -> bool:
        """Print the verdict; whether the robot can do it."""
        if self.as_json:
            print_json_line(report.as_dict())
        else:
            print_verdict(report)
        return report.ok


def _write(motion: Timeline | CompiledPlan, show: _Show, files: Files) -> bool:
    """Check the motion and write what was asked for; whether the robot can do it."""
    with show.line as line:
        line.update(0.0, f"checking {motion.name}")
        checked = show.checker.evaluate(motion)
        report, content, title = checked.report, show.content(checked), checked.plan.name
        if (page := files.html) is not None:
            line.update(0.0, f"writing {page.name}")
            viz.export_html(content, page, title=title)
        if files.plot is not None and content.verdict is not None:
            viz.export_plot(content.verdict, files.plot, title=title)
        if (video := files.video) is not None:
            viz.export_animation(
                content,
                video,
                speed=1.0,
                fps=VIDEO_RATE,
                progress=lambda share: line.update(share, f"drawing {video.name}"),
            )
    written = {kind: path for kind, path in asdict(files).items() if path is not None}
    if show.as_json:
        paths = {kind: str(path) for kind, path in written.items()}
        print_json({**report.as_dict(), "files": paths})
        return report.ok
    print_verdict(report)
    for path in written.values():
        print(f"wrote {shown_path(path)}: {path.stat().st_size / 1000:.0f} kB")
    return report.ok


def _serve(source: MotionSource, show: _Show, live: Live) -> bool:
    """Serve the page until Ctrl-C; whether the robot can do what was saved last."""
    from go2_wbc.plant.mujoco.viewer import display_problem
    from viz.replay.preview_server import PreviewServer

    content, report = show.of(source)
    with PreviewServer(content, source.name, live.port, source.choose) as server:
        ok = report.ok
        try:
            if show.as_json:
                print_json_line({"url": server.url, "file": str(source.path)})
            else:
                where = shown_path(source.path)
                print(f"{source.name}: {server.url}   (follows {where}; Ctrl-C ends)")
            show.tell(report)
            if not live.no_open and display_problem() is None:
                webbrowser.open(server.url)
            while True:
                time.sleep(POLL_PERIOD)
                if source.has_changed():
                    ok = _show_again(source, show, server)
        except KeyboardInterrupt:
            return ok


def _show_again(source: MotionSource, show: _Show, server: PreviewServer) -> bool:
    """Check and show what the file says now; whether the robot can do it."""
    try:
        content, report = show.of(source)
        server.publish(content)
    except (Go2WbcError, OSError) as error:
        server.publish_error(str(error))
        if show.as_json:
            print_json_line({"error": str(error)})
        else:
            print(f"go2-wbc: {error}", file=sys.stderr, flush=True)
        return False
    return show.tell(report)
