"""The file of borders: the amplitudes at which physics changes its mind."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from go2_wbc.errors import ConfigError
from go2_wbc.files import write_atomically

BORDERS_FILE = Path(__file__).parent / "borders.json"


def read_borders(path: Path = BORDERS_FILE) -> dict[str, float | None]:
    """The amplitudes at which physics changes its mind, by draw.

    Raises:
        ConfigError: if the file is missing or damaged.
    """
    try:
        kept = dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigError(
            f"{path}: cannot be read: {error}; make it anew with --borders"
        ) from error
    return {name: None if flip is None else float(flip) for name, flip in kept.items()}


def borders_version(path: Path = BORDERS_FILE) -> str:
    """A short hash of the file of borders: with others, the exam asks other questions."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:8] if path.exists() else "none"


def write_borders(borders: Mapping[str, float | None], path: Path = BORDERS_FILE) -> None:
    """Keep borders, one a line."""
    rows = {name: value and round(value, 4) for name, value in borders.items()}
    lines = (f"{json.dumps(name)}: {json.dumps(value)}" for name, value in rows.items())
    write_atomically(path, ("{\n" + ",\n".join(lines) + "\n}\n").encode())
