"""A file is written only as it is known, and everything can be undone."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.studio.project import Project
from go2_wbc.errors import StudioError


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "greet.py"
    path.write_bytes(b"one\r\n")
    return path


def test_undo_and_redo_give_back_the_bytes(file: Path) -> None:
    project = Project(file)
    assert not project.can_undo
    for text in (b"two", b"three"):
        project.save(text)
        assert file.read_bytes() == text
    project.undo()
    project.undo()
    assert (file.read_bytes(), project.can_undo, project.can_redo) == (b"one\r\n", False, True)
    project.redo()
    project.redo()
    assert (file.read_bytes(), project.can_redo) == (b"three", False)
    with pytest.raises(StudioError, match="nothing to redo"):
        project.redo()


def test_what_somebody_else_saved_is_never_written_over(file: Path) -> None:
    project = Project(file)
    project.save(b"two")
    file.write_bytes(b"theirs")
    for act in (lambda: project.save(b"three"), project.undo):
        with pytest.raises(StudioError, match="saved elsewhere"):
            act()
        assert file.read_bytes() == b"theirs"
    assert project.refresh()
    assert not project.refresh()
    project.undo()
    assert file.read_bytes() == b"two", "their text counts as an edit"
    project.redo()
    assert file.read_bytes() == b"theirs"


def test_a_save_that_is_under_way_is_waited_for(file: Path) -> None:
    project = Project(file)
    for text in (b"", b"the", b"theirs"):
        file.write_bytes(text)
        assert not project.refresh(must_rest=True)
    assert project.refresh(must_rest=True)
    project.undo()
    assert (file.read_bytes(), project.can_undo) == (b"one\r\n", False)


def test_a_file_that_cannot_be_written_stays(file: Path) -> None:
    project = Project(file)
    file.chmod(0o444)
    with pytest.raises(StudioError, match="read-only"):
        project.save(b"two")
    assert (file.read_bytes(), project.saved, project.can_undo) == (b"one\r\n", b"one\r\n", False)
    file.chmod(0o644)
    file.unlink()
    with pytest.raises(StudioError, match="cannot read"):
        project.save(b"two")
    with pytest.raises(StudioError, match="cannot read"):
        Project(file)


def test_a_link_stays_one_and_rights_stay(file: Path) -> None:
    file.chmod(0o755)
    link = file.with_name("link.py")
    link.symlink_to(file)
    Project(link).save(b"two")
    assert link.is_symlink()
    assert (file.read_bytes(), file.stat().st_mode & 0o777) == (b"two", 0o755)
    assert [path.name for path in file.parent.iterdir() if path.name.startswith(".")] == []


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from(["a", "b", "c", "undo", "redo", "theirs"]), max_size=20))
def test_any_sequence_can_be_undone_to_the_start(
    tmp_path_factory: pytest.TempPathFactory, acts: list[str]
) -> None:
    file = tmp_path_factory.mktemp("project") / "file.py"
    file.write_bytes(b"start")
    project = Project(file)
    for number, act in enumerate(acts):
        if act == "theirs":
            file.write_bytes(f"theirs {number}".encode())
            project.refresh()
        elif act not in ("undo", "redo"):
            project.save(f"{act} {number}".encode())
        elif getattr(project, f"can_{act}"):
            getattr(project, act)()
        assert file.read_bytes() == project.saved
    while project.can_undo:
        project.undo()
    assert file.read_bytes() == b"start"
