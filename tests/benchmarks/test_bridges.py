"""Which benches of the bridges a name stands for, and what is said when one cannot run."""

from __future__ import annotations

import sys

import pytest

from benchmarks.bridges import DOORS, find_doors
from benchmarks.rows import Family
from controller.cli import main as cli
from controller.cli.common import ExitCode
from go2_wbc.errors import CommandError

FAMILIES = [family for door in DOORS for family in door.families]


def chosen(*names: str) -> list[Family]:
    return [family for door in find_doors(names) for family in door.families]


def test_no_name_stands_for_everything() -> None:
    assert chosen() == FAMILIES


def test_a_door_stands_for_its_families() -> None:
    assert chosen("unitree") == list(DOORS[1].families)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_a_family_stands_for_itself(family: Family) -> None:
    assert chosen(family.name) == [family]


def test_an_unknown_name_is_answered_with_the_valid_ones() -> None:
    with pytest.raises(CommandError, match=r"ros3.*ros2.*unitree-drive"):
        find_doors(["ros3"])


def test_the_rows_are_listed_without_the_extras(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert cli.main(["bench", "bridges", "--list"]) == ExitCode.OK
    lines = capsys.readouterr().out.splitlines()
    assert {family.name for family in FAMILIES} <= set(lines)
    assert max(map(len, lines)) <= 80


def test_row_names_are_unique() -> None:
    names = [row.name for family in FAMILIES for row in family.rows]
    assert len(names) == len(set(names))


def test_without_the_extra_the_bench_names_the_line_that_installs_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    assert cli.main(["bench", "bridges", "unitree"]) == ExitCode.RUNTIME
    complaint = capsys.readouterr().err
    assert 'pip install -e ".[unitree]"' in complaint
    assert "Traceback" not in complaint
