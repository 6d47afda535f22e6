"""The motions of the library as the studio offers them: a picture of each, and how one is used."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

from controller.studio.rewriting import begun, imported
from controller.studio.source import Source
from controller.studio.syntax import Site
from go2_wbc.errors import StudioError, unknown_name
from motions import find_motion, motion_names

SHEET = Path(__file__).with_name("library.webp")
"""Pictures of all of them in rows, in the order of their names: see ``benchmarks gallery``."""
COLUMNS, PICTURE_SIZE = 8, (96, 72)  #: Of the sheet; width and height [px] of each
FINDER = "find_motion"  #: What an author finds one with


def library() -> Mapping[str, object]:
    """What there is, as for JSON."""
    return {
        "motions": [
            {"name": name, "told": find_motion(name).summary, "lasts": find_motion(name)().end}
            for name in motion_names()
        ],
        "sheet": base64.b64encode(SHEET.read_bytes()).decode("ascii"),
        "columns": COLUMNS,
        "size": PICTURE_SIZE,
    }


def used(source: Source, motion: str, site: Site | None, name: object) -> Source:
    """With a motion of the library behind a call, or as the first one where there is no ``site``.

    Raises:
        StudioError: for one that is unknown.
    """
    if not isinstance(name, str) or name not in motion_names():
        raise StudioError(unknown_name("motion", str(name), motion_names()))
    code = f'.then({FINDER}("{name}")())'
    after = begun(source, motion, code) if site is None else source.insert(site, code)
    return imported(after, {FINDER: "motions"})
