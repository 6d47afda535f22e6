"""The evidence of the documentation comes from the benchmark, whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import balance, locomotion, speed
from benchmarks.__main__ import main
from benchmarks.behaviour import SCENARIOS
from benchmarks.both_states import PAIRS, SPEEDS, Pair, names_of
from benchmarks.evidence import (
    BEGIN,
    BOTH_BEGIN,
    END,
    LINES,
    SENSED_BEGIN,
    SENSED_LINES,
    SPEED_BEGIN,
    SPEED_LINES,
    Line,
    filled,
    rows_of,
    table,
)
from benchmarks.scenario import Scenario
from controller.cli.common import ExitCode
from go2_wbc.errors import ConfigError

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, SPEED_PAGE = DOCS / "evidence.md", DOCS / "explanation/speed.md"
ROBOT_CALLS = ("stand", "trot-0", "trot-1", "5", "0", "stop")
"""What stands before the last call in the rows of other people's robots."""
ROWS = {line.metric: {"n": 20, "mean": 0.5, "worst": 0.25} for line in LINES}


@pytest.mark.parametrize(
    ("lines", "scenarios"),
    [
        (LINES, SCENARIOS),
        (SPEED_LINES, speed.SCENARIOS),
        (SENSED_LINES, (*locomotion.SCENARIOS, *balance.SCENARIOS)),
        (PAIRS, (*locomotion.SCENARIOS, *balance.SCENARIOS)),
    ],
)
def test_every_line_is_a_metric_of_the_benchmark(
    lines: tuple[Line | Pair, ...], scenarios: tuple[Scenario, ...]
) -> None:
    names = {metric.name for scenario in scenarios for metric in scenario.metrics}
    assert {name for line in lines for name in line.metrics} <= names


def test_every_row_of_locomotion_that_has_a_bar_is_in_the_table_of_both_states() -> None:
    asked = {
        metric.name
        for scenario in (*locomotion.SCENARIOS, *balance.SCENARIOS)
        for metric in scenario.metrics
        if metric.threshold is not None
    }
    shown = {name for pair in PAIRS for name in pair.metrics}
    left = {name for name in asked - shown if not name.startswith("done.")}
    assert all(name.rsplit(".")[-1] in {"speed", "saturated", *ROBOT_CALLS} for name in left), left


def test_a_line_of_both_states_tells_mean_deviation_worst_and_falls() -> None:
    good = {"n": 10, "mean": 0.5, "sd": 0.1, "worst": 0.75, "falls": 0}
    rows = {"a": good, "sensed-a": {**good, "worst": None, "sd": None, "falls": 3}}
    line = Pair("what", "a", "sensed-a", "2 %", peer="none").row(rows)
    assert line == "| what | 2 % | 0.50; 0.10; 0.75 (n 10) | 0.50; -; - (n 10, 3 fell) | none |"
    none = {"n": 4, "mean": None, "sd": None, "worst": None, "falls": 4}
    assert "| all fell (n 4) |" in Pair("what", "a", "b").row({"a": good, "b": none})
    assert "| 1 fell (n 4) |" in Pair("what", "a", "b").row({"a": good, "b": {**none, "falls": 1}})
    assert "| - |" in Pair("what", "", "a").row(rows)
    with pytest.raises(ConfigError, match="no value for missing"):
        Pair("what", "missing", "").row(rows)


def test_the_errors_of_the_trot_are_drawn_over_its_speed(tmp_path: Path) -> None:
    page, results = tmp_path / "PAGE.md", tmp_path / "rows.json"
    page.write_text(f"{BOTH_BEGIN}: x -->\nold\n{END}\n")
    row = {"n": 10, "mean": 0.5, "sd": 0.1, "worst": 0.75, "falls": 0}
    rows = [{"name": name, **row} for pair in PAIRS for name in pair.metrics]
    last = names_of(list(SPEEDS)[-1])[0]
    rows = [{**row, "worst": None} if row["name"] == f"{last}.mean" else row for row in rows]
    results.write_text(json.dumps({"rows": rows}))
    figure = tmp_path / "speeds.svg"
    assert main(["evidence", str(page), str(results), "--plot", str(figure)]) == ExitCode.OK
    for words in ("own sensors", "true state", "closest peer", "speed told, m/s"):
        assert words in figure.read_text()
    assert page.read_text().count("\n|") == len(PAIRS) + 2
    assert main(["evidence", str(page), str(results), "--plot", "speeds.txt"]) == ExitCode.USAGE


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


@pytest.mark.parametrize("text", ["# a page", "{}", "[1]", None])
def test_a_file_that_holds_no_results_is_named(tmp_path: Path, text: str | None) -> None:
    file = tmp_path / "other.md"
    if text is not None:
        file.write_text(text)
    with pytest.raises(ConfigError, match=r"other\.md is not what --out of a benchmark writes"):
        rows_of(file)


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
        (PAGE, BOTH_BEGIN, PAIRS),
        (SPEED_PAGE, SPEED_BEGIN, SPEED_LINES),
    ],
)
def test_no_figure_of_the_page_is_blank(
    page: Path, mark: str, content: tuple[Line | Pair, ...]
) -> None:
    text = page.read_text(encoding="utf-8")
    block = text[text.index(mark) : text.index(END, text.index(mark))]
    lines = [line for line in block.splitlines() if line.startswith("|")][2:]
    assert len(lines) == len(content)
    for line in lines:
        cells = line.split("|")
        assert all(cell.strip() for cell in (cells[1], *cells[3:5])), line
