"""The evidence of the documentation comes from the benchmark, whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import balance, locomotion, speed
from benchmarks.__main__ import main
from benchmarks.behaviour import SCENARIOS
from benchmarks.evidence import (
    BEGIN,
    END,
    LINES,
    SENSED_BEGIN,
    SENSED_LINES,
    SPEED_BEGIN,
    SPEED_LINES,
    Line,
    filled,
    table,
)
from benchmarks.scenario import Scenario
from controller.cli.common import ExitCode
from go2_wbc.errors import ConfigError

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, SPEED_PAGE = DOCS / "evidence.md", DOCS / "explanation/speed.md"
ROWS = {line.metric: {"n": 20, "mean": 0.5, "worst": 0.25} for line in LINES}


@pytest.mark.parametrize(
    ("lines", "scenarios"),
    [
        (LINES, SCENARIOS),
        (SPEED_LINES, speed.SCENARIOS),
        (SENSED_LINES, (*locomotion.SCENARIOS, *balance.SCENARIOS)),
    ],
)
def test_every_line_is_a_metric_of_the_benchmark(
    lines: tuple[Line, ...], scenarios: tuple[Scenario, ...]
) -> None:
    names = {metric.name for scenario in scenarios for metric in scenario.metrics}
    assert {line.metric for line in lines} <= names


def test_the_mark_says_which_table_a_page_has() -> None:
    rows = {line.metric: {"n": 3, "mean": 0.5, "worst": 0.25} for line in SPEED_LINES}
    page = filled(f"{SPEED_BEGIN}: x -->\nold\n{END}\n", rows)
    assert page == f"{SPEED_BEGIN}: x -->\n{table(rows, SPEED_BEGIN)}\n{END}\n"
    assert "| before |" in page


def test_the_table_is_put_between_the_marks_and_nothing_else_changes() -> None:
    text = f"before\n{BEGIN}: x -->\nold\n{END}\nafter\n"
    assert filled(text, ROWS) == f"before\n{BEGIN}: x -->\n{table(ROWS)}\n{END}\nafter\n"


def test_of_two_tables_of_a_page_only_that_is_filled_of_which_there_are_results() -> None:
    text = f"{BEGIN} -->\nold\n{END}\n{SENSED_BEGIN} -->\nolder\n{END}\n"
    assert filled(text, ROWS) == text.replace("old\n", f"{table(ROWS)}\n", 1)
    sensed = {line.metric: {"n": 10, "mean": 0.5, "worst": 0.25} for line in SENSED_LINES}
    assert filled(text, sensed) == text.replace("older\n", f"{table(sensed, SENSED_BEGIN)}\n")


def test_the_command_fills_a_file_from_several_results(tmp_path: Path) -> None:
    readme, results = tmp_path / "PAGE.md", []
    readme.write_text(f"before\n{BEGIN}: x -->\nold\n{END}\n")
    rows = [{"name": name, **row} for name, row in ROWS.items()]
    for index, part in enumerate((rows, [{**rows[0], "n": 7}])):
        results.append(tmp_path / f"{index}.json")
        results[-1].write_text(json.dumps({"rows": part}))
    assert main(["evidence", str(readme), *map(str, results)]) == ExitCode.OK
    expected = table({**ROWS, LINES[0].metric: {**ROWS[LINES[0].metric], "n": 7}})
    assert readme.read_text() == f"before\n{BEGIN}: x -->\n{expected}\n{END}\n"


def test_a_missing_metric_or_mark_is_named() -> None:
    short = {name: row for name, row in ROWS.items() if name != "five.load"}
    with pytest.raises(ConfigError, match=r"no value for five\.load"):
        table(short)
    with pytest.raises(ConfigError, match="the text has no"):
        filled("nothing here", ROWS)
    with pytest.raises(ConfigError, match="end --> after <!-- evidence:begin"):
        filled(f"{BEGIN} -->\n", ROWS)


@pytest.mark.parametrize(
    ("page", "mark", "content"),
    [
        (PAGE, BEGIN, LINES),
        (PAGE, SENSED_BEGIN, SENSED_LINES),
        (SPEED_PAGE, SPEED_BEGIN, SPEED_LINES),
    ],
)
def test_no_figure_of_the_page_is_blank(page: Path, mark: str, content: tuple[Line, ...]) -> None:
    text = page.read_text(encoding="utf-8")
    block = text[text.index(mark) : text.index(END, text.index(mark))]
    lines = [line for line in block.splitlines() if line.startswith("|")][2:]
    assert len(lines) == len(content)
    for line in lines:
        assert all(cell.strip() for cell in line.split("|")[1:5]), line
