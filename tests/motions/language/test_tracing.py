"""Traced calls leave marks that follow their parts, and nothing else changes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from go2_wbc.legs import Leg
from motions import Timeline, find_motion, motion_names
from motions.language.tracing import ROBOT, TIME, TRUNK, Call, separated, traced


def _calls(line: Timeline) -> list[tuple[str, float, float, float, tuple[object, ...]]]:
    _, marks = separated(line)
    return [(one.call.name, one.start, one.move, one.end, one.parts) for one in marks]


def test_traced_motions_are_what_they_are() -> None:
    plain = {name: find_motion(name)() for name in motion_names()}
    with traced():
        for name, line in plain.items():
            assert separated(find_motion(name)())[0] == line


def test_outside_nothing_is_traced() -> None:
    before = Timeline.body
    with traced():
        assert Timeline.body is not before
    assert Timeline.body is before
    assert "body" not in vars(Timeline)
    assert "reverse" in vars(Timeline)
    assert separated(Timeline().hold(1.0))[1] == []


def test_a_mark_tells_what_moves_and_when() -> None:
    with traced():
        line = Timeline().body(z=-0.02, over=0.5).hold(0.25).foot("FR", z=0.08, over=0.5)
        line = line.home(over=1.0).jump(height=0.08)
    calls = _calls(line)
    assert [(name, parts) for name, *_, parts in calls] == [
        ("body", (TRUNK,)),
        ("hold", (TIME,)),
        ("foot", (Leg.FR,)),
        ("home", (Leg.FR, TRUNK)),
        ("jump", (ROBOT,)),
    ]
    _, start, move, end, _ = calls[2]
    assert (start, move, end) == pytest.approx((0.75, 0.75 + line.shift_time, 1.25 + 0.9))


@pytest.mark.parametrize(
    ("made", "spans"),
    [
        (lambda line: line.scale_time(2.0), [(0.0, 1.0), (1.0, 2.0)]),
        (lambda line: line.then(line), [(0.0, 0.5), (0.5, 1.0), (1.0, 1.5), (1.5, 2.0)]),
        (lambda line: line.reverse(), [(0.0, 0.5), (0.5, 1.0)]),
        (lambda line: Timeline().hold(3.0).at(2.0).together(line), [(2.0, 2.5), (2.5, 3.0)]),
    ],
)
def test_marks_go_with_what_they_mark(
    made: Callable[[Timeline], Timeline], spans: list[tuple[float, float]]
) -> None:
    with traced():
        line = made(Timeline().body(x=0.01, over=0.5).home(over=0.5))
    found = sorted(
        (start, end) for name, start, _, end, _ in _calls(line) if name in ("body", "home")
    )
    assert found == [pytest.approx(span) for span in spans]


def test_a_call_is_known_by_where_it_ends_and_how_often_it_ran() -> None:
    with traced():
        line = Timeline()
        for x in (0.01, 0.02):
            line = (
                line.body(x=x, over=0.5)
                .hold(0.1)
            )  # fmt: skip
    calls: list[Call] = [mark.call for mark in separated(line)[1]]
    assert [(call.name, call.number, call.arguments.get("x")) for call in calls] == [
        ("body", 0, 0.01),
        ("hold", 0, None),
        ("body", 1, 0.02),
        ("hold", 1, None),
    ]
    text = Path(__file__).read_text(encoding="utf-8").splitlines()
    for call in calls:
        line_number, column = call.site
        written = {"body": "body(x=x, over=0.5)", "hold": "hold(0.1)"}[call.name]
        assert text[line_number - 1][:column].endswith(f".{written}")


def test_calls_at_once_do_not_exclude_each_other() -> None:
    with traced():
        part = Timeline().hold(1.0)
        line = Timeline().together(part, part.mirror())
    assert [name for name, *_ in _calls(line)].count("hold") == 2
