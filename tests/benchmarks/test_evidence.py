"""The evidence of the documentation comes from the benchmark, whole."""

import json
from pathlib import Path

import pytest

from benchmarks import balance, locomotion, policies, speed
from benchmarks.__main__ import main
from benchmarks.behaviour import STUDIES
from benchmarks.evidence import END, MARK, SPEEDS, Line, Table, filled, names_of, rows_of, tables
from benchmarks.study import Study
from controller.cli.common import ExitCode
from go2_wbc.errors import ConfigError

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, SPEED_PAGE = DOCS / "evidence.md", DOCS / "explanation/speed.md"
ROBOT_CALLS = ("stand", "trot-0", "trot-1", "5", "0", "stop")
"""What stands before the last call in the rows of other people's robots."""
BEGIN, SENSED_BEGIN, SPEED_BEGIN, BOTH_BEGIN = (
    f"{MARK}{name}" for name in ("begin", "sensors", "speed", "both")
)
TRUTH, SENSED, SPEED, BOTH = (tables()[name] for name in ("begin", "sensors", "speed", "both"))
ROWS = {name: {"n": 20, "mean": 0.5, "worst": 0.25} for name in TRUTH.metrics}


@pytest.mark.parametrize(
    ("table", "studies"),
    [
        (TRUTH, STUDIES),
        (SPEED, speed.STUDIES),
        (SENSED, (*locomotion.STUDIES, *balance.STUDIES)),
        (BOTH, (*locomotion.STUDIES, *balance.STUDIES)),
        (tables()["policies"], policies.STUDIES),
    ],
)
def test_every_line_is_a_metric_of_the_benchmark(table: Table, studies: tuple[Study, ...]) -> None:
    assert table.metrics <= {metric.name for study in studies for metric in study.metrics}


def test_every_row_of_locomotion_that_has_a_bar_is_in_the_table_of_both_states() -> None:
    asked = {
        metric.name
        for scenario in (*locomotion.STUDIES, *balance.STUDIES)
        for metric in scenario.metrics
        if metric.threshold is not None
    }
    robots = [
        f"{where}{robot}." for where in ("", "sensed-") for robot in ("a1", "go1", "menagerie")
    ]
    # their own pages tell of them
    others = ("stairs.", "ramp.", "waves.", "slope.", "mixed.", *robots)
    left = {name for name in asked - BOTH.metrics if not name.startswith(others)}
    assert all(name.rsplit(".")[-1] in {"speed", "saturated", *ROBOT_CALLS} for name in left), left


def test_a_line_of_both_states_tells_mean_deviation_worst_and_falls() -> None:
    good = {"n": 10, "mean": 0.5, "sd": 0.1, "worst": 0.75, "falls": 0}
    rows = {"a": good, "sensed-a": {**good, "worst": None, "sd": None, "falls": 3}}
    line = Line(("a", "sensed-a"), "what", "{:.2f}", "none", "2 %").text(rows)
    assert line == "| what | 2 % | 0.50; 0.10; 0.75 (n 10) | 0.50; -; - (n 10, 3 failed) | none |"
    none = {"n": 4, "mean": None, "sd": None, "worst": None, "falls": 4}
    both, one = Line(("a", "b"), "what", "{:.2f}"), Line(("", "a"), "what", "{:.2f}")
    assert "| all failed (n 4) |" in both.text({"a": good, "b": none})
    assert "| 1 failed (n 4) |" in both.text({"a": good, "b": {**none, "falls": 1}})
    assert "| - |" in one.text(rows)
    with pytest.raises(ConfigError, match="no value for missing"):
        Line(("missing", ""), "what", "{:.2f}").text(rows)


def test_the_errors_of_the_trot_are_drawn_over_its_speed(tmp_path: Path) -> None:
    page, results = tmp_path / "PAGE.md", tmp_path / "rows.json"
    page.write_text(f"{BOTH_BEGIN}: x -->\nold\n{END}\n")
    row = {"n": 10, "mean": 0.5, "sd": 0.1, "worst": 0.75, "falls": 0}
    rows = [{"name": name, **row} for name in BOTH.metrics]
    last = names_of(list(SPEEDS)[-1])[0]
    rows = [{**row, "worst": None} if row["name"] == f"{last}.mean" else row for row in rows]
    results.write_text(json.dumps({"rows": rows}))
    figure = tmp_path / "speeds.svg"
    assert main(["evidence", str(page), str(results), "--plot", str(figure)]) == ExitCode.OK
    for words in ("own sensors", "true state", "closest peer", "speed told, m/s"):
        assert words in figure.read_text()
    assert page.read_text().count("\n|") == len(BOTH.lines) + 2
    assert main(["evidence", str(page), str(results), "--plot", "speeds.txt"]) == ExitCode.USAGE


def test_a_table_is_filled_where_its_mark_says_and_nothing_else_changes() -> None:
    rows = {name: {"n": 3, "mean": 0.5, "worst": 0.25} for name in SPEED.metrics}
    page = filled(f"{SPEED_BEGIN}: x -->\nold\n{END}\n", rows)
    assert page == f"{SPEED_BEGIN}: x -->\n{SPEED.text(rows)}\n{END}\n"
    assert "| before |" in page
    text = f"before\n{BEGIN}: x -->\nold\n{END}\nafter\n"
    assert filled(text, ROWS) == f"before\n{BEGIN}: x -->\n{TRUTH.text(ROWS)}\n{END}\nafter\n"
    text = f"{BEGIN} -->\nold\n{END}\n{SENSED_BEGIN} -->\nolder\n{END}\n"
    assert filled(text, ROWS) == text.replace("old\n", f"{TRUTH.text(ROWS)}\n", 1)
    sensed = {name: {"n": 10, "mean": 0.5, "worst": 0.25} for name in SENSED.metrics}
    assert filled(text, sensed) == text.replace("older\n", f"{SENSED.text(sensed)}\n")
    before = TRUTH.text(ROWS)
    (first, *_), one = TRUTH.lines, {"n": 9, "mean": 0.125, "worst": 0.25}
    after = TRUTH.text({first.metrics[0]: one}, before).splitlines()
    assert after[2] == first.text({first.metrics[0]: one})
    assert after[3:] == before.splitlines()[3:]


def test_the_command_fills_a_file_from_several_results(tmp_path: Path) -> None:
    readme, results = tmp_path / "PAGE.md", []
    readme.write_text(f"before\n{BEGIN}: x -->\nold\n{END}\n")
    rows = [{"name": name, **row} for name, row in ROWS.items()]
    for index, part in enumerate((rows, [{**rows[0], "n": 7}])):
        results.append(tmp_path / f"{index}.json")
        results[-1].write_text(json.dumps({"rows": part}))
    assert main(["evidence", str(readme), *map(str, results)]) == ExitCode.OK
    expected = TRUTH.text({**ROWS, rows[0]["name"]: {**rows[0], "n": 7}})
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
        TRUTH.text(short)
    with pytest.raises(ConfigError, match="the text has no"):
        filled("nothing here", ROWS)
    with pytest.raises(ConfigError, match="end --> after <!-- evidence:begin"):
        filled(f"{BEGIN} -->\n", ROWS)


@pytest.mark.parametrize(
    ("page", "mark", "table"),
    [
        (PAGE, BEGIN, TRUTH),
        (PAGE, SENSED_BEGIN, SENSED),
        (PAGE, BOTH_BEGIN, BOTH),
        (SPEED_PAGE, SPEED_BEGIN, SPEED),
    ],
)
def test_no_figure_of_the_page_is_blank(page: Path, mark: str, table: Table) -> None:
    text = page.read_text(encoding="utf-8")
    block = text[text.index(mark) : text.index(END, text.index(mark))]
    lines = [line for line in block.splitlines() if line.startswith("|")][2:]
    assert len(lines) == len(table.lines)
    for line in lines:
        cells = line.split("|")
        assert all(cell.strip() for cell in (cells[1], *cells[3:5])), line
