"""The pytest plugin: motions are tests, and a failure is a table and no traceback."""

import subprocess
import tomllib
from pathlib import Path

import pytest

from tests.script_server import ROOT, pytest_with, python

MOTIONS = '''
from motions import Timeline, deg, motion

@motion
def good() -> Timeline:
    """Good: a small bow."""
    return Timeline().body(pitch=deg(10), over=0.8).home(over=0.8)

@motion
def too_far() -> Timeline:
    """Too far: the trunk leaves the feet."""
    return Timeline().body(y=0.2, over=0.5).home(over=0.5)

@motion
def typo() -> Timeline:
    """Typo: there is no such channel."""
    return Timeline().body(zz=0.2, over=0.5)
'''

TESTS = """
import pytest
from motions import Timeline, deg, motion
from mine import good, too_far

def test_good(check_motion):
    assert check_motion(good).ok

@pytest.mark.motion_margins(support=0.2)
def test_margin(check_motion):
    check_motion(good)

def test_too_far(check_motion):
    check_motion(too_far)
"""


def run_pytest(folder: Path, *args: str) -> subprocess.CompletedProcess[str]:
    return pytest_with("motions.pytest_plugin", folder, "-rA", *args)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    (tmp_path / "mine.py").write_text(MOTIONS, encoding="utf-8")
    return tmp_path


def test_every_motion_of_a_file_or_folder_is_a_test_and_a_failure_is_no_traceback(
    folder: Path,
) -> None:
    done = run_pytest(folder, "mine.py")
    assert done.returncode == 1
    assert "PASSED mine.py::good" in done.stdout
    assert "FAILED mine.py::too_far - the robot cannot do 'too_far'" in done.stdout
    assert "x support: CoM at" in done.stdout
    assert "typo (mine.py, line 17): TypeError" in done.stdout
    assert "Traceback" not in done.stdout
    assert "2 failed, 1 passed" in done.stdout
    (folder / "more").mkdir()
    (folder / "more" / "one.py").write_text(MOTIONS.split("@motion\ndef too_far")[0])
    done = run_pytest(folder, "--motions", "more", "-q")
    assert done.returncode == 0, done.stdout
    assert "PASSED more/one.py::good" in done.stdout
    assert run_pytest(folder, "--motions", "nowhere").returncode == pytest.ExitCode.USAGE_ERROR


def test_the_fixture_fails_a_test_with_the_findings_and_the_margins_of_its_marker(
    folder: Path,
) -> None:
    (folder / "test_mine.py").write_text(TESTS, encoding="utf-8")
    done = run_pytest(folder, "test_mine.py")
    assert "PASSED test_mine.py::test_good" in done.stdout
    assert "FAILED test_mine.py::test_margin" in done.stdout
    assert "required 0.2" in done.stdout
    assert "FAILED test_mine.py::test_too_far" in done.stdout


def test_margins_of_the_ini_file_hold_for_every_motion(folder: Path) -> None:
    text = "[pytest]\nmotion_margins =\n    support = 0.2\n"
    (folder / "pytest.ini").write_text(text, encoding="utf-8")
    done = run_pytest(folder, "mine.py", "-k", "good")
    assert done.returncode == 1
    assert "required 0.2" in done.stdout


def test_a_file_that_does_not_run_is_told_with_its_line(folder: Path) -> None:
    (folder / "mine.py").write_text(MOTIONS + "\n1 / 0\n", encoding="utf-8")
    done = run_pytest(folder, "mine.py")
    assert done.returncode == pytest.ExitCode.INTERRUPTED
    assert "ZeroDivisionError: division by zero" in done.stdout


def test_the_plugin_is_announced_and_loads_nothing_heavy() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    plugins = project["entry-points"]["pytest11"]
    assert plugins["go2_motions"] == "motions.pytest_plugin"
    assert plugins["go2_certificates"] == "controller.pytest_plugin"
    code = f"import sys, {', '.join(plugins.values())}; print(sorted(sys.modules))"
    done = python("-c", code)
    assert "sys" in done.stdout, done.stderr
    for heavy in ("pinocchio", "placo", "mujoco", "numpy", "scipy"):
        assert f"'{heavy}'" not in done.stdout
