"""Files in many habits are edited in place: what is said to be editable is, and nothing else."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from controller.studio.literals import Run
from controller.studio.source import Slot, Source
from go2_wbc.errors import TimelineError
from motions.language.tracing import CallMark, separated, traced
from motions.registry import load_text
from tests.controller.studio.habits import FILES

FILE = Path("shown.py")
EDITABLE = 0.8  #: Least share of bars of which every argument can be edited


def marks_of(data: bytes) -> list[CallMark]:
    with traced():
        marks = separated(load_text(FILE, data)["shown"]())[1]
    return [mark for mark in marks if mark.call.file == str(FILE.resolve())]


def run_of(mark: CallMark) -> Run:
    return Run(mark.call.number, mark.call.callers)


def slots_of(data: bytes, mark: CallMark) -> list[Slot]:
    return Source(data).slots(mark.call.site, run_of(mark))


def _given(mark: CallMark, slot: Slot) -> str:
    def plain(value: object) -> object:
        if isinstance(value, Mapping):
            return list(value.values())
        return list(value) if isinstance(value, tuple | list) else value

    return repr(plain(mark.call.arguments.get(slot.of)))


def test_most_bars_can_be_edited_in_every_argument_and_the_others_say_why() -> None:
    bars = editable = 0
    for data in FILES.values():
        for mark in marks_of(data):
            slots = slots_of(data, mark)
            bars, editable = bars + 1, editable + all(slot.span is not None for slot in slots)
            assert all(slot.why for slot in slots if slot.span is None)
    assert bars > 140
    assert editable / bars >= EDITABLE


@pytest.mark.parametrize("habit", FILES)
def test_an_edit_touches_its_span_and_moves_what_it_says(habit: str) -> None:
    data, edits = FILES[habit], 0
    marks = marks_of(data)
    for index, mark in enumerate(marks):
        for slot in slots_of(data, mark):
            if slot.span is None or not isinstance(slot.value, int | float):
                continue
            new = round(1.1 * slot.value + 0.01, 4)
            after = Source(data).set(mark.call.site, slot.name, new, run_of(mark)).data
            start, end = slot.span
            assert (after[:start], after[len(after) - len(data) + end :]) == (
                data[:start],
                data[end:],
            )
            edits += 1
            try:
                again = marks_of(after)
            except TimelineError:
                continue  # the language says no: it is not written then
            if slot.value and "*" not in slot.code and " if " not in slot.code:
                assert _given(again[index], slot) != _given(mark, slot), (slot, mark.call)
    assert edits
