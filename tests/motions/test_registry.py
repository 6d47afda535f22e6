"""Motions of a user's own file: found by name, and every mistake named with its file and line."""

import os
import sys
from pathlib import Path

import pytest

from go2_wbc.errors import TimelineError
from motions import load_file
from motions.authoring import Choice, Range

HEAD = "from motions import Timeline, motion\n\n\n"
NOD = """@motion
def nod() -> Timeline:
    return Timeline().body(pitch=0.1, over=1.0)
"""


def written(folder: Path, text: str, name: str = "mine.py") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_the_motions_of_a_file_come_by_name_also_after_it_was_changed(tmp_path: Path) -> None:
    found = load_file(written(tmp_path, HEAD + NOD + NOD.replace("nod", "shake")))
    assert list(found) == ["nod", "shake"]
    assert found["nod"].source.endswith("mine.py:4")
    assert found["nod"]().end == 1.0
    text = (
        HEAD
        + "from motions.library.trunk import bow\n\n\n"
        + NOD
        + "\n\nagain = nod\nother = bow\n"
    )
    assert list(load_file(written(tmp_path, text))) == ["nod"]
    file = written(tmp_path, HEAD + NOD)
    assert load_file(file)["nod"]().end == 1.0
    written(tmp_path, HEAD + NOD.replace("over=1.0", "over=2.5"))
    assert load_file(file)["nod"]().end == 2.5


def test_two_motions_of_one_name_and_what_is_no_file_are_refused(tmp_path: Path) -> None:
    file = written(tmp_path, HEAD + NOD + "\n\n" + NOD)
    with pytest.raises(TimelineError, match=r"two motions named 'nod', lines 5 and 10"):
        load_file(file)
    with pytest.raises(TimelineError, match="there is no file"):
        load_file(tmp_path / "none.py")
    with pytest.raises(TimelineError, match=r"must end in \.py"):
        load_file(written(tmp_path, "hello", "mine.txt"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "defines no motion"),
        ("def broken(:\n", "mine.py, line 1: SyntaxError"),
        (HEAD + "import no_such_module\n", "mine.py, line 4: ModuleNotFoundError"),
        (HEAD + "1 / 0\n", "mine.py, line 4: ZeroDivisionError"),
        (HEAD + "import sys; sys.exit(0)\n", "mine.py, line 4: the file ends the program"),
        (HEAD + NOD.replace("nod()", "nod(depth: float)"), "line 4: TimelineError: nod: parameter"),
    ],
)
def test_a_file_that_does_not_load_is_named_with_the_line(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(TimelineError, match=message):
        load_file(written(tmp_path, text))


def test_a_range_or_a_choice_of_nothing_is_refused() -> None:
    with pytest.raises(TimelineError, match="low must not be above high, got 5, 1"):
        Range(5, 1)
    with pytest.raises(TimelineError, match="one word at least"):
        Choice()


def test_a_motion_that_ends_the_program_is_named_with_the_line(tmp_path: Path) -> None:
    # ``go2-wbc check`` ended without a word then, and with 0, as for what can be done.
    leaving = HEAD + NOD.replace("    return", "    raise SystemExit\n    return")
    with pytest.raises(
        TimelineError, match=r"nod \(mine.py, line \d+\): the file ends the program"
    ):
        load_file(written(tmp_path, leaving))["nod"]()


def test_a_file_that_is_saved_twice_in_a_second_is_read_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    lengths = []
    for over in ("1.0", "2.0"):
        file = written(tmp_path, HEAD + NOD.replace("over=1.0", f"over={over}"))
        os.utime(file, (1_000_000_000, 1_000_000_000))
        lengths.append(load_file(file)["nod"]().end)
    assert lengths == [1.0, 2.0]
    assert not (tmp_path / "__pycache__").exists()
