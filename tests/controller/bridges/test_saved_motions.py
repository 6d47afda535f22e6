"""Motions of one's own over a bridge: of one folder, by their names, checked. No ROS, no DDS."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from controller.bridges.ros2.behaviors import SavedMotions, motion_job
from controller.bridges.unitree import drive
from controller.go2_controller import GO2Controller
from controller.jobs import JobServer
from controller.modes import Mode, Outcome
from go2_wbc.errors import CommandError, MotionFileError, MotionInfeasible
from motions import FeasibilityChecker, Timeline, save_motion, save_plan

SAVED = ("broken.plan", "dip.json", "dip.plan", "high.json")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One motion that can be done as both, one that cannot; and what is not to be reached."""
    home = tmp_path_factory.mktemp("home")
    own, dip = home / "own", Timeline(name="dip").body(z=-0.03, over=0.8).home(over=0.8)
    (own / "below").mkdir(parents=True)
    save_motion(dip, own / "dip.json")
    for place in (own, own / "below", home):
        save_plan(FeasibilityChecker().plan(dip), place / "dip.plan")
    (home / "dip.plan").rename(home / "other.plan")
    (own / "link.plan").symlink_to(home / "other.plan")
    (own / "folder.plan").mkdir()
    save_motion(Timeline(name="high").body(z=0.3, over=0.8).home(over=0.8), own / "high.json")
    (own / "broken.plan").write_bytes(b"\x80")
    (own / "dip.py").write_text("raise SystemExit", encoding="utf-8")
    return own


def _played(go2: GO2Controller, name: str, folder: Path, settings: Sequence[str] = ()) -> Outcome:
    jobs, answers, answered = JobServer(go2), list[Outcome](), threading.Event()
    assert jobs.submit(motion_job(name, settings, go2, answers.append, SavedMotions(folder)))
    while not jobs.work():
        answered.wait(0.01)
    return answers[0]


def test_files_of_the_folder_are_known_by_their_names_alone(folder: Path) -> None:
    saved = SavedMotions(folder)
    assert saved.names == SAVED
    assert [saved.file(name) for name in SAVED] == [folder / name for name in SAVED]


@pytest.mark.parametrize(
    "name",
    [
        *("../other.plan", "below/dip.plan", "link.plan", "folder.plan", "./dip.plan", "DIP.plan"),
        *("", ".plan", "dip.py", "dip", "x" * 10_000 + ".plan", "dip.plan\0", "{own}/dip.plan"),
    ],
)
def test_nothing_else_of_the_machine_can_be_named(folder: Path, name: str) -> None:
    with pytest.raises(CommandError, match=r"unknown saved motion.*valid: broken\.plan") as told:
        SavedMotions(folder).file(name.format(own=folder))
    assert len(str(told.value)) < 400


def test_without_a_folder_there_are_none_and_a_file_is_no_folder(folder: Path) -> None:
    assert SavedMotions().names == ()
    with pytest.raises(CommandError, match="--motions FOLDER"):
        SavedMotions().file("dip.plan")
    with pytest.raises(CommandError, match="is no folder"):
        SavedMotions(folder / "dip.plan")


@pytest.mark.parametrize("name", ["dip.json", "dip.plan"])
def test_an_own_motion_is_played_over_ros_2_from_lying(
    go2: GO2Controller, folder: Path, name: str
) -> None:
    answer = _played(go2, name, folder)
    assert answer.ok, answer.reason
    assert go2.mode is Mode.STANDING


@pytest.mark.parametrize(
    ("name", "settings", "told"),
    [
        ("high.json", [], "infeasible"),
        ("broken.plan", [], "broken.plan"),
        ("dip.py", [], "unknown motion 'dip.py'"),
        ("../other.plan", [], "unknown saved motion"),
        ("dip.plan", ["z=0.1"], "a saved motion has no parameters, got z=0.1"),
    ],
)
def test_what_cannot_be_played_is_refused_before_the_robot_moves(
    go2: GO2Controller, folder: Path, name: str, settings: list[str], told: str
) -> None:
    answer = _played(go2, name, folder, settings)
    assert not answer.ok
    assert told in answer.reason
    assert go2.mode is Mode.LYING


def test_a_drive_plays_saved_motions_as_steps(go2: GO2Controller, folder: Path) -> None:
    names = ["stand", str(folder / "dip.plan"), str(folder / "dip.json"), "lie_down"]
    drive.check_steps(names)
    done = [drive._do(go2, name, drive.Trot()) for name in names]
    assert [(step.name, step.ok, step.reason) for step in done if not step.ok] == []
    assert go2.mode is Mode.LYING


def test_a_drive_is_refused_before_it_begins(folder: Path) -> None:
    with pytest.raises(CommandError, match=r"unknown step 'fly'; valid: FILE.json, FILE.plan"):
        drive.check_steps(["stand", "fly"])
    for name in ("broken.plan", "gone.plan", "gone.json"):
        with pytest.raises(MotionFileError, match=name):
            drive.check_steps([str(folder / name)])
    with pytest.raises(MotionInfeasible):
        drive.check_steps([str(folder / "high.json")])
