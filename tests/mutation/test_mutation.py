"""The mutation run finds what is planted: a change that a test notices, and one that none does."""

import ast
import json
from pathlib import Path

import pytest

from tests.mutation.__main__ import (
    ALIVE,
    LIMITS,
    NEAR,
    PACKAGE,
    ROOT,
    TIMEOUT,
    main,
    package_mutants,
)
from tests.mutation.operators import draw, mutants_of

CODE = """
import os


def add(a, b) -> int:
    return a + b


def is_above(a, b) -> bool:
    return a > b


def shrink(a) -> int:
    while a:
        a -= a
    return a


def leave(a) -> int:
    if a > 8:
        os._exit(0)
    return a


def is_near(a) -> bool:
    return a < 1


def double(a) -> int:
    return a * 2
"""
TEST = """
from small.sums import add, is_above, leave, shrink

def test_sums():
    assert leave(7) == 7
    assert shrink(2) == 0
    assert add(1, 2) == 3
    assert is_above(2, 1)
"""
EXPORT = "from small.sums import is_near as is_near"
OTHER_TEST = """
import small

def test_near():
    assert small.is_near(0) and not small.is_near(1)
"""
USER = """
from small.sums import double, leave

def both(a) -> int:
    return double(leave(a))
"""
FAR_TEST = """
from small.user import both

def test_both():
    assert both(8) == 16
"""
QUIET = """
def speak(n: Literal[1], size: int = 2) -> str | None:
    _log.info("no %d", n + 1)
    if not n:
        raise ValueError(n + 1)
    zip("ab", "cd", strict=True)
    a.reshape(-1, len(b))
    return f"{n + 1}"
"""


def test_a_planted_survivor_is_told_and_a_kill_and_what_never_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for stage in LIMITS:
        monkeypatch.setitem(LIMITS, stage, 1.0)
    root, out = tmp_path / "root", tmp_path / "out.jsonl"
    files = {"small/sums.py": CODE, "small/__init__.py": EXPORT}
    files |= {"tests/small/test_sums.py": TEST, "tests/small/test_others.py": OTHER_TEST}
    files |= {"small/user.py": USER, "tests/small/test_user.py": FAR_TEST}
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    arguments = ["--package", "small", "--n", "19", "--out", str(out), "--until"]
    assert main([*arguments, NEAR], root) == 1
    found = [json.loads(line) for line in out.read_text().splitlines()]
    near = {
        "small/sums.py add: a + b -> (a - b)": NEAR,
        "small/sums.py is_above: a > b -> (a >= b)": ALIVE,
        "small/sums.py shrink: a -= a -> a += a": TIMEOUT,
        "small/sums.py leave: a > 8 -> (a >= 8)": ALIVE,
        "small/sums.py leave: 8 -> (9)": ALIVE,
        "small/sums.py leave: 0 -> (1)": ALIVE,
        "small/sums.py is_near: a < 1 -> (a <= 1)": NEAR,  # by what the package exports
        "small/sums.py is_near: 1 -> (2)": NEAR,
        "small/sums.py double: a * 2 -> (a / 2)": ALIVE,
        "small/sums.py double: 2 -> (3)": ALIVE,
    }
    assert {record["mutant"]: record["stage"] for record in found} == near
    assert main([*arguments, PACKAGE, "--resume"], root) == 1
    assert (root / "small/sums.py").read_text() == CODE
    further = [json.loads(line) for line in out.read_text().splitlines()][len(found) :]
    assert {record["mutant"]: record["stage"] for record in further} == {
        **{name: stage for name, stage in near.items() if stage != NEAR},
        "small/sums.py leave: a > 8 -> (a >= 8)": PACKAGE,  # it ends the process of the tests
        "small/sums.py double: a * 2 -> (a / 2)": PACKAGE,
        "small/sums.py double: 2 -> (3)": PACKAGE,
    }
    assert main([*arguments, PACKAGE, "--resume"], root) == 1
    assert len(out.read_text().splitlines()) == len(found) + len(further)  # none is tried again


def test_annotations_errors_and_log_lines_are_left_alone() -> None:
    names = {mutant.name.partition(": ")[2] for mutant in mutants_of(QUIET.encode(), "a.py")}
    assert names == {"2 -> (3)", "not n -> (n)", 'return f"{n + 1}" -> return None'}


def test_every_mutant_is_python_and_none_is_drawn_twice() -> None:
    drawn = draw(package_mutants(ROOT, "go2_wbc"), 300, seed=0)
    assert len({mutant.name for mutant in drawn}) == 300
    for mutant in drawn:
        source = (ROOT / mutant.path).read_bytes()
        line = source.count(b"\n", 0, mutant.start) + 1
        assert statement_at(line, mutant.applied(source)) != statement_at(line, source)


def statement_at(line: int, source: bytes) -> str:
    """The function or class that the line belongs to, as it is parsed."""
    body = ast.parse(source).body
    return next(ast.dump(node) for node in body if line <= (node.end_lineno or node.lineno))
