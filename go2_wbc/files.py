"""Output files: checked before the work starts, written aside, then renamed into place."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from go2_wbc.errors import ConfigError


def checked_output(path: Path | str, suffixes: Sequence[str]) -> Path:
    """The output path, made absolute, once it is known that it can be written.

    Creates the folder if it is missing, so that a long export cannot fail at its last line.

    Args:
        path: where the file shall be.
        suffixes: accepted endings in lower case, with their dot.

    Raises:
        ConfigError: for another suffix, a folder in the way, or a place without write access.
    """
    target = Path(path).expanduser().absolute()
    if target.suffix.lower() not in suffixes:
        ending = repr(target.suffix) if target.suffix else "no suffix"
        raise ConfigError(f"cannot write {target}: {ending}; valid: {', '.join(suffixes)}")
    if target.is_dir():
        raise ConfigError(f"cannot write {target}: a folder has this name; give a file path")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=target.parent):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigError(
            f"cannot write {target}: {reason}; choose a folder that you may write to"
        ) from error
    return target


def write_atomically(target: Path, content: bytes) -> Path:
    """Write a file aside and rename it, so that nobody ever sees half of it.

    Raises:
        ConfigError: if the disk refuses; an older file of this name is then untouched.
    """
    aside = None
    try:
        handle, aside = tempfile.mkstemp(prefix=".aside.", dir=target.parent)
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        Path(aside).chmod(0o644)
        Path(aside).replace(target)
    except OSError as error:
        raise ConfigError(f"cannot write {target}: {error.strerror or error}") from error
    finally:
        if aside is not None:
            Path(aside).unlink(missing_ok=True)
    return target
