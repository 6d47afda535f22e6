"""Loops are written out and numbers become parameters: the same motion, in one span of the text."""

from pathlib import Path

import pytest

from controller.studio.edits import edited
from controller.studio.literals import Run
from controller.studio.rewriting import offers
from controller.studio.source import Source
from go2_wbc.errors import StudioError, TimelineError
from motions import Motion, Range, Timeline
from motions.language.tracing import CallMark, separated, traced
from motions.registry import load_text
from tests.controller.studio.habits import FILES, HEAD

FILE = Path("shown.py")


def motion_of(data: bytes) -> Motion:
    return load_text(FILE, data)["shown"]


def traced_of(data: bytes) -> tuple[Timeline, list[CallMark]]:
    with traced():
        line, marks = separated(motion_of(data)())
    return line, [mark for mark in marks if mark.call.file == str(FILE.resolve())]


def order_of(mark: CallMark, op: str, **more: object) -> dict[str, object]:
    call = mark.call
    return {
        "op": op,
        "site": list(call.site),
        "number": call.number,
        "callers": call.callers,
        **more,
    }


@pytest.mark.parametrize("habit", FILES)
def test_what_is_written_out_is_the_same_motion(habit: str) -> None:
    data = FILES[habit]
    line, marks = traced_of(data)
    for mark in marks:
        try:
            after = edited(Source(data), order_of(mark, "unroll"), "shown").data
        except StudioError:
            continue
        assert motion_of(after)().keys == line.keys, after.decode()
        assert after.startswith(data[: data.index(b"for ")])
        again = traced_of(after)[1]
        assert len({(one.call.site, one.call.number) for one in again}) == len(again)
        sites = len({one.call.site for one in again})
        assert sites > len({one.call.site for one in marks}), "each round has bars of its own"


def test_loops_are_written_out_with_their_layout() -> None:
    data = FILES["tabs"].replace(
        b"\tline = line.hold(0.4)\n",
        b"\tfor deep, t in ((-0.02, 1), (0.0, 2)):  # twice\n"
        b"\t\t# down and up\n\t\tline = line.body(\n\t\t\tz=deep, over=t * 0.5)\n",
    )
    (mark, *_) = (
        mark
        for mark in traced_of(data)[1]
        if "z" in mark.call.arguments and mark.call.name == "body"
    )
    after = edited(Source(data), order_of(mark, "unroll")).data
    assert (
        b"\t# down and up\n\tline = line.body(\n\t\tz=(-0.02), over=1 * 0.5)\n"
        b"\t# down and up\n\tline = line.body(\n\t\tz=0.0, over=2 * 0.5)\n"
    ) in after


@pytest.mark.parametrize(
    ("loop", "why"),
    [
        ("for z in (0.1, 0.2):\n        if z > 0.1:\n            break\n        ", "is left"),
        ("for z in make():\n        ", "goes round as make\\(\\) says"),
        ("for z in (0.1, 0.2):\n        z = z / 2\n        ", "z is set in the loop"),
        ("for z in (0.1, 0.2):\n        print(f'{z}')\n        ", "in a text"),
        ("if True:\n        ", "in no loop"),
    ],
)
def test_a_loop_that_is_more_than_its_rounds_stays(loop: str, why: str) -> None:
    text = (
        "from motions import Timeline, motion\n\n\ndef make():\n    return (0.1, 0.2)\n\n\n"
        "@motion\ndef shown():\n    line, z = Timeline(), 0.1\n    "
        f"{loop}line = line.body(z=-z / 10, over=0.5)\n    return line.home(over=0.5)\n"
    ).encode()
    (mark, *_) = (mark for mark in traced_of(text)[1] if mark.call.name == "body")
    with pytest.raises(StudioError, match=why):
        edited(Source(text), order_of(mark, "unroll"))


def test_a_text_without_the_name_of_the_loop_does_not_keep_it() -> None:
    text = FILES["nested loops"].replace(b"over=0.4)", b"over=float(f'{0.4}'))")
    (mark, *_) = (mark for mark in traced_of(text)[1] if mark.call.name == "foot")
    assert b"height in" not in edited(Source(text), order_of(mark, "unroll"), "shown").data


def test_a_loop_whose_name_is_used_behind_it_stays() -> None:
    text = FILES["semicolons"].replace(b"over=0.5)\n", b"over=0.5).body(x=z, over=0.5)\n")
    (mark, *_) = (m for m in traced_of(text)[1] if m.call.site[0] == 7)
    with pytest.raises(StudioError, match="used after the loop, line 8"):
        edited(Source(text), order_of(mark, "unroll"))


@pytest.mark.parametrize("habit", FILES)
def test_a_parameter_is_the_same_motion_and_moves_it(habit: str) -> None:
    data, made = FILES[habit], 0
    line, marks = traced_of(data)
    for mark in marks:
        run = Run(mark.call.number, mark.call.callers)
        for slot in Source(data).slots(mark.call.site, run):
            order = order_of(mark, "parameter", name=slot.name)
            try:
                after = edited(Source(data), order, "shown").data
            except StudioError:
                continue
            motion = motion_of(after)
            assert motion().keys == line.keys
            new = motion.parameters[-1]
            assert new.default == slot.value
            assert isinstance(new.valid, Range)
            if " if " in slot.code:  # of a choice it may be the other value
                continue
            try:
                other = motion(**{new.name: new.valid.high})
            except TimelineError:  # the language says no to this number
                continue
            assert (other.keys, other.end) != (line.keys, line.end), slot
            made += 1
    assert bool(made) == (habit != "decorated")


def test_the_pace_of_the_whole_is_changed_by_a_call() -> None:
    data = FILES["one chain"]
    after = edited(Source(data), {"op": "pace", "value": 1.5}, "shown").data
    assert after.count(b".scale_time(1.5)") == 1
    assert motion_of(after)().end == pytest.approx(1.5 * motion_of(data)().end)
    with pytest.raises(StudioError, match="needs a number"):
        edited(Source(data), {"op": "pace", "value": "os"}, "shown")


def test_a_motion_without_calls_is_begun() -> None:
    data = HEAD.encode() + b"@motion\ndef shown():\n    return Timeline()\n"
    source = edited(Source(data), {"op": "begin", "title": "Tilt the trunk"}, "shown")
    assert b"return Timeline().body(pitch=deg(10.0), over=0.6)\n" in source.data
    assert source.slots(source.site or (0, 0))
    with pytest.raises(StudioError, match="move"):
        edited(Source(data), {"op": "begin", "title": "exec"}, "shown")


def test_what_is_offered_can_be_done() -> None:
    for data in FILES.values():
        for mark in traced_of(data)[1]:
            run = Run(mark.call.number, mark.call.callers)
            for offer in offers(Source(data), "shown", mark.call.site, run):
                if offer["op"] == "write_out":  # see test_writing_out
                    continue
                order = order_of(mark, offer["op"], name=offer.get("name"), value=1.2)
                assert edited(Source(data), order, "shown").data != data


def test_callers_are_places_and_numbers() -> None:
    data = FILES["helper"]
    (mark, *_) = traced_of(data)[1]
    for callers in ("all", [[1, 2]], [[[1, "x"], 0]], [[[1, 2], 0]] * 21):
        given = {"callers": callers}
        with pytest.raises(StudioError):
            edited(Source(data), {**order_of(mark, "set", name="over", value=0.3), **given})
