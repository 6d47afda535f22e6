"""Runs ``go2-wbc preview`` or ``studio`` as a user does, and reads what it says."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import Any, final

ROOT = Path(__file__).resolve().parent.parent

GOOD = '''"""A motion of one's own."""

from motions import Timeline, motion


@motion
def rise() -> Timeline:
    """Rise."""
    return Timeline().body(z=0.01, over=0.8).hold(0.4).home(over=0.8)
'''
TOO_HIGH = GOOD.replace("z=0.01", "z=0.18")
BROKEN = GOOD.replace("z=0.01,", "z=0.01")
_PATIENCE = 60.0  #: How long [s] the program may take to end


def _hear_ctrl_c() -> None:
    """A process that was started in the background ignores the signal, and so would its own."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@final
class LivePreview:
    """A context manager; ``heard`` gives the next JSON line that the program prints.

    Attributes:
        url: of the page.
        process_id: of the program.
    """

    def __init__(self, *arguments: str, command: str = "preview", folder: Path = ROOT) -> None:
        program = [sys.executable, "-m", "controller.cli.main", command, *arguments]
        self._process = subprocess.Popen(
            [*program, "--json", "--no-open", "--port", "0"],
            cwd=folder,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            preexec_fn=_hear_ctrl_c,
        )
        self.process_id = self._process.pid
        self.url: str = self.heard()["url"]

    def heard(self) -> dict[str, Any]:
        """The next line; fails if the program has ended."""
        stream = self._process.stdout
        line = "" if stream is None else stream.readline()
        if not line:
            raise AssertionError(f"the program ended with code {self._process.wait(_PATIENCE)}")
        return json.loads(line)

    def interrupt(self) -> int:
        """Ctrl-C; returns the exit code."""
        self._process.send_signal(signal.SIGINT)
        return self._process.wait(_PATIENCE)

    def __enter__(self) -> LivePreview:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait(_PATIENCE)
        if self._process.stdout is not None:
            self._process.stdout.close()
