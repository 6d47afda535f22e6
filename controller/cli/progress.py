"""A progress line: in place on a terminal, one line per finished piece of work elsewhere."""

from __future__ import annotations

import shutil
from types import TracebackType
from typing import Protocol, runtime_checkable

BAR_WIDTH = 20
_CLEAR = "\x1b[2K"


@runtime_checkable
class TextStream(Protocol):
    """What is needed of a text stream."""

    def write(self, text: str, /) -> int:
        """Write ``text``; returns its length."""
        ...

    def flush(self) -> None:
        """Show what was written."""
        ...

    def isatty(self) -> bool:
        """Whether a terminal shows it."""
        ...


class ProgressLine:
    """Tells a person how far long work has come.

    On a terminal one line is rewritten; the cursor is left at its start, so that a log message
    takes its place. Elsewhere (a file, a pipe, CI) only finished pieces are printed.

    Args:
        stream: where to tell it, usually standard error, so that results can be piped.
    """

    def __init__(self, stream: TextStream) -> None:
        self._stream = stream
        self._is_live = stream.isatty()

    def update(self, share: float, text: str) -> None:
        """Show that ``share`` (0 to 1) is finished and ``text`` is going on."""
        if self._is_live:
            width = shutil.get_terminal_size().columns
            self._write(f"\r{_CLEAR}{progress_bar(share)} {text}"[: width + len(_CLEAR)] + "\r")

    def done(self, text: str) -> None:
        """Say that a piece of work is finished; on a terminal the next update replaces it."""
        if not self._is_live:
            self._write(text + "\n")

    def clear(self) -> None:
        """Take the line away."""
        if self._is_live:
            self._write(f"\r{_CLEAR}")

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.clear()

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


def progress_bar(share: float) -> str:
    """``[########............]`` for a share of 0 to 1."""
    filled = round(BAR_WIDTH * min(max(share, 0.0), 1.0))
    return f"[{'#' * filled}{'.' * (BAR_WIDTH - filled)}]"
