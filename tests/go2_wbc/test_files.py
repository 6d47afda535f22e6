"""Output files: refused early and clearly, and never half written."""

import os
from pathlib import Path

import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically


def test_a_file_is_replaced_whole_in_folders_that_are_made_and_none_is_a_folder(
    tmp_path: Path,
) -> None:
    (tmp_path / "demo.html").mkdir()
    with pytest.raises(ConfigError, match="a folder has this name"):
        checked_output(tmp_path / "demo.html", (".html",))
    target = checked_output(tmp_path / "a" / "b" / "demo.HTML", (".html",))
    assert target.parent.is_dir()
    assert list(target.parent.iterdir()) == []
    target.write_text("old and much longer than the new one")
    assert write_atomically(target, b"new") == target
    assert target.read_bytes() == b"new"
    assert list(target.parent.iterdir()) == [target]
    with pytest.raises(ConfigError, match=r"demo\.html: File exists; choose a folder"):
        checked_output(target / "demo.html", (".html",))


def test_a_name_may_be_as_long_as_a_file_system_permits(tmp_path: Path) -> None:
    target = tmp_path / (250 * "n" + ".html")
    assert write_atomically(target, b"new").read_bytes() == b"new"
    with pytest.raises(ConfigError, match=r"cannot write .*: No such file or directory"):
        write_atomically(tmp_path / "none" / "demo.html", b"new")


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "demo.html"
    target.write_text("old")

    def refuse(_self: Path, _target: Path) -> Path:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(ConfigError, match="No space left"):
        write_atomically(target, b"new")
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]
