"""The command line finds its commands, and every way to fail has its message and exit code."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from controller.cli import main as cli
from controller.cli.common import ExitCode
from go2_wbc import errors

ROOT = Path(__file__).resolve().parents[2]
COLUMNS = 80
HEAVY = {"numpy", "pinocchio", "placo", "mujoco", "meshcat", "proxsuite", "jaxtyping", "qpsolvers"}

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
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    assert cli.main(["--help"]) == ExitCode.OK
    out = capsys.readouterr().out
    assert "examples:" in out
    assert all(command.summary in out for command in cli.COMMANDS)
    assert max(map(len, out.splitlines())) <= COLUMNS


@pytest.mark.parametrize("command", cli.COMMANDS, ids=lambda command: command.name)
def test_every_command_has_a_help_with_examples(
    command: cli.Command, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    assert cli.main([command.name, "--help"]) == ExitCode.OK
    out = capsys.readouterr().out
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
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = cli.Command("broken", "no_such_module_anywhere", "is broken")
    monkeypatch.setattr(cli, "COMMANDS", (*cli.COMMANDS, broken))
    assert cli.main(["--help"]) == ExitCode.OK
    assert cli.main(["doctor", "--help"]) == ExitCode.OK
    capsys.readouterr()
    assert cli.main(["broken"]) == ExitCode.RUNTIME
    assert "go2-wbc doctor" in capsys.readouterr().err


def test_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--version"]) == ExitCode.OK
    assert capsys.readouterr().out.startswith("go2-wbc ")


def test_no_command_shows_the_help_as_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([]) == ExitCode.USAGE
    assert "usage: go2-wbc" in capsys.readouterr().err


@pytest.mark.parametrize("argv", [["dance"], ["doctor", "--nonsense"], ["--nonsense"]])
def test_wrong_usage_exits_with_2(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(argv) == ExitCode.USAGE
    assert "usage:" in capsys.readouterr().err


def test_the_exit_code_of_a_command_is_passed_on(act: Callable[[Action], None]) -> None:
    act(one)
    assert cli.main(["act"]) == 1
    assert cli.main(["--verbose", "act"]) == 1


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.MotionInfeasible("bow", ["too fast"]), ExitCode.FAILED),
        (errors.StanceMismatch("sits"), ExitCode.FAILED),
        (errors.QpInfeasible("daqp", "infeasible"), ExitCode.FAILED),
        (errors.IkError("0.4 m off"), ExitCode.FAILED),
        (errors.CommandError("nan"), ExitCode.USAGE),
        (errors.ConfigError("unknown key"), ExitCode.USAGE),
        (errors.SolverUnavailable("unknown QP solver"), ExitCode.USAGE),
        (errors.PlantTimeout("silent"), ExitCode.RUNTIME),
        (errors.MissingDependency("pip install x"), ExitCode.RUNTIME),
        (FileNotFoundError(2, "No such file or directory", "bow.py"), ExitCode.RUNTIME),
    ],
    ids=lambda value: type(value).__name__,
)
def test_an_expected_error_is_a_message_and_an_exit_code_without_traceback(
    act: Callable[[Action], None],
    capsys: pytest.CaptureFixture[str],
    error: Exception,
    code: ExitCode,
) -> None:
    act(failing(error))
    assert cli.main(["act"]) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("go2-wbc: ")
    assert "Traceback" not in captured.err


def test_a_missing_library_points_to_the_doctor(
    act: Callable[[Action], None], capsys: pytest.CaptureFixture[str]
) -> None:
    act(failing(ModuleNotFoundError("No module named 'placo'", name="placo")))
    assert cli.main(["act"]) == ExitCode.RUNTIME
    err = capsys.readouterr().err
    assert "placo" in err
    assert "go2-wbc doctor" in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "bug", [ZeroDivisionError("1/0"), ModuleNotFoundError("no viz.x", name="viz.x")]
)
def test_a_bug_shows_its_traceback(
    act: Callable[[Action], None], capsys: pytest.CaptureFixture[str], bug: Exception
) -> None:
    act(failing(bug))
    assert cli.main(["act"]) == ExitCode.RUNTIME
    assert "Traceback" in capsys.readouterr().err


def test_an_interrupt_is_one_line_and_130(
    act: Callable[[Action], None], capsys: pytest.CaptureFixture[str]
) -> None:
    act(failing(KeyboardInterrupt()))
    assert cli.main(["act"]) == ExitCode.INTERRUPTED
    assert capsys.readouterr().err == "go2-wbc: interrupted\n"


def test_a_reader_that_has_gone_is_no_noise() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run_process("-m", "controller.cli.main", "--help", stdout=writing)
    finally:
        os.close(writing)
    assert done.returncode == ExitCode.BROKEN_PIPE
    assert done.stderr == ""
