"""``go2-wbc demo``: what a person sees, what a program reads, and which files are left."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import viz
from controller.cli import demo, main
from controller.cli.common import ExitCode
from controller.cli.main import high_five_demo
from controller.demo import run_demo
from go2_wbc.config import Config
from go2_wbc.errors import ConfigError, PlantTimeout
from tests.controller.fake_go2 import FakeGo2

ROOT = Path(__file__).resolve().parents[2]
NO_DISPLAY = ("DISPLAY", "WAYLAND_DISPLAY")


@pytest.fixture
def pretend(monkeypatch: pytest.MonkeyPatch) -> Callable[[FakeGo2], None]:
    """Lets the command drive a fake robot and draw nothing."""

    def install(go2: FakeGo2) -> None:
        monkeypatch.setattr("controller.go2_controller.GO2Controller", lambda **_options: go2)
        monkeypatch.setattr("go2_wbc.plant.MujocoPlant", lambda *_args, **_options: None)

    return install


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Puts a few bytes in the place of every picture."""

    def draw(_recording: object, path: Path, **_options: object) -> Path:
        path.write_bytes(b"picture")
        return path

    for name in ("export_html", "export_filmstrip", "export_animation"):
        monkeypatch.setattr(viz, name, draw)


# --- the command --------------------------------------------------------------------------------


def test_a_good_run_prints_the_table_leaves_its_files_and_exits_with_0(
    tmp_path: Path,
    pretend: Callable[[FakeGo2], None],
    drawn: None,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pretend(FakeGo2())
    assert main.main(["demo", "--out", str(tmp_path / "new" / "folder")]) == ExitCode.OK
    names = {"demo.html", "demo.npz", "demo.png", "demo.webp", "report.json"}
    assert {file.name for file in (tmp_path / "new" / "folder").iterdir()} == names
    captured = capsys.readouterr()
    assert "All 8 steps done" in captured.out
    assert all(name in captured.out for name in names)
    assert captured.err.splitlines()[:2] == ["1/8 stand up: ok", "2/8 sit: ok"]
    assert len(captured.err.splitlines()) == 8


def test_a_run_with_a_failed_step_exits_with_1_and_says_why_at_once(
    tmp_path: Path, pretend: Callable[[FakeGo2], None], capsys: pytest.CaptureFixture[str]
) -> None:
    pretend(FakeGo2(refusals={"high_five": "the paw was not held"}))
    assert main.main(["demo", "--no-media", "--out", str(tmp_path)]) == ExitCode.FAILED
    assert "7/8 high five: NOT DONE: the paw was not held" in capsys.readouterr().err


def test_a_plant_that_fails_exits_with_3(
    tmp_path: Path, pretend: Callable[[FakeGo2], None], capsys: pytest.CaptureFixture[str]
) -> None:
    pretend(FakeGo2(errors={"walk": PlantTimeout("no news")}))
    assert main.main(["demo", "--no-media", "--out", str(tmp_path)]) == ExitCode.RUNTIME
    assert "go2-wbc: no news" in capsys.readouterr().err


def test_json_is_all_that_goes_to_standard_output_and_equals_the_file(
    tmp_path: Path,
    pretend: Callable[[FakeGo2], None],
    drawn: None,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pretend(FakeGo2())
    main.main(["demo", "--json", "--seed", "3", "--out", str(tmp_path)])
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert printed["settings"]["seed"] == 3
    assert len(printed["steps"]) == 8


def test_without_media_the_recording_is_kept_and_nothing_is_drawn(
    tmp_path: Path, pretend: Callable[[FakeGo2], None]
) -> None:
    go2 = FakeGo2()
    pretend(go2)
    main.main(["demo", "--no-media", "--out", str(tmp_path)])
    assert {file.name for file in tmp_path.iterdir()} == {"demo.npz", "report.json"}
    with np.load(tmp_path / "demo.npz") as arrays:
        np.testing.assert_array_equal(arrays["q"], go2.recording().q)
        assert tuple(arrays["labels"]) == go2.recording().labels


def test_a_picture_that_cannot_be_made_is_a_runtime_error_after_the_table(
    tmp_path: Path,
    pretend: Callable[[FakeGo2], None],
    drawn: None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def refuse(*_args: object, **_options: object) -> Path:
        raise ConfigError("the page would have 9 bytes")

    pretend(FakeGo2())
    monkeypatch.setattr(viz, "export_html", refuse)
    assert main.main(["demo", "--out", str(tmp_path)]) == ExitCode.RUNTIME
    captured = capsys.readouterr()
    assert "All 8 steps done" in captured.out
    assert "go2-wbc: the page would have 9 bytes" in captured.err
    assert (tmp_path / "report.json").is_file()


@pytest.mark.parametrize("place", ["a file", "below a file"])
def test_an_unwritable_place_is_an_error_before_the_run(
    place: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def start(**_options: object) -> FakeGo2:
        raise AssertionError("the run has started")

    monkeypatch.setattr("controller.go2_controller.GO2Controller", start)
    file = tmp_path / "file"
    file.write_text("mine", encoding="utf-8")
    out = file if place == "a file" else file / "folder"
    assert main.main(["demo", "--out", str(out)]) == ExitCode.USAGE
    assert str(out) in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == "mine"


def test_the_viewer_without_a_display_is_one_line_and_the_run_goes_on(
    tmp_path: Path,
    pretend: Callable[[FakeGo2], None],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name in NO_DISPLAY:
        monkeypatch.delenv(name, raising=False)
    pretend(FakeGo2())
    monkeypatch.setattr(sys, "platform", "linux")
    code = main.main(["demo", "--viewer", "--no-media", "--out", str(tmp_path)])
    assert code == ExitCode.OK
    complaint = capsys.readouterr().err.splitlines()[0]
    assert complaint == "go2-wbc: no viewer: there is no display; going on without it"


def test_options_reach_plant_controller_and_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, object] = {}
    monkeypatch.setattr(
        "go2_wbc.plant.MujocoPlant", lambda mjcf, **options: seen.update(options, mjcf=mjcf)
    )

    def start(**options: object) -> FakeGo2:
        seen.update(options)
        return FakeGo2()

    monkeypatch.setattr("controller.go2_controller.GO2Controller", start)
    monkeypatch.setattr(demo, "_has_display", lambda: True)  # no reason to open a viewer
    file = tmp_path / "mine.toml"
    file.write_text("[locomotion]\nheight = 0.27\n", encoding="utf-8")
    options = "--seed 3 --friction 0.4 --mass-scale 1.2 --realtime --backend full --solver proxqp"
    main.main(
        ["demo", "--no-media", "--out", str(tmp_path), "--config", str(file), *options.split()]
    )
    config = seen["config"]
    assert (seen["seed"], seen["friction"], seen["mass_scale"]) == (3, 0.4, 1.2)
    assert seen["initial_joint_noise"] == demo.START_NOISE
    assert (seen["realtime"], seen["viewer"], seen["mjcf"]) == (True, False, None)
    assert isinstance(config, Config)
    assert (config.backend, config.wbc.solver, config.locomotion.height) == ("full", "proxqp", 0.27)


def test_without_a_seed_the_robot_starts_exactly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, object] = {}
    monkeypatch.setattr("go2_wbc.plant.MujocoPlant", lambda *_args, **options: seen.update(options))
    monkeypatch.setattr("controller.go2_controller.GO2Controller", lambda **_options: FakeGo2())
    main.main(["demo", "--no-media", "--out", str(tmp_path)])
    assert seen["initial_joint_noise"] == 0.0


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


@pytest.mark.parametrize(
    "options",
    [
        ["--friction", "0"],
        ["--friction", "-1"],
        ["--mass-scale", "inf"],
        ["--mass-scale", "heavy"],
        ["--seed", "-1"],
        ["--seed", "1.5"],
        ["--backend", "magic"],
        ["--solver", "magic"],
    ],
)
def test_a_value_out_of_range_is_a_usage_error(
    options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main.main(["demo", *options]) == ExitCode.USAGE
    assert options[0] in capsys.readouterr().err


def test_the_script_of_the_course_is_the_same_command(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["high_five_demo", "--help"])
    assert high_five_demo() == ExitCode.OK
    assert capsys.readouterr().out.startswith("usage: go2-wbc demo")


# --- the filmstrip ------------------------------------------------------------------------------


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


def test_a_run_without_these_moments_leaves_the_choice_to_the_filmstrip() -> None:
    go2 = FakeGo2(falls_in="walk")
    assert demo.filmstrip_times(run_demo(go2), go2.recording()) is None


def test_a_file_in_the_way_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "x").touch()
    with pytest.raises(ConfigError, match="it is a file"):
        demo.checked_paths(tmp_path / "x")


# --- the real thing -----------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [[], ["--backend", "placo"], ["--backend", "full", "--solver", "proxqp"]],
    ids=["default", "placo", "full proxqp"],
)
def test_the_real_demo_does_every_step_inside_the_limits(
    tmp_path: Path, options: list[str]
) -> None:
    environment = {name: v for name, v in os.environ.items() if name not in NO_DISPLAY}
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "controller.cli.main",
            "demo",
            "--no-media",
            "--viewer",
            "--out",
            ".",
            *options,
        ],
        cwd=tmp_path,
        env={**environment, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
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
