"""``go2-wbc demo``: what a person sees, what a program reads, and which files are left."""

import json
import math
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import viz
from controller.cli import demo
from controller.cli.common import ExitCode, ProgressLine, progress_bar
from controller.cli.demo import render
from controller.cli.main import high_five_demo
from controller.demo import DemoReport, DemoTotals, Measurement, StepResult, run_demo
from controller.demo.steps import TERRAINS
from go2_wbc.config import Config
from go2_wbc.errors import ConfigError, PlantTimeout
from go2_wbc.plant.terrain import Stairs
from tests.controller.cli.conftest import Run, Said
from tests.controller.fake_go2 import FakeGo2
from tests.script_server import run_script

NO_DISPLAY = ("DISPLAY", "WAYLAND_DISPLAY")


Pretend = Callable[..., Said]


@pytest.fixture
def demo_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run) -> Pretend:
    """Runs the command with a fake robot, and a few bytes in the place of every picture."""

    def draw(_recording: object, path: Path, **_options: object) -> Path:
        path.write_bytes(b"picture")
        return path

    def demo_of(go2: FakeGo2, *words: object, code: int = ExitCode.OK) -> Said:
        monkeypatch.setattr("controller.go2_controller.GO2Controller", lambda **_options: go2)
        return run("demo", "--out", tmp_path, *words, code=code)

    monkeypatch.setattr("go2_wbc.plant.MujocoPlant", lambda *_args, **_options: None)
    for name in ("export_html", "export_filmstrip", "export_animation"):
        monkeypatch.setattr(viz, name, draw)
    return demo_of


def test_a_good_run_prints_the_table_leaves_its_files_and_exits_with_0(
    tmp_path: Path, demo_of: Pretend
) -> None:
    folder = tmp_path / "new" / "folder"
    said = demo_of(FakeGo2(), "--out", folder)
    names = {"demo.html", "demo.npz", "demo.png", "demo.webp", "report.json"}
    assert {file.name for file in folder.iterdir()} == names
    assert "All 8 steps done" in said.out
    assert all(name in said.out for name in names)
    assert said.err.splitlines()[:2] == ["1/8 stand up: ok", "2/8 sit: ok"]
    assert len(said.err.splitlines()) == 8


@pytest.mark.parametrize(
    ("go2", "code", "message"),
    [
        (
            {"refusals": {"high_five": "the paw was not held"}},
            ExitCode.FAILED,
            "7/8 high five: NOT DONE: the paw was not held",
        ),
        ({"errors": {"walk": PlantTimeout("no news")}}, ExitCode.RUNTIME, "go2-wbc: no news"),
    ],
)
def test_a_step_that_is_not_done_and_a_plant_that_fails_are_told(
    go2: dict[str, Any], code: ExitCode, message: str, demo_of: Pretend
) -> None:
    assert message in demo_of(FakeGo2(**go2), "--no-media", code=code).err


def test_json_is_all_that_goes_to_standard_output_and_equals_the_file(
    tmp_path: Path, demo_of: Pretend
) -> None:
    printed = json.loads(demo_of(FakeGo2(), "--json", "--seed", 3).out)
    assert printed == json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert printed["settings"]["seed"] == 3
    assert len(printed["steps"]) == 8


def test_without_media_the_recording_is_kept_and_nothing_is_drawn(
    tmp_path: Path, demo_of: Pretend
) -> None:
    go2 = FakeGo2()
    demo_of(go2, "--no-media")
    assert {file.name for file in tmp_path.iterdir()} == {"demo.npz", "report.json"}
    with np.load(tmp_path / "demo.npz") as arrays:
        np.testing.assert_array_equal(arrays["q"], go2.recording().q)
        assert tuple(arrays["labels"]) == go2.recording().labels


def test_a_picture_that_cannot_be_made_is_a_runtime_error_after_the_table(
    tmp_path: Path, demo_of: Pretend, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_args: object, **_options: object) -> Path:
        raise ConfigError("the page would have 9 bytes")

    monkeypatch.setattr(viz, "export_html", refuse)
    said = demo_of(FakeGo2(), code=ExitCode.RUNTIME)
    assert "All 8 steps done" in said.out
    assert "go2-wbc: the page would have 9 bytes" in said.err
    assert (tmp_path / "report.json").is_file()


@pytest.mark.parametrize(
    ("place", "reason"), [("file", "it is a file, give a folder"), ("file/folder", "cannot write")]
)
def test_an_unwritable_place_is_an_error_before_the_run(
    place: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    def start(**_options: object) -> FakeGo2:
        raise AssertionError("the run has started")

    monkeypatch.setattr("controller.go2_controller.GO2Controller", start)
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    said = run("demo", "--out", tmp_path / place, code=ExitCode.USAGE)
    assert str(tmp_path / place) in said.err
    assert reason in said.err
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


def test_the_viewer_without_a_display_is_one_line_and_the_run_goes_on(
    demo_of: Pretend, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in NO_DISPLAY:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    complaint = demo_of(FakeGo2(), "--viewer", "--no-media").err.splitlines()[0]
    assert complaint == "go2-wbc: no viewer: there is no display; going on without it"


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The options that reach the plant and the controller."""
    seen: dict[str, Any] = {}

    def plant(mjcf: Path | None, **options: object) -> None:
        seen.update(options, mjcf=mjcf)

    def start(**options: object) -> FakeGo2:
        seen.update(options)
        return FakeGo2()

    monkeypatch.setattr("go2_wbc.plant.MujocoPlant", plant)
    monkeypatch.setattr("controller.go2_controller.GO2Controller", start)
    return seen


def test_options_reach_plant_controller_and_engine_and_without_any_it_starts_exactly(
    tmp_path: Path, seen: dict[str, Any], run: Run
) -> None:
    run("demo", "--no-media", "--out", tmp_path)
    assert seen["initial_joint_noise"] == 0.0
    assert (seen["terrain"], seen["lidar"], seen["sensors"]) == (None, False, "ideal")
    assert (seen["realtime"], seen["viewer"]) == (False, False)
    run("demo", "--no-media", "--out", tmp_path, "--terrain", "stairs", code=ExitCode.FAILED)
    assert isinstance(seen["terrain"], Stairs)
    assert (seen["lidar"], seen["sensors"]) == (True, "imu")
    file = tmp_path / "mine.toml"
    file.write_text("[locomotion]\nheight = 0.27\n", encoding="utf-8")
    options = "--seed 3 --friction 0.4 --mass-scale 1.2 --realtime --backend full --solver proxqp"
    run("demo", "--no-media", "--out", tmp_path, "--config", file, *options.split())
    config = seen["config"]
    assert (seen["seed"], seen["friction"], seen["mass_scale"]) == (3, 0.4, 1.2)
    assert seen["initial_joint_noise"] == demo.START_NOISE
    assert (seen["realtime"], seen["viewer"], seen["mjcf"]) == (True, False, None)
    assert isinstance(config, Config)
    assert (config.backend, config.wbc.solver, config.locomotion.height) == ("full", "proxqp", 0.27)


def test_the_choices_are_those_of_the_engine() -> None:
    from go2_wbc.errors import SolverUnavailable
    from go2_wbc.robot.model import RobotModel
    from go2_wbc.wbc.controller import WholeBodyController
    from go2_wbc.wbc.solvers import check_solver

    model = RobotModel()
    for backend in demo.BACKENDS:
        assert WholeBodyController(model, backend).backend_name == backend
    for solver in demo.SOLVERS:
        assert check_solver(solver) == solver
    with pytest.raises(SolverUnavailable):
        check_solver("no such solver")
    assert tuple(TERRAINS) == demo.TERRAINS


def test_the_script_of_the_course_is_the_same_command(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["high_five_demo", "--help"])
    assert high_five_demo() == ExitCode.OK
    assert capsys.readouterr().out.startswith("usage: go2-wbc demo")


def test_the_filmstrip_shows_sitting_swinging_and_the_raised_paw() -> None:
    go2 = FakeGo2()
    report, recording = run_demo(go2), go2.recording()
    stance = recording.stance.copy()
    forward = report.steps[3]
    inside = np.abs(recording.time - forward.start - 1.0) < 0.1
    stance[inside] = (True, False, False, True)
    recording.stance[:] = stance
    times = demo.filmstrip_times(report, recording)
    assert times is not None
    rows = [int(np.abs(recording.time - recording.time[0] - t).argmin()) for t in times]
    sit = report.steps[1]
    assert 0.0 <= sit.start + sit.duration - recording.time[rows[0]] < 0.05
    assert inside[rows[1]]
    assert stance[rows[2]].tolist() == [True, False, True, True]


def test_the_filmstrip_of_a_terrain_shows_three_moments_and_of_no_walk_what_it_chooses() -> None:
    go2 = FakeGo2()
    report = run_demo(go2)
    forward = replace(report.steps[3], name="cross")
    times = demo.filmstrip_times(replace(report, steps=(forward,)), go2.recording())
    start = forward.start - go2.recording().time[0]
    assert times == pytest.approx([start + 0.5, start + 1.0, start + 1.5])
    go2 = FakeGo2(falls_in="walk")
    assert demo.filmstrip_times(run_demo(go2), go2.recording()) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    "options", [[], ["--backend", "full", "--solver", "proxqp"]], ids=["default", "full proxqp"]
)
def test_the_real_demo_does_every_step_inside_the_limits(
    tmp_path: Path, options: list[str]
) -> None:
    environment = {name: v for name, v in os.environ.items() if name not in NO_DISPLAY}
    words = ["demo", "--no-media", "--viewer", "--out", ".", *options]
    done = run_script(["-m", "controller.cli.main", *words], tmp_path, environment)
    assert done.returncode == ExitCode.OK, done.stdout + done.stderr
    assert done.stdout.count("✓") == 8
    assert "going on without it" in done.stderr
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert report["ok"]
    totals = report["totals"]
    assert totals["peak_torque_ratio"] < 1.0
    assert totals["peak_speed_ratio"] < 1.0
    assert totals["least_support_margin"] > 0.0
    assert totals["least_foot_load"] > 0.0
    assert totals["qp_failures"] == 0


COLUMNS = 80
LONG_REASON = "fell at t=3.2 s: " + "roll 71 deg, " * 12
TOTALS = DemoTotals(0.44, 0.42, math.nan, math.nan, 0, 24.5, 8.2)


def report_of(*steps: StepResult) -> DemoReport:
    return DemoReport(steps, TOTALS)


def test_the_table_fits_80_columns_whatever_happens() -> None:
    figure = Measurement("moved from the place", -123.456, "m/s", -12.0, 0.1)
    bad = StepResult("stand", "forward 0.2 m/s, 2 s", False, LONG_REASON, 0.0, 123.45, (figure,))
    for report in (report_of(bad), run_demo(FakeGo2())):
        for encoding in ("utf-8", "ascii"):
            lines = render(report, encoding).splitlines()
            assert max(map(len, lines)) <= COLUMNS


def test_the_table_marks_every_step_beside_what_was_measured_with_a_dash_for_nothing() -> None:
    report = run_demo(FakeGo2(refusals={"high_five": "the paw was not held at 0.62 m"}))
    text = render(report, "utf-8")
    assert text.count("✓") == 7
    assert text.count("✗") == 1
    assert "\n     the paw was not held at 0.62 m\n" in text
    assert "7 of 8 steps done." in text
    totals = [line.split() for line in text.splitlines() if "on three legs: least" in line]
    assert [total[-2:] for total in totals] == [["0.060", "m"], ["40", "N"]]
    text = render(run_demo(FakeGo2(speed_share=0.95)), "utf-8")
    row = next(line for line in text.splitlines() if "mean speed" in line)
    assert row.split()[-3:] == ["0.200", "0.190", "m/s"]
    text = render(report_of(), "utf-8")
    assert "nan" not in text
    assert "least support margin   -" in text


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", None, "no-such-encoding"])
def test_a_terminal_without_ticks_gets_words(encoding: str | None) -> None:
    good = StepResult("sit", "sit", True, "done", 0.0, 1.0)
    text = render(report_of(good, StepResult("s", "s", False, "why", 0.0, 1.0)), encoding)
    assert "  ok sit" in text
    assert "FAIL s" in text
    assert text.isascii()


def test_on_a_terminal_progress_is_one_line_in_place_that_tells_of_solving(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with ProgressLine() as line:
        line.update(0.5, "checking sway")
        for iteration in range(1, 13):
            line.solving(iteration, 1234.5)
    shown = [part.rstrip("\r") for part in capsys.readouterr().err.split("\x1b[2K")]
    assert [text for text in shown if "solving" in text] == [
        f"{progress_bar(0.5)} checking sway: solving, iteration {n}, cost 1.23e+03"
        for n in (1, 6, 11)
    ]
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with ProgressLine() as line:
        line.update(0.5, "x" * 100)
        line.done("one piece")
    text = capsys.readouterr().err
    assert "\n" not in text
    assert "one piece" not in text
    shown = text.split("\x1b[2K")[1].rstrip("\r")
    assert len(shown) < 40
    assert text.endswith("\r\x1b[2K")


def test_of_what_a_search_says_the_first_answer_stays_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was cut to the terminal's width and gone after a tenth of a second."""
    from motions.dynamics.shooting_problem import _log

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with ProgressLine() as line:
        line.update(0.0, "leap")
        _log.info("trying to begin from %s", "a guess")
        _log.info("no plan yet; what binds: %s", "torque share of FL_calf at 0.30 s " * 3)
        line.solving(1, 1.0)
    stays = [part.strip("\r") for part in capsys.readouterr().err.split("\x1b[2K") if "\n" in part]
    assert stays == [f"leap: no plan yet; what binds: {'torque share of FL_calf at 0.30 s ' * 3}\n"]


@pytest.mark.parametrize(("is_terminal", "is_quiet"), [(False, False), (True, True)])
def test_into_a_pipe_or_beside_json_nothing_is_said_of_solving(
    is_terminal: bool,
    is_quiet: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    with ProgressLine(is_quiet=is_quiet) as line:
        line.update(0.5, "checking sway")
        line.solving(1, 1.0)
    assert capsys.readouterr().err == ""


def test_elsewhere_progress_is_one_line_for_each_finished_piece(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with ProgressLine() as line:
        line.update(0.5, "going on")
        line.done("1/2 stand: ok")
        line.done("2/2 sit: ok")
    assert capsys.readouterr().err == "1/2 stand: ok\n2/2 sit: ok\n"


@pytest.mark.parametrize(
    ("share", "filled"), [(-1.0, 0), (0.0, 0), (0.5, 10), (1.0, 20), (2.0, 20)]
)
def test_the_bar_is_filled_in_proportion(share: float, filled: int) -> None:
    assert progress_bar(share).count("#") == filled
