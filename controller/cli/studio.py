"""``go2-wbc studio``: design a motion with the hand; its Python file is what is edited."""

from __future__ import annotations

import io
import signal
import sys
import time
import webbrowser
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated

from controller.cli.common import ExitCode, print_json_line, shown_path
from controller.cli.motion_args import motions_of
from controller.cli.motion_preview import POLL_PERIOD, Live
from controller.cli.motions import new
from go2_wbc.errors import CommandError
from go2_wbc.files import checked_output, write_atomically

WORD = "FILE.py[:NAME], begun if there is none, or a name of the library; default: %(default)s"


def run(
    motion: Annotated[
        str, "MOTION", "FILE.py[:NAME], or a name of the library to copy"
    ] = "my_motion.py",
    *,
    live: Annotated[Live, "live page"],
    json: Annotated[bool, "print JSON: the address and the file"] = False,
) -> int:
    """Design a motion in the browser: drag its calls, see at once whether the robot can do it.

    What is dragged is changed in the file, one number at a time, comments and layout kept; what is
    typed in an editor appears on the page. A file that does not exist is begun; a motion of the
    library is copied here first. Opening a file runs it: open only what you trust. The page is
    served to this machine only, at an address with a token; Ctrl-C ends it.

    Examples:
        go2-wbc studio                      begins my_motion.py
        go2-wbc studio greet.py             opens greet.py, or begins it
        go2-wbc studio dances.py:waltz
        go2-wbc studio wave                 a copy of the library's, as wave.py
    """
    from controller.studio.session import Studio
    from go2_wbc.plant.mujoco.viewer import display_problem

    path, name = _file_of(motion)
    usual = signal.signal(signal.SIGTERM, signal.default_int_handler)  # it ends its processes, too
    try:
        with Studio(path, name, live.port) as studio:
            if json:
                print_json_line({"url": studio.url, "file": str(path)})
            else:
                print(f"{studio.motion}: {studio.url}   (all is done on this page; Ctrl-C ends)")
            if not live.no_open and display_problem() is None:
                webbrowser.open(studio.url)
            studio.warm()
            told = ""
            while True:
                if not json and studio.told != told:
                    told = studio.told
                    print(told or "all jumps are solved")
                time.sleep(POLL_PERIOD)
                studio.look()
    except KeyboardInterrupt:
        return ExitCode.OK
    finally:
        signal.signal(signal.SIGTERM, usual)


def _file_of(word: str) -> tuple[Path, str | None]:
    """The file that is to be edited, made if need be, and the motion in it."""
    own, _, name = word.partition(":")
    path = Path(own)
    if own.endswith(".py"):
        if not path.exists():
            with redirect_stdout(io.StringIO()):  # what comes next is on the page
                new(path.stem, out=path.parent)
            print(f"began {shown_path(path)}", file=sys.stderr)
        return path, name or None
    (motion,) = motions_of(word)
    source = Path(motion.source.rpartition(":")[0])
    copy = Path(f"{word}.py")
    if copy.exists():
        raise CommandError(f"{copy} exists already: go2-wbc studio {copy}")
    write_atomically(checked_output(copy, [".py"]), source.read_bytes())
    print(f"copied {word} of the library to {copy}", file=sys.stderr)
    return copy, word
