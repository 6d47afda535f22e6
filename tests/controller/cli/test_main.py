"""The command line finds its commands, and every way to fail has its message and exit code."""

import importlib
import logging
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import pytest

from controller.cli import main as cli
from controller.cli.common import ExitCode
from controller.pacing import REASON
from go2_wbc import errors
from tests.controller.cli.conftest import Run
from tests.controller.sweeps import swept

ROOT = Path(__file__).resolve().parents[3]
COLUMNS = 80
HEAVY = {"numpy", "pinocchio", "placo", "mujoco", "meshcat", "proxsuite", "jaxtyping", "qpsolvers"}

USAGE = ExitCode.USAGE
TRIAL = f"{swept.__name__}:trial"

NEEDED = {
    "completion": "bash",
    "certify": "bow",
    "dance": "song.wav",
    "dataset": "walk.parquet",
    "export": "bow --out bow.csv",
    "new": "greet",
    "preview": "bow",
    "replay": "bow.sqlite 3",
    "run": "bow",
    "sweep": "bow",
    "unitree-drive": "--interface lo",
}
"""The least that commands must be given."""

Action = Callable[[], int]


@pytest.fixture
def act(monkeypatch: pytest.MonkeyPatch) -> Callable[[Action], None]:
    """Installs a subcommand ``act`` that does what the test says."""

    def install(action: Action) -> None:
        module = ModuleType("fake_act")
        module.__dict__.update(run=action)
        monkeypatch.setitem(sys.modules, "fake_act", module)
        entries = (*cli.COMMANDS, cli.Command("act", "fake_act", "act"))
        monkeypatch.setattr(cli, "COMMANDS", entries)

    return install


def failing(error: BaseException) -> Action:
    def action() -> int:
        raise error

    return action


def one() -> int:
    """Do something.

    Examples:
        go2-wbc act
    """
    return 1


def run_process(*arguments: str, stdout: int = subprocess.PIPE) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        env={**os.environ, "PYTHONUNBUFFERED": ""},  # argparse hides an early broken pipe
        stdin=subprocess.DEVNULL,
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )


def test_help_lists_every_command_with_examples_in_80_columns(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    out = run("--help").out
    assert "examples:" in out
    assert all(command.summary in out for command in cli.COMMANDS)
    assert max(map(len, out.splitlines())) <= COLUMNS


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.name)
def test_every_command_has_a_help_with_examples(
    command: cli.Command, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    out = run(command.name, "--help").out
    assert out.startswith(f"usage: go2-wbc {command.name}")
    assert "examples:" in out
    assert max(map(len, out.splitlines())) <= COLUMNS


def test_the_command_line_itself_imports_no_library() -> None:
    """``doctor`` must start when a library is broken, so nothing on its way may import one."""
    code = "import sys, controller.cli.doctor, controller.cli.main; print(*sys.modules)"
    done = run_process("-c", code)
    assert done.returncode == 0, done.stderr
    assert HEAVY & set(done.stdout.split()) == set()


def test_a_command_that_cannot_be_imported_does_not_stop_the_others(
    monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    broken = cli.Command("broken", "no_such_module_anywhere", "is broken")
    monkeypatch.setattr(cli, "COMMANDS", (*cli.COMMANDS, broken))
    run("--help")
    run("doctor", "--help")
    assert "go2-wbc doctor" in run("broken", code=ExitCode.RUNTIME).err


def test_without_a_command_there_is_the_help_and_the_version_if_it_is_asked_for(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    for version, told in (("7.1", "7.1"), (None, "(not installed)")):
        monkeypatch.setattr("controller.cli.main.installed_version", lambda _, known=version: known)
        assert run("--version").out.strip() == f"go2-wbc {told}"
    assert "usage: go2-wbc" in run(code=USAGE).err


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ("dance", USAGE, "usage:"),
        ("doctor --nonsense", USAGE, "usage:"),
        ("--nonsense", USAGE, "usage:"),
        ("certify bow --friction 9", USAGE, "World.friction must be between"),
        ("certify bow --at-least 95", USAGE, "--at-least must be between 0 and 1, got 95"),
        ("certify bow --html page.txt", USAGE, "valid: .html"),
        ("check levitate", USAGE, "unknown motion 'levitate'; valid: beckon"),
        ("check nod --payload -1", USAGE, "World.payload must be between 0 and 12, got -1"),
        ("check nowhere.py", USAGE, "there is no file nowhere.py"),
        ("check wave --set times=99", USAGE, "times must be 1 to 8, got 99"),
        ("check wave --set times", USAGE, "set by NAME=VALUE, got 'times'"),
        ("check wave --set x=1", USAGE, "unknown parameter 'x'"),
        ("dance song.wav --html dance.txt", USAGE, "valid: .html"),
        ("dance song.wav --seed -1", USAGE, "must be a whole number of 0 or more, got '-1'"),
        ("demo --friction 0", USAGE, "--friction: must be a positive number, got '0'"),
        ("demo --mass-scale inf", USAGE, "--mass-scale: must be a positive number"),
        ("demo --seed -1", USAGE, "--seed: must be a whole number of 0 or more, got '-1'"),
        ("demo --backend magic", USAGE, "--backend: invalid choice: 'magic'"),
        ("export wave", USAGE, "the following arguments are required: --out"),
        ("export wave --out wave.txt", USAGE, "valid: .csv, .npz"),
        ("identify-friction --mjcf my_go2.xml --interface lo", USAGE, "not both"),
        ("new 'two words'", USAGE, "must be a Python name"),
        ("preview bow --html bow.pdf", USAGE, "valid: .html, .htm"),
        ("preview bow --video bow.avi", USAGE, "valid: .webp, .gif, .mp4"),
        ("preview bow --plot bow", USAGE, "no suffix; valid: .svg, .png"),
        ("preview bow --port http", USAGE, "must be a port from 0 to 65535, got 'http'"),
        ("preview bow --port 65536", USAGE, "must be a port from 0 to 65535"),
        ("preview bow --html bow.html --set angle=9", USAGE, "angle must be 0.1 to 0.45"),
        ("preview levitate --no-open", USAGE, "unknown motion 'levitate'; valid: beckon"),
        ("sweep no_such", USAGE, "unknown motion 'no_such'"),
        (f"sweep {TRIAL} --n 0", USAGE, "n must be a whole number, at least 1, got 0"),
        (f"sweep {TRIAL} --engine dask", USAGE, "unknown engine 'dask'; valid: local, ray"),
        (f"sweep {TRIAL} --out rows.txt", USAGE, "valid: .sqlite, .db"),
        (f"sweep {TRIAL} --export rows.xlsx", USAGE, "valid: .csv, .parquet"),
        (f"sweep {TRIAL} --plot rows.jpg", USAGE, "valid: .svg, .png, .pdf"),
        (f"sweep {TRIAL} --set a=1", USAGE, "unknown motion"),
    ],
)
def test_what_is_wrong_is_said_with_what_is_valid_and_leaves_nothing(
    words: str,
    code: ExitCode,
    message: str,
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    said = run(*shlex.split(words), code=code)
    assert message in said.err
    assert said.out == ""
    assert list(tmp_path.iterdir()) == []


def test_the_exit_code_of_a_command_is_passed_on(act: Callable[[Action], None], run: Run) -> None:
    act(one)
    run("act", code=1)


@pytest.mark.parametrize(
    ("words", "level"),
    [("act", "WARNING"), ("-v act", "INFO"), ("act -v", "INFO"), ("-v act --verbose", "INFO")],
)
def test_it_logs_what_happens_where_it_is_asked_to_before_or_behind_the_command(
    words: str, level: str, act: Callable[[Action], None], run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    levels: list[int] = []
    monkeypatch.setattr(logging, "basicConfig", lambda **how: levels.append(how["level"]))
    act(one)
    run(*words.split(), code=1)
    assert levels == [logging.getLevelNamesMapping()[level]]


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.MotionInfeasible("bow", ["too fast"]), ExitCode.FAILED),
        (errors.StanceMismatch("sits"), ExitCode.FAILED),
        (errors.QpInfeasible("daqp", "infeasible"), ExitCode.FAILED),
        (errors.IkError("0.4 m off"), ExitCode.FAILED),
        (errors.PlanNotFound("no jump"), ExitCode.FAILED),
        (errors.DynamicMotionRefused("a robot"), ExitCode.FAILED),
        (errors.CommandError("nan"), ExitCode.USAGE),
        (errors.TimelineError("hold(-1)"), ExitCode.USAGE),
        (errors.MotionFileError("bow.plan is damaged"), ExitCode.USAGE),
        (errors.ModelMismatch("no such joint"), ExitCode.USAGE),
        (errors.ConfigError("unknown key"), ExitCode.USAGE),
        (errors.SolverUnavailable("unknown QP solver"), ExitCode.USAGE),
        (errors.PlantTimeout("silent"), ExitCode.RUNTIME),
        (errors.MissingDependency("pip install x"), ExitCode.RUNTIME),
        (errors.SweepError("a worker died"), ExitCode.RUNTIME),
        (errors.BridgeError("no ROS"), ExitCode.RUNTIME),
        (errors.ModeError("lying"), ExitCode.RUNTIME),
        (FileNotFoundError(2, "No such file or directory", "bow.py"), ExitCode.RUNTIME),
    ],
    ids=lambda value: type(value).__name__,
)
def test_an_expected_error_is_one_message_and_an_exit_code_whatever_the_command(
    monkeypatch: pytest.MonkeyPatch, run: Run, error: Exception, code: ExitCode
) -> None:
    def fail(*_: object) -> int:
        raise error

    monkeypatch.setattr("controller.cli.common._called", fail)
    assert set(NEEDED) <= {command.name for command in cli.COMMANDS}
    for command in cli.COMMANDS:
        said = run(command.name, *NEEDED.get(command.name, "").split(), code=code)
        assert said.out == ""
        assert said.err == f"go2-wbc: {_told(error)}\n"


def _told(error: Exception) -> str:
    return f"{error.filename}: {error.strerror}" if isinstance(error, OSError) else str(error)


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.name)
def test_every_command_refuses_what_is_no_option_and_asks_for_what_it_needs(
    command: cli.Command, run: Run
) -> None:
    words = NEEDED.get(command.name, "").split()
    assert "--nonsense" in run(command.name, *words, "--nonsense", code=USAGE).err
    if words:
        assert "arguments are required" in run(command.name, code=USAGE).err


@pytest.mark.parametrize(
    ("level", "message", "is_shown"),
    [(logging.WARNING, REASON, False), (logging.INFO, REASON, True), (logging.WARNING, "?", True)],
)
def test_why_something_ended_is_said_once_and_logged_only_for_who_wants_to_know(
    caplog: pytest.LogCaptureFixture, level: int, message: str, *, is_shown: bool
) -> None:
    record = logging.LogRecord("controller.loop", logging.WARNING, "", 0, message, (), None)
    with caplog.at_level(level, "controller.loop"):
        assert cli._is_news(record) is is_shown


def test_a_missing_library_points_to_the_doctor(act: Callable[[Action], None], run: Run) -> None:
    act(failing(ModuleNotFoundError("No module named 'placo'", name="placo")))
    err = run("act", code=ExitCode.RUNTIME).err
    assert "placo" in err
    assert "go2-wbc doctor" in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "bug", [ZeroDivisionError("1/0"), ModuleNotFoundError("no viz.x", name="viz.x")]
)
def test_a_bug_shows_its_traceback(act: Callable[[Action], None], run: Run, bug: Exception) -> None:
    act(failing(bug))
    assert "Traceback" in run("act", code=ExitCode.RUNTIME).err


def test_an_interrupt_is_one_line_and_130(act: Callable[[Action], None], run: Run) -> None:
    act(failing(KeyboardInterrupt()))
    assert run("act", code=ExitCode.INTERRUPTED).err == "go2-wbc: interrupted\n"


def test_an_unknown_option_is_told_with_those_of_its_command(run: Run) -> None:
    told = run("check", "bow", "--jobs", "2", code=USAGE).err
    assert told.startswith("usage: go2-wbc check")
    assert "unrecognized arguments: --jobs 2" in told


def test_a_reader_that_has_gone_is_no_noise() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run_process("-m", "controller.cli.main", "--help", stdout=writing)
    finally:
        os.close(writing)
    assert done.returncode == ExitCode.BROKEN_PIPE
    assert done.stderr == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
@pytest.mark.parametrize("words", [("list",), ("--help",)])
def test_output_that_the_disk_does_not_take_is_one_line(words: Sequence[str]) -> None:
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        done = run_process("-m", "controller.cli.main", *words, stdout=full.fileno())
    assert done.returncode == ExitCode.RUNTIME
    assert done.stderr == "go2-wbc: cannot write what it prints: No space left on device\n"


def test_a_process_without_output_may_run_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    assert cli.main(["list"]) == ExitCode.OK


def test_it_runs_as_a_module_where_its_script_is_not_on_the_path(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["controller.cli", "no-such-command"])
    with pytest.raises(SystemExit) as ended:
        importlib.import_module("controller.cli.__main__")  # which python -m runs
    assert ended.value.code == USAGE
    assert "no-such-command" in capsys.readouterr().err
