"""What a file says, what it said before, and whether somebody else has written it meanwhile."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import final

from go2_wbc.errors import ConfigError, StudioError
from go2_wbc.files import write_atomically

LONGEST_FILE = 2**20  #: bytes; a file that is longer is no motion
MOST_UNDONE = 1000  #: how many texts are kept


@final
class Project:
    """One file, which is written only if it still says what is known.

    Attributes:
        path: of the file, links followed: what it points to is written.
        saved: the bytes that it holds, as far as is known.
    """

    def __init__(self, path: Path) -> None:
        """Read it; raises StudioError if that cannot be."""
        self.path = path.resolve()
        self.saved = self._read()
        self._glimpse = self.saved
        self._before: list[bytes] = []
        self._after: list[bytes] = []

    @property
    def base(self) -> str:
        """A name for what the file says, which no other text has."""
        return hashlib.sha256(self.saved).hexdigest()

    @property
    def can_undo(self) -> bool:
        """Whether there is a text before this one."""
        return bool(self._before)

    @property
    def can_redo(self) -> bool:
        """Whether a text was undone."""
        return bool(self._after)

    def refresh(self, *, must_rest: bool = False) -> bool:
        """Take what somebody else has saved; whether somebody has. Their text can be undone, too.

        With ``must_rest`` only once it has stayed the same from one call to the next: a save takes
        a moment, in which a file may be empty, cut short or away.

        Raises:
            StudioError: if the file cannot be read.
        """
        now = self._read()
        has_rested, self._glimpse = now == self._glimpse, now
        if now == self.saved or (must_rest and not has_rested):
            return False
        self._keep(now)
        return True

    def save(self, data: bytes) -> None:
        """Write ``data``.

        Raises:
            StudioError: if somebody else has saved meanwhile, or the file cannot be written; it is
                then as it was.
        """
        if data == self.saved:
            return
        self._write(data)
        self._keep(data)

    def undo(self) -> None:
        """Write the text before this one; raises as ``save``, and if there is none."""
        self._step_back(self._before, self._after, "undo")

    def redo(self) -> None:
        """Write the text that was undone last; raises as ``save``, and if there is none."""
        self._step_back(self._after, self._before, "redo")

    def _step_back(self, source: list[bytes], kept: list[bytes], what: str) -> None:
        if not source:
            raise StudioError(f"there is nothing to {what}")
        self._write(source[-1])
        kept.append(self.saved)
        self.saved = source.pop()

    def _keep(self, data: bytes) -> None:
        self._before = [*self._before, self.saved][-MOST_UNDONE:]
        self._after.clear()
        self.saved = data

    def _write(self, data: bytes) -> None:
        if self._read() != self.saved:
            raise StudioError(f"{self.path.name} was saved elsewhere meanwhile: nothing is changed")
        try:
            mode = self.path.stat().st_mode
            if not mode & 0o200:
                raise StudioError(f"{self.path.name} is read-only: nothing is changed")
            write_atomically(self.path, data)
            self.path.chmod(mode)
        except (ConfigError, OSError) as error:
            raise StudioError(str(error)) from error

    def _read(self) -> bytes:
        try:
            if self.path.stat().st_size > LONGEST_FILE:
                raise StudioError(f"{self.path.name} is longer than {LONGEST_FILE} bytes")
            return self.path.read_bytes()
        except OSError as error:
            raise StudioError(f"cannot read {self.path.name}: {error.strerror}") from error
