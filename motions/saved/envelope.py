"""What every file of ours begins with: which format, which version of it, and who wrote it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import go2_wbc
from go2_wbc.errors import MotionFileError

LARGEST_FILE = 100_000_000
"""A larger file [bytes] is taken for a mistake: own choice. A plan has 0.05 MB a second."""


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file.

    Attributes:
        name: what such a file says of itself.
        version: that is written; older ones are read, too.
        what: for a person.
        suffix: ending of its files.
    """

    name: str
    version: int
    what: str
    suffix: str

    def header(self) -> dict[str, Any]:
        """What a file of this kind begins with."""
        return {"format": self.name, "version": self.version, "go2_wbc": go2_wbc.__version__}

    def without_header(self, fields: object, path: Path) -> dict[str, Any]:
        """``fields`` of a file of this kind, without its header.

        Raises:
            MotionFileError: if it is of another kind, or a newer version of it.
        """
        if not isinstance(fields, Mapping) or fields.get("format") != self.name:
            named = fields.get("format") if isinstance(fields, Mapping) else None
            raise MotionFileError(
                f'{path} is not {self.what}: it must say "format": "{self.name}"'
                + (f", not {named!r:.60}" if named else "")
            )
        version = fields.get("version")
        if type(version) is not int or version < 1:
            raise MotionFileError(f"{path}: version must be a whole number, got {version!r:.60}")
        if version > self.version:
            writer = fields.get("go2_wbc", "another go2_wbc")
            raise MotionFileError(
                f"{path} has version {version} of {self.name}, written by go2_wbc {writer!s:.20}; "
                f"this is go2_wbc {go2_wbc.__version__}, which reads up to version {self.version}: "
                "install a newer one"
            )
        return {name: fields[name] for name in fields if name not in self.header()}


def content_of(path: Path | str) -> bytes:
    """What is in a file.

    Raises:
        MotionFileError: if there is none, or it cannot be read.
    """
    file = Path(path)
    if not file.is_file():
        raise MotionFileError(f"there is no file {file}" if not file.is_dir() else _folder(file))
    try:
        if file.stat().st_size > LARGEST_FILE:
            raise MotionFileError(f"{file} is larger than {LARGEST_FILE / 1e6:g} MB: no motion is")
        return file.read_bytes()
    except OSError as error:
        raise MotionFileError(f"cannot read {file}: {error.strerror or error}") from error


def fields_of(text: bytes, path: Path | str) -> object:
    """What JSON says.

    Raises:
        MotionFileError: if it is none, or has a number that is not finite.
    """
    try:
        return json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:  # UnicodeDecodeError is a ValueError, too
        reason = str(error) or type(error).__name__
        raise MotionFileError(f"{path} is damaged or cut short: {reason:.120}") from error


def _refuse(word: str) -> float:
    raise ValueError(f"{word} is no finite number")


def _folder(path: Path) -> str:
    return f"{path} is a folder, not a file"
