"""A progress line: in place on a terminal, one line per finished piece of work elsewhere."""

from __future__ import annotations

import shutil
import sys

BAR_WIDTH = 20
_CLEAR = "\r\x1b[2K"


class ProgressLine:
    """Tells a person how far long work has come, on standard error: results can be piped.

    On a terminal one line is rewritten; the cursor is left at its start, so that a log message
    takes its place. Elsewhere (a file, a pipe, CI) only finished pieces are printed.
    """

    def __init__(self) -> None:
        self._is_live = sys.stderr.isatty()

    def update(self, share: float, text: str) -> None:
        """Show that ``share`` (0 to 1) is finished and ``text`` is going on."""
        if self._is_live:
            shown = f"{progress_bar(share)} {text}"[: shutil.get_terminal_size().columns - 1]
            print(f"{_CLEAR}{shown}\r", end="", file=sys.stderr, flush=True)

    def done(self, text: str) -> None:
        """Say that a piece of work is finished; on a terminal the next update replaces it."""
        if not self._is_live:
            print(text, file=sys.stderr, flush=True)

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_live:
            print(_CLEAR, end="", file=sys.stderr, flush=True)


def progress_bar(share: float) -> str:
    """``[########............]`` for a share of 0 to 1."""
    filled = round(BAR_WIDTH * min(max(share, 0.0), 1.0))
    return f"[{'#' * filled}{'.' * (BAR_WIDTH - filled)}]"
