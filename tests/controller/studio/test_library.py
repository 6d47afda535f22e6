"""A motion of the library is played behind a call, as an author would write it."""

import base64
import io
from pathlib import Path

import pytest
from PIL import Image

from controller.studio.edits import edited
from controller.studio.library import COLUMNS, PICTURE_SIZE, library
from controller.studio.source import Source
from go2_wbc.errors import StudioError
from motions import find_motion, motion_names
from motions.registry import load_text

HEAD = "from motions import {}\n\n\n@motion\ndef mine() -> Timeline:\n    "


def _used(text: str, site: list[int] | None, name: str) -> Source:
    return edited(Source(text.encode()), {"op": "library", "site": site, "name": name}, "mine")


@pytest.mark.parametrize(
    ("names", "after"),
    [
        ("Timeline, motion", "Timeline, motion, find_motion"),
        ("*", "*"),
        ("(\n    Timeline,\n    motion\n)", "(\n    Timeline,\n    motion, find_motion\n)"),
        ("Timeline, find_motion, motion", "Timeline, find_motion, motion"),
    ],
)
def test_it_is_imported_where_it_is_not_known(names: str, after: str) -> None:
    text = HEAD.format(names) + "return Timeline().hold(0.5)\n"
    line = text.count("\n")
    source = _used(text, [line, 31], "nod")
    call = '.then(find_motion("nod")())'
    assert source.data.decode() == HEAD.format(after) + f"return Timeline().hold(0.5){call}\n"
    assert source.site is not None
    assert source.text(source.site) == call
    made = load_text(Path("mine.py"), source.data)["mine"]()
    assert made.end == pytest.approx(0.5 + find_motion("nod")().end)


def test_it_is_the_first_of_a_motion_that_has_none() -> None:
    source = _used(HEAD.format("Timeline, motion") + "return Timeline()\n", None, "bow")
    assert b'return Timeline().then(find_motion("bow")())\n' in source.data


def test_an_unknown_one_is_told() -> None:
    text = HEAD.format("Timeline, motion") + "return Timeline().hold(0.5)\n"
    with pytest.raises(StudioError, match="unknown motion 'nodd'"):
        _used(text, [6, 31], "nodd")


def test_each_has_its_picture_on_the_sheet() -> None:
    found = library()
    assert [one["name"] for one in found["motions"]] == list(motion_names())  # type: ignore[attr-defined]
    with Image.open(io.BytesIO(base64.b64decode(str(found["sheet"])))) as sheet:
        rows = -(-len(motion_names()) // COLUMNS)
        assert sheet.size == (COLUMNS * PICTURE_SIZE[0], rows * PICTURE_SIZE[1])
