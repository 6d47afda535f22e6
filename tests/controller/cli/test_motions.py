"""The commands about motions: list, check, new, export and run."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from controller.cli.common import ExitCode
from controller.cli.motion_args import meant
from go2_wbc.errors import PlantError
from go2_wbc.world import World
from motions import load_plan, motion_names
from tests.controller.cli.conftest import Run
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


def test_what_is_listed_is_the_library_with_its_parameters(run: Run) -> None:
    assert [line.name for line in meant([], [])] == list(motion_names())
    assert [line.name for line in meant(["bow"], [])] == ["bow"]
    text = run("list").out
    assert all(name in text for name in motion_names())
    assert "--set hold=2 (0.5 to 30 s)" in text
    assert max(map(len, text.splitlines())) <= 80
    listed = json.loads(run("list", "--json").out)
    assert [item["name"] for item in listed] == list(motion_names())


def test_check_prints_a_table_for_one_motion_and_a_line_each_for_more(
    clumsy: Path, run: Run
) -> None:
    assert "bow, 2.4 s: the robot can do it." in run("check", "bow").out
    assert len(run("check", "bow", "nod").out.splitlines()) == 2
    assert "x support: CoM at" in run("check", f"{clumsy}:fall_over", code=ExitCode.FAILED).out
    assert "no   fall_over" in run("check", clumsy, code=ExitCode.FAILED).out


def test_check_says_what_would_make_a_motion_feasible(tmp_path: Path, run: Run) -> None:
    hasty = tmp_path / "hasty.py"
    hasty.write_text(
        "from motions import Timeline, deg, motion\n\n\n@motion\ndef hasty() -> Timeline:\n"
        '    """Too fast."""\n    return Timeline().body(yaw=deg(25), over=0.12).home(over=0.12)\n'
    )
    said = run("check", hasty, "bow", "--fix", code=ExitCode.FAILED).out
    assert "hasty is feasible with one of these appended" in said
    assert "    .scale_time(" in said
    assert max(map(len, said.splitlines())) <= 80
    (report,) = json.loads(run("check", hasty, "--fix", "--json", code=ExitCode.FAILED).out)
    assert {one["kind"] for one in report["suggestions"]} == {"tempo", "amplitude"}


def test_a_world_is_asked_for_by_its_friction_and_payload_and_what_cannot_stand_there_is_told(
    run: Run,
) -> None:
    said = run("check", "wiggle", "--friction", 0.05, "--payload", 2, code=ExitCode.FAILED)
    assert "That holds for friction 0.05, payload 2 kg." in said.out
    said = run("run", "bow", "--friction", 0.0001, "--force", code=ExitCode.RUNTIME)
    assert "the robot did not get ready: fell at t=" in said.err


def test_the_numbers_of_a_file_count_in_a_check(tmp_path: Path, run: Run) -> None:
    numbers = tmp_path / "go2.toml"
    numbers.write_text("[feasibility]\ntorque_share = 0.1\n")
    assert "ok" in run("check", "nod").out
    assert "torque" in run("check", "nod", "--config", numbers, code=ExitCode.FAILED).out
    numbers.write_text("[wbc]\nfriction = 900\n")
    said = run("check", "nod", "--config", numbers, code=ExitCode.USAGE).err
    assert "WbcConfig.friction must be between 0.0001 and 2, got 900" in said


def test_check_gives_json_with_every_margin(run: Run) -> None:
    (report,) = json.loads(run("check", "high_five", "--set", "side=left", "--json").out)
    assert report["ok"]
    assert {"support", "torque", "foot load", "friction"} <= set(report["margins"])
    assert report["margins"]["support"]["margin"] > 0.0


@pytest.mark.parametrize("name", ["motions", "json", "numpy"])
def test_a_new_motion_hides_no_module(name: str, tmp_path: Path, run: Run) -> None:
    said = run("new", name, "--out", tmp_path, code=ExitCode.USAGE).err
    assert f"would hide the module {name!r}" in said
    assert not list(tmp_path.iterdir())


def test_a_new_motion_is_feasible_is_not_written_twice_and_is_told_to_a_program(
    tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, table = tmp_path / "greet.py", tmp_path / "greet.csv"
    told = json.loads(run("new", "greet", "--out", tmp_path, "--json").out)
    assert told == {"motion": "greet", "file": str(path)}
    run("check", path)
    before = path.read_bytes()
    monkeypatch.syspath_prepend(tmp_path)  # as with python -m controller.cli, from that folder
    monkeypatch.setenv("HOME", str(tmp_path.parent))  # a shell leaves ~ as it is behind --out=
    for folder in (tmp_path, f"~/{tmp_path.name}"):
        assert "exists already" in run("new", "greet", "--out", folder, code=ExitCode.USAGE).err
    assert path.read_bytes() == before
    told = json.loads(run("export", path, "--out", table, "--json").out)
    assert told == {"motion": "greet", "file": str(table), "rows": told["rows"]}
    assert len(table.read_text().splitlines()) == told["rows"] + 1


@pytest.mark.parametrize(
    ("options", "friction", "payload"),
    [([], 0.5, 0.0), (["--friction", "0.7"], 0.7, 0.0), (["--payload", "2"], 0.5, 2.0)],
)
def test_a_motion_is_played_in_the_world_that_it_is_checked_for(
    monkeypatch: pytest.MonkeyPatch, run: Run, options: list[str], friction: float, payload: float
) -> None:
    worlds: list[World] = []

    def plant(world: World, *, seed: int, **usual: object) -> None:
        assert (seed, any(usual.values())) == (0, False)
        worlds.append(world)
        raise PlantError("enough")

    monkeypatch.setattr("go2_wbc.plant.plant_in_world", plant)
    run("run", "bow", *options, code=ExitCode.RUNTIME)
    assert [(world.friction, world.payload) for world in worlds] == [(friction, payload)]


def test_export_writes_the_same_trajectory_as_csv_and_npz(tmp_path: Path, run: Run) -> None:
    for name in ("wave.csv", "wave.npz"):
        run("export", "wave", "--out", tmp_path / name)
    with (tmp_path / "wave.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    arrays = np.load(tmp_path / "wave.npz")
    assert len(rows) == len(arrays["time"])
    assert float(rows[100]["FR_thigh"]) == pytest.approx(arrays["q"][100, 7 + 4], abs=1e-6)
    assert float(rows[100]["z"]) == pytest.approx(arrays["q"][100, 2], abs=1e-6)
    assert {row["FR_stance"] for row in rows} == {"0", "1"}


@pytest.mark.slow
def test_run_plays_a_motion_and_measures_it(tmp_path: Path, clumsy: Path, run: Run) -> None:
    page = tmp_path / "bow.html"
    text = run("run", "bow", "--explain", "--html", page).out
    assert "\ndone\n" in text
    assert "no limit was in the way\n" in text or "limits in the way:\n" in text
    assert text.startswith("bow, ")
    assert "as it was checked: friction 0.5\n" in text
    header, arrays = read_data(page.read_text(encoding="utf-8"))
    assert not header["is_plan"]
    assert header["binding"] is not None
    assert header["verdict"]["ok"]
    shared = min(len(arrays["q"]), len(arrays["ghost.q"]))
    apart = np.abs(arrays["q"][:shared] - arrays["ghost.q"][:shared])
    assert 0.0 < apart[:, :3].max() < GHOST_DISTANCE
    assert np.abs(np.ptp(arrays["ghost.q"], axis=0)).max() > 0.1
    assert "infeasible" in run("run", f"{clumsy}:fall_over", code=ExitCode.FAILED).err
    said = run("run", clumsy, code=ExitCode.USAGE)
    assert "choose FILE.py:NAME: fall_over, second" in said.err
    words = ("--force", "--explain", "--json")
    said = run("run", f"{clumsy}:fall_over", *words, code=ExitCode.FAILED)
    result = json.loads(said.out)
    assert max(result["limits"].values()) == next(iter(result["limits"].values())) > 0.0
    assert not result["ok"]
    assert not result["feasible"]


@pytest.mark.parametrize("command", ["check", "preview", "export"])
def test_a_terminal_is_told_of_solving_what_was_not_solved_before(
    command: str, quick: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    more: dict[str, list[object]] = {
        "check": [],
        "preview": ["--html", tmp_path / "quick.html"],
        "export": ["--out", tmp_path / "quick.plan"],
    }
    said = run(command, quick, *more[command])
    assert "quick: solving, iteration 1, cost " in said.err
    assert run(command, quick, *more[command], "--json").err == ""
    if command == "export":
        assert load_plan(tmp_path / "quick.plan").has_dynamic_spans  # the nearest motion
