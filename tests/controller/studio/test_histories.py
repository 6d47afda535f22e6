"""Any history of edits: the file always is what it says, and all of it can be undone to the byte.

``GO2_WBC_HISTORIES=500 pytest tests/controller/studio/test_histories.py`` draws as many.
"""

import ast
import os

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from controller.studio.edits import PALETTE, edited
from controller.studio.literals import Run
from controller.studio.making import Made, Maker
from controller.studio.orders import Order
from controller.studio.project import Project
from controller.studio.source import Source
from go2_wbc.errors import StudioError, TimelineError
from tests.controller.studio.habits import FILES

HISTORIES = int(os.environ.get("GO2_WBC_HISTORIES", "5"))
LENGTH = 20  #: Edits of a history
LONGEST = 20  #: Bytes of a literal
OPS = (
    "set", "set", "set", "add", "delete", "duplicate", "insert", "swap",
    "unroll", "parameter", "pace", "undo", "redo", "theirs",
)  # fmt: skip

acts = st.tuples(st.sampled_from(OPS), st.integers(0, 10**6), st.floats(-0.2, 0.3))


def order_of(made: Made, data: bytes, op: str, pick: int, by: float) -> dict[str, object]:
    """What a page would ask for, of a bar of what the file says."""
    marks = [mark for mark in made.marks if mark.call.file.endswith("shown.py")]
    if not marks:
        return {"op": "begin", "title": list(PALETTE)[pick % len(PALETTE)]}
    call = marks[pick % len(marks)].call
    order = {"op": op, "site": list(call.site), "number": call.number, "callers": call.callers}
    slots = [
        slot
        for slot in Source(data).slots(call.site, Run(call.number, call.callers))
        if isinstance(slot.value, int | float)
    ]
    if op == "add":
        return {**order, "op": "set", "name": "z", "value": round(by / 10, 3)}
    if op in ("set", "parameter") and slots:
        slot = slots[pick // 7 % len(slots)]
        value = round(float(slot.value or 0.0) * (1.0 + by) + 0.001, 3)
        return {**order, "name": slot.name, "value": value}
    title = list(PALETTE)[pick % len(PALETTE)]
    return {**order, "title": title, "step": 1 - 2 * (pick % 2), "value": 1.0 + by, "name": "z"}


@settings(
    max_examples=HISTORIES,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    phases=[Phase.reuse, Phase.generate],
)
@given(st.sampled_from(sorted(FILES)), st.lists(acts, min_size=LENGTH, max_size=LENGTH))
def test_any_history_of_edits_can_be_undone(
    tmp_path_factory: pytest.TempPathFactory, habit: str, history: list[tuple[str, int, float]]
) -> None:
    file = tmp_path_factory.mktemp("history") / "shown.py"
    file.write_bytes(FILES[habit])
    project, maker = Project(file), Maker()

    def made(data: bytes) -> Made:
        return maker.make(Order(project.path, data, "shown", {}))

    shown = made(project.saved)
    for op, pick, by in history:
        before = project.saved
        if op == "theirs":
            file.write_bytes(before + b"# theirs\n")
            assert project.refresh()
        elif op in ("undo", "redo"):
            if getattr(project, f"can_{op}"):
                getattr(project, op)()
        else:
            try:
                order = order_of(shown, before, op, pick, by)
                after = edited(Source(before), order, "shown").data
                made(after)  # what is no motion is not saved
            except (StudioError, TimelineError):
                continue
            project.save(after)
            assert op != "set" or _changed(before, after) < LONGEST
        assert file.read_bytes() == project.saved
        ast.parse(project.saved)
        shown = made(project.saved)
    while project.can_undo:
        project.undo()
    assert file.read_bytes() == FILES[habit]


def _changed(before: bytes, after: bytes) -> int:
    """How many bytes lie between what has stayed ahead and what has stayed behind."""
    pairs = enumerate(zip(before, after, strict=False))
    ahead = next((k for k, (a, b) in pairs if a != b), min(len(before), len(after)))
    left, right = before[ahead:][::-1], after[ahead:][::-1]
    pairs = enumerate(zip(left, right, strict=False))
    return len(left) - next((k for k, (a, b) in pairs if a != b), min(len(left), len(right)))
