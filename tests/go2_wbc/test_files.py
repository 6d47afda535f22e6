"""Output files: refused early and clearly, and never half written."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

import viz
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.recording import Recording
from tests.viz.synthetic import synthetic_recording

_EXPORTS: dict[str, Callable[[Recording, Path], Path]] = {
    ".html": lambda recording, path: viz.export_html(recording, path, title="t"),
    ".webp": lambda recording, path: viz.export_animation(recording, path),
    ".png": lambda recording, path: viz.export_filmstrip(recording, path),
}


@pytest.fixture(scope="module")
def recording() -> Recording:
    return synthetic_recording(script=(("stand", 0.4),))


@pytest.mark.parametrize("suffix", _EXPORTS)
def test_an_unknown_suffix_is_refused_with_the_valid_ones(
    suffix: str, recording: Recording, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=rf"'\.xyz'.*valid: .*\{suffix}"):
        _EXPORTS[suffix](recording, tmp_path / "demo.xyz")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", _EXPORTS)
def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    suffix: str, recording: Recording, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ConfigError, match=r"cannot write .*choose a folder"):
        _EXPORTS[suffix](recording, tmp_path / "file" / f"demo{suffix}")


def test_a_folder_with_the_name_of_the_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "demo.html").mkdir()
    with pytest.raises(ConfigError, match="a folder has this name"):
        checked_output(tmp_path / "demo.html", (".html",))


def test_missing_folders_are_made_and_the_suffix_may_be_in_capitals(tmp_path: Path) -> None:
    target = checked_output(tmp_path / "a" / "b" / "demo.HTML", (".html",))
    assert target.parent.is_dir()
    assert list(target.parent.iterdir()) == []


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


def test_a_written_file_replaces_the_old_one_whole(tmp_path: Path) -> None:
    target = tmp_path / "demo.html"
    target.write_text("old and much longer than the new one")
    assert write_atomically(target, b"new") == target
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]
