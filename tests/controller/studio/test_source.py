"""Edits of a file touch only their span; what cannot be edited says why."""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from controller.studio.edits import PALETTE, edited
from controller.studio.layout import LONGEST_LINE
from controller.studio.literals import Run
from controller.studio.source import Slot, Source, written
from controller.studio.syntax import Site
from go2_wbc.errors import StudioError
from motions import find_motion, motion_names
from motions.language.tracing import CallMark, separated, traced
from motions.registry import load_text

FILE = b'''"""Bows."""

from motions import Timeline, deg, motion

DEEP, HIGH = -0.03, 0.08  # m
SIDES = ("FL", "FR")


@motion
def greet() -> Timeline:
    """Greet."""
    line = (
        Timeline()
        .body(pitch=deg(12.0), z=DEEP, over=0.80)  # the bow
        # then rest
        .hold(0.4)
        .home(over=1)
    )
    for foot in SIDES:
        line = line.foot(foot, z=HIGH, over=0.5).down(foot, over=0.5)
    for yaw in (10.0, -10.0):
        line = line.body(yaw=deg(yaw), over=0.3)
    line = line.body(yaw=0.0, over=2 * 0.25)
    return line.home(over=0.6)
'''


def _sites(data: bytes, name: str = "greet") -> list[tuple[CallMark, Site]]:
    with traced():
        marks = separated(load_text(Path("greet.py"), data)[name]())[1]
    return [(mark, mark.call.site) for mark in marks]


def _site(data: bytes, call: str, number: int = 0) -> Site:
    return [site for mark, site in _sites(data) if mark.call.name == call][number]


def run_of(mark: CallMark) -> Run:
    return Run(mark.call.number, mark.call.callers)


def _numbers(data: bytes) -> str:
    """The text as Python reads it: 0.80 is 0.8."""
    return ast.dump(ast.parse(data))


def _changed(before: bytes, after: bytes) -> list[tuple[bytes, bytes]]:
    rows = zip(before.splitlines(keepends=True), after.splitlines(keepends=True), strict=True)
    return [(old, new) for old, new in rows if old != new]


def test_a_number_is_replaced_where_it_stands() -> None:
    source, site = Source(FILE), _site(FILE, "body")
    ((old, new),) = _changed(FILE, source.set(site, "over", 0.9).data)
    assert new == old.replace(b"over=0.80", b"over=0.9")
    ((old, new),) = _changed(FILE, source.set(site, "pitch", 15.5).data)
    assert new == old.replace(b"12.0", b"15.5")
    ((_, new),) = _changed(FILE, source.set(site, "z", -0.045).data)
    assert new == b"DEEP, HIGH = -0.045, 0.08  # m\n", "where the name gets its value"
    ((_, new),) = _changed(FILE, source.set(_site(FILE, "home"), "over", 2).data)
    assert new.strip() == b".home(over=2)"


def test_a_number_of_a_dictionary_is_replaced_in_it() -> None:
    text = FILE.replace(b"DEEP, HIGH = -0.03, 0.08  # m", b"Z = {'high': 0.08, 'deep': -0.03}")
    text = text.replace(b"z=DEEP", b"z=Z['deep']").replace(b"z=HIGH", b"z=Z['high']")
    ((_, new),) = _changed(text, Source(text).set(_site(text, "body"), "z", -0.045).data)
    assert new == b"Z = {'high': 0.08, 'deep': -0.045}\n"


def test_slots_tell_values_units_and_places() -> None:
    source = Source(FILE)
    pitch, z, over = source.slots(_site(FILE, "body"))
    assert (pitch.value, pitch.is_angle, z.value, z.place) == (12.0, True, -0.03, "DEEP, line 5")
    assert (over.name, over.value, over.is_angle) == ("over", 0.8, False)
    leg, *_ = source.slots(_site(FILE, "foot", 1), Run(1))
    assert (leg.value, leg.place) == ("FR", "foot, line 6")
    _, over, other = source.slots(_site(FILE, "body", 3))
    assert (over.name, over.value, over.place) == ("over", 2, "in 2 * 0.25")
    assert (other.name, other.value, other.of) == ("over: 2. in 2 * 0.25", 0.25, "over")
    (yaw, _), (other, _) = (source.slots(_site(FILE, "body", k + 1), Run(k)) for k in (0, 1))
    assert (yaw.value, other.value) == (10.0, -10.0), "one element for each run of the loop"
    ((_, new),) = _changed(FILE, source.set(_site(FILE, "body", 2), "yaw", -20.0, Run(1)).data)
    assert b"(10.0, -20.0)" in new


def test_behind_a_starred_argument_no_place_is_known() -> None:
    text = FILE.replace(b".hold(0.4)", b".foot(*SIDES, 0.3, over=0.4)")
    source = Source(text)
    slots = source.slots(source.syntax.site(text.index(b"0.4)") + 4))
    assert [slot.of for slot in slots] == ["*", "over"]


OWN = FILE.replace(
    b"@motion",
    b"""class Style:
    over = 0.7
    def __init__(self, over=0.6):
        self.over = over
        self.twice = 0.1
        self.twice = 0.2

STYLE = Style(0.4)

@motion""",
)


@pytest.mark.parametrize(("field", "value"), [("over", 0.4), ("twice", None)])
def test_a_field_has_the_value_that_init_gives_it_once(field: str, value: float | None) -> None:
    text = OWN.replace(b".hold(0.4)", f".hold(STYLE.{field})".encode())
    (slot,) = Source(text).slots(_site(text, "hold"))
    assert slot.value == value


@pytest.mark.parametrize("loop", ["yaw in YAWS.values()", "_, yaw in YAWS.items()"])
def test_a_loop_over_a_dictionary_has_its_values(loop: str) -> None:
    text = FILE.replace(b"SIDES =", b"YAWS = {'left': 10.0, 'right': -10.0}\nSIDES =")
    text = text.replace(b"yaw in (10.0, -10.0)", loop.encode())
    sites = [_site(text, "body", k + 1) for k in (0, 1)]
    slots = [Source(text).slots(site, Run(k))[0] for k, site in enumerate(sites)]
    assert [slot.value for slot in slots] == [10.0, -10.0]


def test_what_has_several_values_is_left_alone() -> None:
    text = FILE.replace(b"DEEP, HIGH", b"DEEP = 1.0\nDEEP, HIGH")
    site = _site(text, "body")
    slot = next(slot for slot in Source(text).slots(site) if slot.name == "z")
    assert slot.span is None
    with pytest.raises(StudioError, match="z is DEEP: DEEP has more than one value"):
        Source(text).set(site, "z", 0.1)


def test_arguments_are_added_in_the_units_of_authors() -> None:
    source, site = Source(FILE), _site(FILE, "body")
    ((_, new),) = _changed(FILE, source.set(site, "yaw", 5.0).data)
    assert b"over=0.80, yaw=deg(5.0))  # the bow" in new
    bare = FILE.replace(b", deg,", b",").replace(b"deg(12.0)", b"0.2").replace(b"deg(yaw)", b"0.1")
    ((_, new),) = _changed(bare, Source(bare).set(_site(bare, "body"), "yaw", 5.0).data)
    assert b"over=0.80, yaw=0.0873)" in new, "deg is not known there"
    with pytest.raises(StudioError, match="sideways"):
        source.set(site, "sideways", 1.0)


def test_a_call_is_deleted_and_comments_of_others_stay() -> None:
    data = Source(FILE).delete(_site(FILE, "hold")).data
    assert data == FILE.replace(b"        .hold(0.4)\n", b"")
    data = Source(FILE).delete(_site(FILE, "body")).data
    assert data == FILE.replace(
        b"        .body(pitch=deg(12.0), z=DEEP, over=0.80)  # the bow\n", b""
    )
    data = Source(FILE).delete(_site(FILE, "body", 3)).data
    assert data == FILE.replace(b"    line = line.body(yaw=0.0, over=2 * 0.25)\n", b"")
    data = Source(FILE).delete(_site(FILE, "body", 1)).data
    assert b"in (10.0, -10.0):\n        pass\n" in data, "a loop is not left empty"


def test_a_call_is_made_again_moved_and_followed_by_another() -> None:
    source = Source(FILE)
    data = source.duplicate(_site(FILE, "hold")).data
    assert data == FILE.replace(b"        .hold(0.4)\n", 2 * b"        .hold(0.4)\n")
    data = source.swap(_site(FILE, "hold"), 1).data
    assert b"        .home(over=1)\n        .hold(0.4)\n    )" in data
    data = source.swap(_site(FILE, "hold"), -1).data
    assert data.index(b".hold(0.4)") < data.index(b".body(pitch=deg(12.0), z=DEEP, over=0.80)  #")
    data = source.insert(_site(FILE, "body"), ".hold(1.0)").data
    assert b"# the bow\n        .hold(1.0)\n        # then rest\n        .hold(0.4)" in data
    data = source.insert(_site(FILE, "foot"), ".hold(1.0)").data
    assert b"over=0.5).hold(1.0).down(foot" in data
    with pytest.raises(StudioError, match="first call of its chain"):
        source.swap(_site(FILE, "foot"), -1)


def test_an_insert_that_makes_a_line_long_gets_its_own() -> None:
    data = FILE
    for _ in range(3):
        data = Source(data).insert(_site(data, "body", 3), ".home(over=0.25)").data
    first = b"    line = line.body(yaw=0.0, over=2 * 0.25)"
    assert data == FILE.replace(first, first + 3 * b".home(over=0.25)")
    data = Source(data).insert(_site(data, "home", 3), ".hold(0.25)").data
    assert first + 3 * b".home(over=0.25)" + b"\n    line = line.hold(0.25)\n" in data


@pytest.mark.parametrize("op", ["set", "add", "duplicate", "insert", "earlier", "later"])
def test_an_edit_tells_where_its_call_stands_then(op: str) -> None:
    source, site = Source(FILE), _site(FILE, "hold")
    after = {
        "set": lambda: source.set(site, "seconds", 10.25),
        "add": lambda: source.set(site, "name", "here"),
        "duplicate": lambda: source.duplicate(site),
        "insert": lambda: source.insert(site, ".hold(9.0)"),
        "earlier": lambda: source.swap(site, -1),
        "later": lambda: source.swap(site, 1),
    }[op]()
    assert after.site is not None
    line, column = after.site
    text = after.data.splitlines()[line - 1][:column].strip()
    new = {"set": b".hold(10.25)", "add": b'.hold(0.4, name="here")', "insert": b".hold(9.0)"}
    assert text == new.get(op, b".hold(0.4)")
    assert after.slots(after.site)


def test_a_change_is_appended_to_what_is_returned() -> None:
    data = Source(FILE).append("greet", ".scale(0.9)").data
    assert data == FILE.replace(b"line.home(over=0.6)\n", b"line.home(over=0.6).scale(0.9)\n")
    chain = FILE.replace(
        b"line.home(over=0.6)\n", b"(\n        line\n        .home(over=0.6)\n    )\n"
    )
    data = Source(chain).append("greet", ".scale(0.9)").data
    assert data == chain.replace(
        b".home(over=0.6)\n    )", b".home(over=0.6)\n        .scale(0.9)\n    )"
    )
    wide = FILE.replace(b"return line", b"return line" + b".hold(0.25)" * 6)
    data = Source(wide).append("greet", ".scale(0.9)").data
    assert max(map(len, data.splitlines())) <= LONGEST_LINE
    twice = FILE.replace(b"    line = (", b"    if False:\n        return Timeline()\n    line = (")
    with pytest.raises(StudioError, match="returns in 2 places"):
        Source(twice).append("greet", ".scale(0.9)")


@pytest.mark.parametrize(
    "layout",
    [
        lambda data: data.replace(b"\n", b"\r\n"),
        lambda data: b"\xef\xbb\xbf" + data,
        lambda data: data.replace(b"    ", b"\t"),
        lambda data: data.replace(b"the bow", "der Bückling ".encode()),
        lambda data: data.replace(b"Timeline()\n", b"Timeline() \\\n"),
        lambda data: data.replace(b"(\n        Timeline()", b"((\n        Timeline())  # )"),
    ],
    ids=["CRLF", "byte order mark", "tabs", "umlaut", "backslash", "brackets"],
)
def test_layouts_stay(layout: Callable[[bytes], bytes]) -> None:
    data = layout(FILE)
    for mark, site in _sites(data):
        for slot in Source(data).slots(site, run_of(mark)):
            if isinstance(slot.value, float):
                after = Source(data).set(site, slot.name, slot.value + 0.25, run_of(mark)).data
                assert len(_changed(data, after)) == 1
    site = _site(data, "hold")
    again = Source(Source(data).duplicate(site).data).delete(site).data
    assert again == data


def test_what_is_no_python_says_the_line() -> None:
    with pytest.raises(StudioError, match="line 10"):
        Source(FILE.replace(b"def greet()", b"def greet("))
    with pytest.raises(StudioError, match="the file has changed"):
        Source(FILE).slots((2, 0))


@pytest.mark.parametrize(
    ("value", "before", "text"),
    [(0.30000001, "0.25", "0.3"), (2, "1", "2"), (1.5, "1", "1.5"), (-0.0, "0.5", "0.0")],
)
def test_numbers_are_written_as_people_do(value: float, before: str, text: str) -> None:
    assert written(value, before) == text


@pytest.mark.parametrize(
    "order",
    [
        {"op": "insert", "site": [14, 49], "title": '__import__("os")'},
        {"op": "set", "site": [14, 49], "name": "over", "value": '0.1); import os; ("'},
        {"op": "set", "site": [14, 49], "name": "x=exec('1')", "value": 1.0},
        {"op": "set", "site": [14, 49], "name": "over", "value": True},
        {"op": "exec", "site": [14, 49]},
        {"op": "delete", "site": "all"},
    ],
)
def test_no_code_comes_from_a_page(order: dict[str, object]) -> None:
    with pytest.raises(StudioError):
        edited(Source(FILE), order)


def test_every_move_of_the_palette_is_a_call_of_the_language() -> None:
    for title, template in PALETTE.items():
        after = edited(Source(FILE), {"op": "insert", "site": [16, 18], "title": title}).data
        assert template.code(Source(FILE)).encode() in after


def _library() -> Iterator[tuple[bytes, CallMark, list[Slot]]]:
    for name in motion_names():
        file = Path(find_motion(name).source.rpartition(":")[0]).resolve()
        data = file.read_bytes()
        with traced():
            marks = separated(load_text(file, data)[name]())[1]
        source = Source(data)
        for mark in marks:
            if mark.call.file == str(file):
                yield data, mark, source.slots(mark.call.site, run_of(mark))


def test_the_library_can_be_edited_one_line_at_a_time() -> None:
    bars = editable = 0
    done, sources = set[tuple[bytes, Site]](), dict[bytes, Source]()
    for data, mark, slots in _library():
        bars, editable = bars + 1, editable + all(slot.span is not None for slot in slots)
        assert all(slot.why for slot in slots if slot.span is None)
        if (data, mark.call.site) in done:
            continue
        done.add((data, mark.call.site))
        if data not in sources:
            sources[data] = Source(data)
        for slot in slots:
            if isinstance(slot.value, float):
                site, run = mark.call.site, run_of(mark)
                source = sources[data]
                same = source.set(site, slot.name, slot.value, run).data
                assert same == data or _numbers(same) == _numbers(data)
                assert len(_changed(data, source.set(site, slot.name, 0.123, run).data)) == 1
    assert bars > 500
    assert editable / bars > 0.95


@pytest.mark.parametrize(
    ("text", "after"),
    [
        (
            "line = line.hold(0.1).home(over=1)  # last",
            "line = line.home(over=1).hold(0.1)  # last",
        ),
        (
            "line = (line.hold(0.1)  # one\n    .home(over=1)  # two\n)",
            "line = (line.home(over=1)  # one\n    .hold(0.1)  # two\n)",
        ),
        (
            "line = (line\n    .hold(0.1)  # one\n    .home(over=1).body(z=0.0, over=1)\n)",
            "line = (line\n    .home(over=1)  # one\n    .hold(0.1).body(z=0.0, over=1)\n)",
        ),
    ],
)
def test_no_comment_swallows_a_call_that_is_moved(text: str, after: str) -> None:
    source = Source(text.encode())
    moved = source.swap(source.syntax.site(text.index(")") + 1), 1)
    assert moved.data.decode() == after
    assert moved.text(moved.site or (0, 0)) == ".hold(0.1)"


@pytest.mark.parametrize(
    ("call", "after"),
    [
        (".body(z=-0.03, over=(t := 0.6))", ".body(z=-0.03, over=(t := 0.6), x=0.02)"),
        (".body(over=((0.6)\n),  # )\n)", ".body(over=((0.6)\n), x=0.02,  # )\n)"),
        (".body()", ".body(x=0.02)"),
    ],
)
def test_an_argument_is_added_behind_the_brackets_of_the_last(call: str, after: str) -> None:
    text = f"line = Timeline(){call}"
    source = Source(text.encode())
    added = source.set(source.syntax.site(len(text)), "x", 0.02)
    assert added.data.decode() == f"line = Timeline(){after}"
    assert added.text(added.site or (0, 0)) == after


@pytest.mark.parametrize(
    ("imports", "degrees"),
    [
        ("from motions import Timeline as TL, deg as d, motion", "d"),
        ("import motions as m\nfrom motions import Timeline as TL, motion", "m.deg"),
        ("from motions import *\nTL = Timeline", "deg"),
    ],
)
def test_degrees_are_called_what_the_file_calls_them(imports: str, degrees: str) -> None:
    text = f"{imports}\n\n\n@motion\ndef shown():\n    return TL().body(yaw={degrees}(4), over=1.0)"
    source = Source(text.encode())
    (slot, _) = source.slots(site := source.syntax.site(len(text)))
    assert slot.is_angle
    added = source.set(site, "pitch", 10.0)
    assert added.data.decode() == f"{text[:-1]}, pitch={degrees}(10.0))"


@pytest.mark.parametrize(
    ("head", "coding", "why"),
    [
        ("# -*- coding: latin-1 -*-", "latin-1", "line 2: it is no UTF-8"),
        ("# -*- coding: latin-1 -*-", "utf-8", "says that it is iso-8859-1"),
        ("# none", "cp1252", "line 2: it is no UTF-8"),
    ],
)
def test_what_is_not_utf_8_is_not_edited(head: str, coding: str, why: str) -> None:
    """Python counts in bytes of UTF-8: in another coding a number would go beside its place."""
    text = f"{head}\nline = Timeline().hold(0.2, name='gr\u00fcn').hold(0.3)\n"
    with pytest.raises(StudioError, match=why):
        Source(text.encode(coding))
    assert Source(text.replace("\u00fc", "ue").encode(coding)).slots((2, 41))


def _inserted(text: str, call: str, code: str, number: int = 0) -> str:
    data = f"from motions import Timeline, motion\n\n\n@motion\ndef greet():\n{text}".encode()
    after = Source(data).insert(_site(data, call, number), code)
    assert after.site is not None
    assert after.text(after.site) == code, "what was made is known by its place"
    return after.data.decode().partition("def greet():\n")[2]


LONG = "Timeline().body(z=-0.02, over=0.6).body(z=0.02, over=0.6).hold(0.25).home(over=0.6)"


def test_what_makes_a_line_long_goes_into_brackets() -> None:
    assert _inserted(f"    return {LONG}\n", "home", ".hold(0.5)") == (
        f"    return (\n        {LONG}\n        .hold(0.5)\n    )\n"
    )
    before, behind = LONG[: LONG.index(".hold")], LONG[LONG.index(".hold") :]
    assert _inserted(f"    return {LONG}  # all\n", "body", ".body(x=0.01, over=0.5)", 1) == (
        f"    return (\n        {before}\n        .body(x=0.01, over=0.5){behind}\n    )  # all\n"
    )
    assert _inserted("    return Timeline().home(over=0.6)\n", "home", ".hold(0.5)") == (
        "    return Timeline().home(over=0.6).hold(0.5)\n"
    ), "there is room"


def test_what_is_in_brackets_goes_on_in_them() -> None:
    inside = f"    return (\n        {LONG}\n    )\n"
    assert _inserted(inside, "home", ".hold(0.5)") == inside.replace(
        LONG, f"{LONG}\n        .hold(0.5)"
    )
    beside = f"    return Timeline().then({LONG})\n"
    assert _inserted(beside, "home", ".hold(0.5)") == beside.replace(
        LONG, f"{LONG}\n        .hold(0.5)"
    )
    assign = f"    line = ({LONG})\n    return line\n"
    assert _inserted(assign, "home", ".hold(0.5)") == assign.replace(
        LONG, f"{LONG}\n        .hold(0.5)"
    )
    chained = f"    line = {LONG}  # all\n    return line\n"
    assert _inserted(chained, "home", ".body(y=0.01, over=0.5)") == chained.replace(
        "# all\n", "# all\n    line = line.body(y=0.01, over=0.5)\n"
    )


def test_twenty_moves_from_the_palette_make_no_long_line() -> None:
    data = FILE
    alone = [title for title in PALETTE if title not in ("Raise a foot", "Put a foot down")]
    for title in [*alone, *alone][:20]:
        site = _sites(data)[-1][1]
        data = edited(Source(data), {"op": "insert", "site": list(site), "title": title}).data
    assert max(map(len, data.splitlines())) <= LONGEST_LINE
    assert len(_sites(data)) > len(_sites(FILE)) + 20


@pytest.mark.parametrize(("leg", "rest"), [("FR", ".hold(0.1)"), ("FL", "")])
def test_a_foot_that_is_raised_again_stands_before(leg: str, rest: str) -> None:
    lifted = b'.foot("FR", z=0.06, over=1).down("FR", over=1)'
    data = FILE.replace(b".hold(0.4)", lifted)
    order = {"op": "insert", "title": "Raise a foot", "values": {"leg": leg}}
    after = edited(Source(data), {**order, "site": list(_site(data, "down"))}).data
    raised = f'{rest}.foot("{leg}", z=0.08, over=0.5)'
    assert after == data.replace(lifted, lifted + raised.encode())
