"""The table and the progress line of the demo fit their terminal and leave nothing out."""

import math
import sys

import pytest

from controller.cli.demo import render
from controller.cli.progress import ProgressLine, progress_bar
from controller.demo import DemoReport, DemoTotals, Measurement, StepResult, run_demo
from tests.controller.fake_go2 import FakeGo2

COLUMNS = 80
LONG_REASON = "fell at t=3.2 s: " + "roll 71 deg, " * 12
TOTALS = DemoTotals(0.44, 0.42, math.nan, math.nan, 0, 24.5, 8.2)


# --- the table ----------------------------------------------------------------------------------


def report_of(*steps: StepResult) -> DemoReport:
    return DemoReport(steps, TOTALS)


def test_the_table_fits_80_columns_whatever_happens() -> None:
    figure = Measurement("moved from the place", -123.456, "m/s", -12.0, 0.1)
    bad = StepResult("stand", "forward 0.2 m/s, 2 s", False, LONG_REASON, 0.0, 123.45, (figure,))
    for report in (report_of(bad), run_demo(FakeGo2())):
        for encoding in ("utf-8", "ascii"):
            lines = render(report, encoding).splitlines()
            assert max(map(len, lines)) <= COLUMNS


def test_the_table_marks_every_step_and_gives_the_reason_of_a_failure() -> None:
    report = run_demo(FakeGo2(refusals={"high_five": "the paw was not held at 0.62 m"}))
    text = render(report, "utf-8")
    assert text.count("✓") == 7
    assert text.count("✗") == 1
    assert "\n     the paw was not held at 0.62 m\n" in text
    assert "7 of 8 steps done." in text


def test_asked_and_measured_stand_side_by_side_with_their_unit() -> None:
    text = render(run_demo(FakeGo2(speed_share=0.95)), "utf-8")
    row = next(line for line in text.splitlines() if "mean speed" in line)
    assert row.split()[-3:] == ["0.200", "0.190", "m/s"]


def test_what_could_not_be_measured_is_a_dash() -> None:
    text = render(report_of(), "utf-8")
    assert "nan" not in text
    assert "least support margin   -" in text


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", None, "no-such-encoding"])
def test_a_terminal_without_ticks_gets_words(encoding: str | None) -> None:
    good = StepResult("sit", "sit", True, "done", 0.0, 1.0)
    text = render(report_of(good, StepResult("s", "s", False, "why", 0.0, 1.0)), encoding)
    assert "  ok sit" in text
    assert "FAIL s" in text
    assert text.isascii()


# --- the progress line --------------------------------------------------------------------------


def test_on_a_terminal_progress_is_one_line_in_place(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with ProgressLine() as line:
        line.update(0.5, "x" * 100)
        line.done("one piece")
    text = capsys.readouterr().err
    assert "\n" not in text
    assert "one piece" not in text
    shown = text.split("\x1b[2K")[1].rstrip("\r")
    assert len(shown) < 40
    assert text.endswith("\r\x1b[2K")


def test_while_something_is_solved_the_line_says_how_far_that_is(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with ProgressLine() as line:
        line.update(0.5, "checking sway")
        for iteration in range(1, 13):
            line.solving(iteration, 1234.5)
    shown = [part.rstrip("\r") for part in capsys.readouterr().err.split("\x1b[2K")]
    assert [text for text in shown if "solving" in text] == [
        f"{progress_bar(0.5)} checking sway: solving, iteration {n}, cost 1.23e+03"
        for n in (1, 6, 11)
    ]


@pytest.mark.parametrize(("is_terminal", "is_quiet"), [(False, False), (True, True)])
def test_into_a_pipe_or_beside_json_nothing_is_said_of_solving(
    is_terminal: bool,
    is_quiet: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    with ProgressLine(is_quiet=is_quiet) as line:
        line.update(0.5, "checking sway")
        line.solving(1, 1.0)
    assert capsys.readouterr().err == ""


def test_elsewhere_progress_is_one_line_for_each_finished_piece(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with ProgressLine() as line:
        line.update(0.5, "going on")
        line.done("1/2 stand: ok")
        line.done("2/2 sit: ok")
    assert capsys.readouterr().err == "1/2 stand: ok\n2/2 sit: ok\n"


@pytest.mark.parametrize(
    ("share", "filled"), [(-1.0, 0), (0.0, 0), (0.5, 10), (1.0, 20), (2.0, 20)]
)
def test_the_bar_is_filled_in_proportion(share: float, filled: int) -> None:
    assert progress_bar(share).count("#") == filled
