"""A program that the server runs cannot tell that Python did not start it itself."""

import os
from pathlib import Path

import pytest

from tests.script_server import ROOT, python, run_script

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "MARK": "seen"}
TELLS = """
import atexit, os, sys, warnings
print(__name__, sys.argv, sys.path[:2], os.getcwd(), os.environ["MARK"], sys.stdin.read())
print(sorted(name for name in sys.modules if name.split(".")[0] in
      ("go2_wbc", "controller", "motions", "viz")))
print(sorted(name for name in globals() if not name.startswith("__")))
print(sys.modules["__main__"].__dict__ is globals(), globals().get("__file__"))
atexit.register(print, "the end")
print("aloud", file=sys.stderr)
sys.exit(len(sys.argv))
"""


@pytest.mark.parametrize("form", ["file", "-c", "-m"])
def test_a_program_is_told_what_python_tells_it(form: str, tmp_path: Path) -> None:
    (tmp_path / "telling.py").write_text(TELLS, encoding="utf-8")
    arguments = {"file": ["telling.py"], "-c": ["-c", TELLS], "-m": ["-m", "telling"]}[form]
    arguments = [*arguments, "--wide"]
    real = python(*arguments, folder=tmp_path, **ENVIRONMENT)
    done = run_script(arguments, tmp_path, ENVIRONMENT)
    assert done.stdout == real.stdout
    assert done.stderr == real.stderr
    assert done.returncode == real.returncode == 2
    assert "the end" in done.stdout


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("raise SystemExit('too far')", 1, "too far\n"),
        ("1 / 0", 1, "ZeroDivisionError"),
        ("import os; os.abort()", -6, ""),
        ("import warnings; warnings.warn('old', DeprecationWarning)", 1, "DeprecationWarning: old"),
    ],
)
def test_the_end_of_a_program_is_reported(text: str, code: int, words: str, tmp_path: Path) -> None:
    done = run_script(["-c", text], tmp_path, ENVIRONMENT)
    assert done.returncode == code
    assert words in done.stderr
