"""One motion that is meant on the command line, and the file that it is written in."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from controller.cli.motion_args import the_motion

if TYPE_CHECKING:
    from motions import Timeline


class MotionSource:
    """Makes a motion's timeline anew whenever its file was saved.

    Attributes:
        path: the file.
        name: of the motion.
    """

    def __init__(self, word: str, settings: list[str]) -> None:
        """Find the motion.

        Args:
            word: a name of the library, ``FILE.py`` or ``FILE.py:NAME``.
            settings: parameters as ``NAME=VALUE``.

        Raises:
            CommandError: for an unknown name, or a file with several motions.
            TimelineError: for a file that cannot be used.
        """
        from motions import find_motion

        own, _, _ = word.partition(":")
        self._settings = settings
        if own.endswith(".py"):
            self.path, self._word = Path(own), word
        else:
            self.path = Path(find_motion(word).source.rpartition(":")[0])
            self._word = f"{self.path}:{word}"
        self._seen = self._last = self._signature()
        self.name = self.timeline().name

    def timeline(self) -> Timeline:
        """The motion as its file says now.

        Raises:
            CommandError: if the file has no such motion, or several and none was chosen.
            TimelineError: for a file that cannot be used or a parameter that is not valid.
        """
        return the_motion(self._word, self._settings)

    def has_changed(self) -> bool:
        """Whether the file was saved, and has rested since the call before.

        A save takes a moment, in which the file may be empty, cut short or away.
        """
        now = self._signature()
        has_rested, self._last = now == self._last, now
        if now is None or now == self._seen or not has_rested:
            return False
        self._seen = now
        return True

    def _signature(self) -> tuple[int, int, int] | None:
        try:
            status = self.path.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size, status.st_ino
