"""What a studio writes beside the file: as the command line does, and a test that can fail."""

import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from controller.bridges.ros2.behaviors import SavedMotions
from controller.bridges.unitree import drive, plant
from controller.cli import bridges
from controller.cli.main import main
from controller.studio.exports import EXPORTS
from controller.studio.session import Studio
from go2_wbc.errors import install_line
from motions import FeasibilityChecker, load_motion, load_plan
from tests.script_server import pytest_with

MOVES = '''"""One that the robot can do, and one that it cannot."""

from motions import Timeline, deg, motion


@motion
def nod() -> Timeline:
    """Nod."""
    return Timeline().body(pitch=deg(8.0), over=0.3).home(over=0.3)


@motion
def lean() -> Timeline:
    """Lean too far."""
    return Timeline().body(y=0.2, over=0.5).home(over=0.5)
'''
FILE = "my moves.py", MOVES


@pytest.fixture(scope="module")
def studio(file: Path) -> Iterator[Studio]:
    with Studio(file, "nod", 0) as opened:
        yield opened


@pytest.mark.parametrize("kind", ["csv", "npz", "json", "plan"])
def test_it_is_written_as_the_command_line_writes_it_and_over_one_only_again(
    studio: Studio, file: Path, tmp_path: Path, kind: str
) -> None:
    path, by_command = file.with_name(f"nod.{kind}"), tmp_path / f"nod.{kind}"
    answer = studio.export({"kind": kind})
    assert (answer["told"], answer["file"]) == (f"wrote {path.name}", path.name)
    assert answer["folder"] == str(file.parent.resolve())
    assert main(["export", f"{file}:nod", "--out", str(by_command)]) == 0
    assert path.read_bytes() == by_command.read_bytes()
    path.write_text("mine", encoding="utf-8")
    assert studio.export({"kind": kind}) == {"exists": path.name}
    assert path.read_text(encoding="utf-8") == "mine"
    assert studio.export({"kind": kind, "again": True}) == answer
    assert path.read_bytes() == by_command.read_bytes()
    assert studio._server.files[path.name] == path


def test_a_saved_motion_and_a_plan_are_played_by_the_command_that_is_told(
    studio: Studio, file: Path
) -> None:
    checker = FeasibilityChecker()
    for kind, load in (("json", load_motion), ("plan", load_plan)):
        answer = studio.export({"kind": kind, "again": True})
        assert answer["then"] == f"go2-wbc run nod.{kind}"
        plan = checker.plan(load(file.with_name(f"nod.{kind}")))
        assert (plan.name, plan.duration) == ("nod", pytest.approx(0.6, abs=0.3))


def test_what_is_told_of_a_plan_for_a_bridge_is_a_command_that_takes_it(
    studio: Studio, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen, check = list[object](), drive.check_steps
    robot = SimpleNamespace(close=lambda: None)
    monkeypatch.setattr(plant, "UnitreePlant", lambda *given, **_: seen.append(given) or robot)
    monkeypatch.setattr(drive, "check_steps", lambda names: seen.append(names) or check(names))
    monkeypatch.setattr(drive, "drive", lambda *_: iter(()))
    monkeypatch.setattr(bridges, "_until_signal", lambda: None)
    server = SimpleNamespace(  # without ROS
        ServerSettings=lambda *given: given, serve=lambda given, *_: seen.append(given[-1])
    )
    monkeypatch.setitem(sys.modules, "controller.bridges.ros2.server", server)
    monkeypatch.chdir(file.parent)
    for kind, part in (("ros2", "plays by its name"), ("unitree", "the domain 0")):
        answer = studio.export({"kind": kind})
        assert answer["file"] == f"nod.{kind}.plan", "each kind has a name of its own"
        assert part in str(answer["told"])
        program, *arguments = shlex.split(str(answer["then"]))
        assert program == "go2-wbc"
        assert main(arguments) == 0
    saved, *driven = seen
    assert isinstance(saved, SavedMotions)
    assert load_plan(saved.file("nod.ros2.plan")).name == "nod"
    assert driven == [["stand", "nod.unitree.plan", "lie_down"], ("lo", 1)]


def test_a_film_without_its_extra_is_told_of_before_the_work(
    studio: Studio, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.delitem(sys.modules, "viz.render.mp4_file", raising=False)
    answer = studio.export({"kind": "mp4"})
    assert install_line("video") in str(answer["error"])
    assert not [one for one in file.parent.iterdir() if "mp4" in one.name]


@pytest.mark.parametrize("kind", ["webp", "mp4"])
def test_a_film_is_written_and_over_one_only_again(studio: Studio, file: Path, kind: str) -> None:
    if kind == "mp4":
        pytest.importorskip("av", reason='needs pip install "go2-wbc[video]"')
    path = file.with_name(f"nod.{kind}")
    assert studio.export({"kind": kind})["file"] == path.name
    written = path.read_bytes()
    assert {"webp": b"WEBP", "mp4": b"ftyp"}[kind] in written[:12]
    path.write_bytes(b"mine")
    assert studio.export({"kind": kind}) == {"exists": path.name}
    assert path.read_bytes() == b"mine"


def test_a_written_test_passes_of_what_the_robot_can_do_fails_of_what_it_cannot_and_is_kept(
    studio: Studio, file: Path
) -> None:
    answer = studio.export({"kind": "test"})
    path = file.with_name("test_nod.py")
    told = {"told": "wrote test_nod.py", "file": path.name, "then": "pytest test_nod.py"}
    told["folder"] = str(path.parent.resolve())
    assert answer == told
    own = path.read_text(encoding="utf-8") + "\n# mine\n"
    path.write_text(own, encoding="utf-8")
    for again in (False, True):
        answer = studio.export({"kind": "test", "again": again})
        assert answer == {**told, "told": "test_nod.py is there already, and stays"}
        assert path.read_text(encoding="utf-8") == own
    assert studio.choose({"motion": "lean"}) == {}
    assert studio.export({"kind": "test"})["file"] == "test_lean.py"
    done = pytest_with("motions.pytest_plugin", file.parent, path.name, "test_lean.py")
    assert done.returncode == 1, done.stdout
    assert "1 failed, 1 passed" in done.stdout
    assert "the robot cannot do 'lean'" in done.stdout
    assert studio.choose({"motion": "nod"}) == {}


def test_only_kinds_of_the_list_are_written(studio: Studio, file: Path) -> None:
    before = sorted(file.parent.iterdir())
    for kind in ("../../evil", "py", "", None, 3):
        assert all(known in str(studio.export({"kind": kind})["error"]) for known in EXPORTS)
    assert sorted(file.parent.iterdir()) == before
