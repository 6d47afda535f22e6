"""Saved motions that a bridge plays: files of numbers, never code.

Clients ask for them by file name in one folder, which is given when the bridge starts; no other
file of the machine can be named.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import final

from go2_wbc.errors import CommandError, unknown_name
from motions.saved.files import is_saved


@final
@dataclass(frozen=True, slots=True)
class SavedMotions:
    """Those of one folder."""

    folder: Path | None = None  #: that they lie in, not below it; None for none

    def __post_init__(self) -> None:
        """Raise CommandError for what is no folder."""
        if self.folder is not None and not self.folder.is_dir():
            raise CommandError(f"{self.folder} is no folder")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the files that are there now; links to other folders are not among them."""
        if self.folder is None:
            return ()
        home = self.folder.resolve()
        found = (file for file in home.iterdir() if is_saved(file.name) and file.is_file())
        return tuple(sorted(file.name for file in found if file.resolve().parent == home))

    def file(self, name: str) -> Path:
        """The file of this name, which ``GO2Controller.prepare`` takes.

        Raises:
            CommandError: for an unknown name; lists the valid ones.
        """
        if self.folder is None:
            raise CommandError(
                "no folder of saved motions was named at the start: --motions FOLDER"
            )
        if name not in (names := self.names):
            raise CommandError(unknown_name("saved motion", f"{name:.80}", names))
        return self.folder / name
