"""What is computed is written out: the same motion, by calls that can all be edited in place."""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from controller.studio import making
from controller.studio.literals import Run
from controller.studio.making import Made, Maker
from controller.studio.orders import Order
from controller.studio.source import Source
from controller.studio.writing_out import written_out
from go2_wbc.errors import StudioError
from motions.language.keys import BodyKey
from tests.controller.studio.habits import FILES, HEAD

GESTURES = """from motions import Timeline


def sway(size: float) -> Timeline:
    return Timeline().body(y=size, over=0.5).home(over=0.5)


def dip(line: Timeline, *, deep: float) -> Timeline:
    return line.body(z=-deep, over=0.5).home(over=0.5)
"""
ROUNDING = 1e-9  #: m and rad: numbers are written without that of their sums


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    (tmp_path / "written_gestures.py").write_text(GESTURES, encoding="utf-8")
    yield tmp_path
    sys.modules.pop("written_gestures", None)
    if str(tmp_path) in sys.path:
        sys.path.remove(str(tmp_path))


def _made(order: Order) -> Made:
    return Maker().make(order)


def _out(path: Path, data: bytes, bar: int) -> Source:
    order = Order(path.resolve(), data, "shown", {})
    maker = Maker()
    after = written_out(Source(data), maker, order, made := maker.make(order), bar)
    now = maker.make(replace(order, data=after.data))
    assert len(now.marks) == len(made.marks)
    call = now.marks[bar].call
    assert call.file == str(order.path)
    assert all(slot.span for slot in after.slots(call.site, Run(call.number, call.callers)))
    keys = list(zip(made.line.keys, now.line.keys, strict=True))
    for old, new in keys:
        assert (old.track, old.start, old.end) == (
            new.track, pytest.approx(new.start), pytest.approx(new.end),
        )  # fmt: skip
        if isinstance(old, BodyKey) and isinstance(new, BodyKey):
            assert new.value == pytest.approx(old.value, rel=0.0, abs=ROUNDING)
    return after


def _file(body: str, head: str = HEAD) -> bytes:
    return (head + "@motion\ndef shown() -> Timeline:\n" + body).encode()


@pytest.mark.parametrize("habit", [one for one in FILES if one != "decorated"])
def test_each_bar_of_each_habit_is_written_out(habit: str, tmp_path: Path) -> None:
    data = FILES[habit]
    for bar in range(len(_made(Order(tmp_path / "a.py", data, "shown", {})).marks)):
        after = _out(tmp_path / "a.py", data, bar).data
        assert after.count(b"\r") == after.count(b"\n") * (b"\r\n" in data)
        first = data.index(b"@motion")
        assert after.replace(b", deg", b"")[: first - 5] == data.replace(b", deg", b"")[: first - 5]


@pytest.mark.parametrize(
    ("body", "bar", "after"),
    [
        # The arguments of one call, where that is enough.
        ("    a = [0.5, 0.7]\n    return Timeline().hold(0.2).home(over=sum(a) / 2)  # back\n", 1,
         "    a = [0.5, 0.7]\n    return Timeline().hold(0.2).home(over=0.6)  # back\n"),
        ("    kw = dict(zip(['z', 'over'], [-0.02, 0.5]))\n    return Timeline().body(**kw)\n", 0,
         "    kw = dict(zip(['z', 'over'], [-0.02, 0.5]))\n"
         "    return Timeline().body(z=-0.02, over=0.5)\n"),
        # A loop that goes round as it computes; what others need stays.
        ("    line = Timeline().hold(0.1)\n    for k in map(float, '12'):\n"
         "        # aside\n        line = line.body(yaw=deg(5) * k, over=0.5)\n"
         "    return line.home(over=0.5)\n", 1,
         "    line = Timeline().hold(0.1)\n    # aside\n"
         "    line = line.body(yaw=deg(5.0), over=0.5).body(yaw=deg(10.0), over=0.5)\n"
         "    return line.home(over=0.5)\n"),
        # In a loop nothing is written that would be done again in each round.
        ("    line = Timeline()\n    for z in map(float, ['-0.01', '-0.02']):\n"
         "        line = line.body(z=z, over=0.5)\n    return line\n", 0,
         "    line = Timeline()\n"
         "    line = Timeline().body(z=-0.01, over=0.5).body(z=-0.02, over=0.5)\n"
         "    return line\n"),
        # All of it, where its parts hang on each other.
        ("    parts = [Timeline().hold(k / 10) for k in map(int, '12')]\n"
         "    return parts[0].then(parts[1])\n", 0,
         "    return Timeline().hold(0.1).then(Timeline().hold(0.2))\n"),
    ],
)  # fmt: skip
def test_as_little_as_does_it_is_written(body: str, bar: int, after: str, tmp_path: Path) -> None:
    assert _out(tmp_path / "a.py", _file(body), bar).data == _file(after)


def test_what_other_files_make_is_written_here(folder: Path) -> None:
    head = "from written_gestures import dip, sway\nfrom motions import Timeline, motion\n\n\n"
    body = (
        "    line = dip(Timeline(), deep=0.03)  # low\n"
        "    return line.then(sway(0.02), sway(-0.02))\n"
    )
    data = _file(body, head)
    assert _out(folder / "a.py", data, 0).data == _file(
        "    line = Timeline().body(z=-0.03, over=0.5).home(over=0.5)  # low\n"
        "    return line.then(sway(0.02), sway(-0.02))\n",
        head,
    )
    assert _out(folder / "a.py", data, 3).data == _file(
        "    line = dip(Timeline(), deep=0.03)  # low\n    return line.then(\n"
        "        Timeline().body(y=0.02, over=0.5).home(over=0.5),\n"
        "        Timeline().body(y=-0.02, over=0.5).home(over=0.5),\n    )\n",
        head,
    )


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    soft = _file(
        "    return Timeline().body(z=-0.01, over=0.5, ease=[soft][0])\n",
        HEAD + "def soft(t: float) -> float:\n    return t\n\n\n",
    )
    with pytest.raises(StudioError, match=r"ease is <function soft .*cannot be written out"):
        _out(tmp_path / "a.py", soft, 0)
    twice = """def twice(f):
    def inner():
        return f().repeat(len("ab"))
    inner.__name__ = f.__name__
    return inner


@motion
@twice
"""
    data = _file("    return Timeline().hold(0.5)\n").replace(b"@motion\n", twice.encode())
    marks = _made(Order((tmp_path / "a.py").resolve(), data, "shown", {})).marks
    (repeat,) = (bar for bar, mark in enumerate(marks) if mark.call.name == "repeat")
    with pytest.raises(StudioError, match="outside of the motion's own function"):
        _out(tmp_path / "a.py", data, repeat)


def test_a_text_that_is_tried_and_never_ends_is_left(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the ``pop`` the loop goes on: the process hung until it was killed after 120 s."""
    body = (
        "    left, start = [0.5], Timeline()\n    while left:\n"
        "        line = start.hold(left.pop())\n    return line\n"
    )
    monkeypatch.setattr(making, "LONGEST_RUN", 0.5)
    after = _out(folder / "a.py", _file(body), 0)
    assert "while" not in after.data.decode()
