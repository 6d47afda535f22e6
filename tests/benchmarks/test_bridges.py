"""Which benchmarks of the bridges a name stands for, and what is said when one cannot run."""

import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import main
from benchmarks.bridges import STUDIES
from benchmarks.study import chosen_studies
from controller.cli.common import ExitCode


@pytest.mark.parametrize("name", ["", "ros2", "unitree", *(study.name for study in STUDIES)])
def test_a_name_stands_for_a_group_or_a_scenario_and_none_for_everything(name: str) -> None:
    expected = tuple(study for study in STUDIES if study.name.startswith(name))
    assert chosen_studies(STUDIES, [name] if name else []) == expected


def test_without_the_extras_metrics_are_listed_and_the_line_that_installs_them_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], results_folder: Path
) -> None:
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert main(["bridges", "--list"]) == ExitCode.OK
    lines = capsys.readouterr().out.splitlines()
    assert {scenario.name for scenario in STUDIES} <= set(lines)
    assert max(map(len, lines)) <= 80
    assert main(["bridges", "unitree"]) == ExitCode.RUNTIME
    complaint = capsys.readouterr().err
    assert 'pip install "go2-wbc[unitree]"' in complaint
    assert "Traceback" not in complaint
    assert not results_folder.exists()
