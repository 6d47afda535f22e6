"""The commands about motions: list, check, new, export and run."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from controller.cli.common import ExitCode
from controller.cli.main import main
from go2_wbc.errors import PlantError
from go2_wbc.world import World
from motions import load_plan, motion_names
from tests.viz.page_reader import read_data

CLUMSY = '''
from motions import Timeline, motion

@motion
def fall_over() -> Timeline:
    """Fall over: lean over a foot, then take it away."""
    line = Timeline(balance=False).body(x=0.06, y=-0.05, over=0.8)
    return line.foot("FR", z=0.1, over=0.5).hold(1.0).home(over=0.5)

@motion
def second() -> Timeline:
    """Second."""
    return Timeline().body(z=-0.02, over=0.5).home(over=0.5)
'''


GHOST_DISTANCE = 0.03
"""How far [m] the trunk of a run may be from its plan: posture and timing of the tracking."""


QUICK = '''
from motions import Timeline, motion

@motion
def quick() -> Timeline:
    """Too quick."""
    line = Timeline(physics="nearest").body(y=0.06, over=0.2).body(y=-0.06, over=0.2)
    return line.home(over=0.4).hold(0.2)
'''


@pytest.fixture
def quick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A motion whose nearest is not known from before."""
    pytest.importorskip("crocoddyl", reason="needs crocoddyl: pip install go2-wbc[dynamics]")
    monkeypatch.setattr("motions.dynamics.plan_cache.plan_folder", lambda: tmp_path / "plans")
    path = tmp_path / "quick.py"
    path.write_text(QUICK, encoding="utf-8")
    return path


@pytest.fixture
def clumsy(tmp_path: Path) -> Path:
    path = tmp_path / "clumsy.py"
    path.write_text(CLUMSY, encoding="utf-8")
    return path


def test_the_list_names_every_motion_with_its_parameters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["list"]) == ExitCode.OK
    text = capsys.readouterr().out
    assert all(name in text for name in motion_names())
    assert "--set hold=2 (0.5 to 30 s)" in text
    assert max(map(len, text.splitlines())) <= 80
    assert main(["list", "--json"]) == ExitCode.OK
    listed = json.loads(capsys.readouterr().out)
    assert [item["name"] for item in listed] == list(motion_names())


def test_check_prints_a_table_for_one_motion_and_a_line_each_for_more(
    capsys: pytest.CaptureFixture[str], clumsy: Path
) -> None:
    assert main(["check", "bow"]) == ExitCode.OK
    assert "bow, 2.4 s: the robot can do it." in capsys.readouterr().out
    assert main(["check", "bow", "nod"]) == ExitCode.OK
    assert len(capsys.readouterr().out.splitlines()) == 2
    assert main(["check", f"{clumsy}:fall_over"]) == ExitCode.FAILED
    assert "x support: CoM at" in capsys.readouterr().out
    assert main(["check", str(clumsy)]) == ExitCode.FAILED
    assert "no   fall_over" in capsys.readouterr().out


def test_check_says_what_would_make_a_motion_feasible(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    hasty = tmp_path / "hasty.py"
    hasty.write_text(
        "from motions import Timeline, deg, motion\n\n\n@motion\ndef hasty() -> Timeline:\n"
        '    """Too fast."""\n    return Timeline().body(yaw=deg(25), over=0.12).home(over=0.12)\n'
    )
    assert main(["check", str(hasty), "bow", "--fix"]) == ExitCode.FAILED
    said = capsys.readouterr().out
    assert "hasty is feasible with one of these appended" in said
    assert "    .scale_time(" in said
    assert max(map(len, said.splitlines())) <= 80
    assert main(["check", str(hasty), "--fix", "--json"]) == ExitCode.FAILED
    (report,) = json.loads(capsys.readouterr().out)
    assert {one["kind"] for one in report["suggestions"]} == {"tempo", "amplitude"}


def test_a_world_is_asked_for_by_its_friction_and_payload(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["check", "wiggle", "--friction", "0.05", "--payload", "2"]) == ExitCode.FAILED
    assert "That holds for friction 0.05, payload 2 kg." in capsys.readouterr().out
    assert main(["check", "nod", "--payload", "-1"]) == ExitCode.USAGE
    assert "World.payload must be between 0 and 12, got -1" in capsys.readouterr().err


def test_check_gives_json_with_every_margin(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "high_five", "--set", "side=left", "--json"]) == ExitCode.OK
    (report,) = json.loads(capsys.readouterr().out)
    assert report["ok"]
    assert {"support", "torque", "foot load", "friction"} <= set(report["margins"])
    assert report["margins"]["support"]["margin"] > 0.0


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["check", "levitate"], ExitCode.USAGE, "unknown motion 'levitate'; valid: beckon"),
        (["check", "nowhere.py"], ExitCode.FAILED, "there is no file nowhere.py"),
        (["check", "wave", "--set", "times=99"], ExitCode.FAILED, "times must be 1 to 8, got 99"),
        (["check", "wave", "--set", "times"], ExitCode.USAGE, "set by NAME=VALUE, got 'times'"),
        (["check", "wave", "--set", "x=1"], ExitCode.FAILED, "unknown parameter 'x'"),
        (["new", "two words"], ExitCode.USAGE, "must be a Python name"),
        (["export", "wave", "--out", "wave.txt"], ExitCode.USAGE, "valid: .csv, .npz"),
    ],
)
def test_what_is_wrong_is_said_with_what_is_valid(
    capsys: pytest.CaptureFixture[str], arguments: list[str], code: ExitCode, message: str
) -> None:
    assert main(arguments) == code
    assert message in capsys.readouterr().err


def test_a_new_motion_is_feasible_and_is_not_written_twice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "greet", "--out", str(tmp_path)]) == ExitCode.OK
    path = tmp_path / "greet.py"
    assert main(["check", str(path)]) == ExitCode.OK
    before = path.read_bytes()
    assert main(["new", "greet", "--out", str(tmp_path)]) == ExitCode.USAGE
    assert "exists already" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_new_and_export_tell_a_program_what_they_wrote(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "greet", "--out", str(tmp_path), "--json"]) == ExitCode.OK
    file = tmp_path / "greet.py"
    assert json.loads(capsys.readouterr().out) == {"motion": "greet", "file": str(file)}
    table = tmp_path / "greet.csv"
    assert main(["export", str(file), "--out", str(table), "--json"]) == ExitCode.OK
    told = json.loads(capsys.readouterr().out)
    assert told == {"motion": "greet", "file": str(table), "rows": told["rows"]}
    assert len(table.read_text().splitlines()) == told["rows"] + 1


@pytest.mark.parametrize(
    ("options", "friction", "payload"),
    [([], 0.5, 0.0), (["--friction", "0.7"], 0.7, 0.0), (["--payload", "2"], 0.5, 2.0)],
)
def test_a_motion_is_played_in_the_world_that_it_is_checked_for(
    monkeypatch: pytest.MonkeyPatch, options: list[str], friction: float, payload: float
) -> None:
    worlds: list[World] = []

    def plant(world: World) -> None:
        worlds.append(world)
        raise PlantError("enough")

    monkeypatch.setattr("go2_wbc.plant.plant_in_world", plant)
    assert main(["run", "bow", *options]) == ExitCode.RUNTIME
    assert [(world.friction, world.payload) for world in worlds] == [(friction, payload)]


def test_a_robot_that_cannot_get_up_is_a_message(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "bow", "--friction", "0.0001", "--force"]) == ExitCode.RUNTIME
    assert "the robot did not get ready: " in capsys.readouterr().err


def test_export_writes_the_same_trajectory_as_csv_and_npz(tmp_path: Path) -> None:
    for name in ("wave.csv", "wave.npz"):
        assert main(["export", "wave", "--out", str(tmp_path / name)]) == ExitCode.OK
    with (tmp_path / "wave.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    arrays = np.load(tmp_path / "wave.npz")
    assert len(rows) == len(arrays["time"])
    assert float(rows[100]["FR_thigh"]) == pytest.approx(arrays["q"][100, 7 + 4], abs=1e-6)
    assert float(rows[100]["z"]) == pytest.approx(arrays["q"][100, 2], abs=1e-6)
    assert {row["FR_stance"] for row in rows} == {"0", "1"}


@pytest.mark.slow
def test_run_plays_a_motion_and_measures_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], clumsy: Path
) -> None:
    page = tmp_path / "bow.html"
    assert main(["run", "bow", "--html", str(page)]) == ExitCode.OK
    text = capsys.readouterr().out
    assert "\ndone\n" in text
    assert text.startswith("bow, ")
    assert "as it was checked: friction 0.5\n" in text
    header, arrays = read_data(page.read_text(encoding="utf-8"))
    assert not header["is_plan"]
    assert header["verdict"]["ok"]
    shared = min(len(arrays["q"]), len(arrays["ghost.q"]))
    apart = np.abs(arrays["q"][:shared] - arrays["ghost.q"][:shared])
    assert 0.0 < apart[:, :3].max() < GHOST_DISTANCE
    assert np.abs(np.ptp(arrays["ghost.q"], axis=0)).max() > 0.1
    assert main(["run", f"{clumsy}:fall_over"]) == ExitCode.FAILED
    assert "infeasible" in capsys.readouterr().err
    assert main(["run", str(clumsy)]) == ExitCode.USAGE
    assert "choose FILE.py:NAME: fall_over, second" in capsys.readouterr().err
    assert main(["run", f"{clumsy}:fall_over", "--force", "--json"]) == ExitCode.FAILED
    result = json.loads(capsys.readouterr().out)
    assert not result["ok"]
    assert not result["feasible"]


@pytest.mark.parametrize("command", ["check", "preview", "export"])
def test_a_terminal_is_told_of_solving_what_was_not_solved_before(
    command: str,
    quick: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    more = {
        "check": [],
        "preview": ["--html", str(tmp_path / "quick.html")],
        "export": ["--out", str(tmp_path / "quick.plan")],
    }
    assert main([command, str(quick), *more[command]]) == ExitCode.OK
    assert "quick: solving, iteration 1, cost " in capsys.readouterr().err
    assert main([command, str(quick), *more[command], "--json"]) == ExitCode.OK
    assert capsys.readouterr().err == ""


def test_what_is_exported_is_the_nearest_motion(quick: Path, tmp_path: Path) -> None:
    saved = tmp_path / "quick.plan"
    assert main(["export", str(quick), "--out", str(saved)]) == ExitCode.OK
    plan = load_plan(saved)
    assert plan.has_dynamic_spans
