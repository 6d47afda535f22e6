"""A progress line: in place on a terminal, one line per finished piece of work elsewhere."""

from __future__ import annotations

import logging
import shutil
import sys

BAR_WIDTH = 20
TELL_EVERY = 5
"""Iterations of a solver from one look at the line to the next: some ten times a second."""
TRIES = "motions"
"""Whose log lines of the level INFO say what is tried; they are shown as progress."""
FIRST_ANSWER = "no plan yet"
"""How the line of a search begins that stays on a terminal: what binds so far."""
_LOG = logging.getLogger(TRIES)
_CLEAR = "\r\x1b[2K"


class ProgressLine:
    """Tells a person how far long work has come, on standard error: results can be piped.

    On a terminal one line is rewritten; the cursor is left at its start, so that a log message
    takes its place. Elsewhere (a file, a pipe, CI) only finished pieces are printed.
    """

    def __init__(self, *, is_quiet: bool = False) -> None:
        """With ``is_quiet`` nothing is told, as beside output for a program."""
        self._is_live = sys.stderr.isatty() and not is_quiet
        self._is_quiet = is_quiet
        self._share, self._text = 0.0, ""
        self._told = logging.Handler()
        self._told.emit = self._tell

    def update(self, share: float, text: str) -> None:
        """Show that ``share`` (0 to 1) is finished and ``text`` is going on."""
        self._share, self._text = share, text
        self._show(text)

    def solving(self, iterations: int, cost: float) -> None:
        """Show how far the solver is on which what is going on waits.

        Plans that were solved before do not call it.

        Args:
            iterations: of the solver, so far.
            cost: of its best plan.
        """
        if iterations % TELL_EVERY == 1:
            self._show(f"{self._text}: solving, iteration {iterations}, cost {cost:.3g}")

    def _tell(self, record: logging.LogRecord) -> None:
        """Show what a search tries or has found out."""
        if record.levelno == logging.INFO:
            told = f"{self._text}: {record.getMessage()}"
            self.done(told)
            if self._is_live and record.msg.startswith(FIRST_ANSWER):
                print(f"{_CLEAR}{told}", file=sys.stderr, flush=True)
            self._show(told)

    def _show(self, text: str) -> None:
        if self._is_live:
            shown = f"{progress_bar(self._share)} {text}"[: shutil.get_terminal_size().columns - 1]
            print(f"{_CLEAR}{shown}\r", end="", file=sys.stderr, flush=True)

    def done(self, text: str) -> None:
        """Say that a piece of work is finished; on a terminal the next update replaces it."""
        if not (self._is_live or self._is_quiet):
            print(text, file=sys.stderr, flush=True)

    def __enter__(self) -> ProgressLine:
        if not _LOG.isEnabledFor(logging.INFO):  # else it is shown already
            _LOG.addHandler(self._told)
            _LOG.setLevel(logging.INFO)
        return self

    def __exit__(self, *_: object) -> None:
        if self._told in _LOG.handlers:
            _LOG.removeHandler(self._told)
            _LOG.setLevel(logging.NOTSET)
        if self._is_live:
            print(_CLEAR, end="", file=sys.stderr, flush=True)


def progress_bar(share: float) -> str:
    """``[########............]`` for a share of 0 to 1."""
    filled = round(BAR_WIDTH * min(max(share, 0.0), 1.0))
    return f"[{'#' * filled}{'.' * (BAR_WIDTH - filled)}]"
