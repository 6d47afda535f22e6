"""The nearest motion that the robot can do, as a proposal: found, told, taken; or why none is."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

from controller.studio.jumping import Jumps
from controller.studio.nearness import asking, distance
from controller.studio.orders import AT_ONCE, STOPPED, Order, Task, TooLong
from controller.studio.session import Studio
from controller.studio.source import Source
from go2_wbc.errors import StudioError
from motions import Timeline
from motions.feasibility.goal_errors import Departure
from motions.registry import load_text
from tests.viz.page_reader import read_message, read_pack

HEAD = '''"""Sways."""

from motions import Posture, Timeline, motion


@motion
def sway() -> Timeline:
    """Sway, too fast."""
'''
SWAY = f"""{HEAD}    line = Timeline().hold(0.2).body(y=0.06, over=0.2).body(y=-0.06, over=0.2)
    return line.home(over=0.3).hold(0.3)
"""
ASKED = SWAY.replace("Timeline().", 'Timeline(physics="nearest").')
AWAY = f"{HEAD}    return Timeline().body(y=0.05, over=0.25).body(y=-0.05, over=0.3)\n"
NEVER = 0.0617  #: m, of a sway whose nearest motion nobody finds
LONG = 60.0  #: s, of which a thread needs a few milliseconds
HELPED = '''

def begun() -> Timeline:
    return Timeline()


@motion
def other() -> Timeline:
    """Another one."""
    return begun().hold(1.0)
'''


def _asking(text: str) -> str:
    source = Source(text.encode())

    def does_ask(after: Source) -> bool:
        return load_text(Path("sway.py"), after.data)["sway"]().physics == "nearest"

    return asking(source, "sway", does_ask).data.decode()


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("Timeline().", 'Timeline(physics="nearest").'),
        ("Timeline(Posture.SIT).", 'Timeline(Posture.SIT, physics="nearest").'),
        ("Timeline((Posture.STAND), ).", 'Timeline((Posture.STAND), physics="nearest", ).'),
        ('Timeline(physics="as_written").', 'Timeline(physics="nearest").'),
    ],
)
def test_a_motion_asks_for_it_where_it_begins(before: str, after: str) -> None:
    text = SWAY.replace("Timeline().", before)
    assert _asking(text) == SWAY.replace("Timeline().", after)


def test_what_begins_elsewhere_is_asked_for_in_a_copy_that_is_returned() -> None:
    text = SWAY.replace("= Timeline()", "= begun()") + HELPED
    after = _asking(text)
    assert "from dataclasses import replace\n" in after
    assert 'return replace(line.home(over=0.3).hold(0.3), physics="nearest")' in after
    assert load_text(Path("sway.py"), after.encode())["other"]().physics == "as_written"


def test_where_no_edit_says_it_the_author_is_told_what_would() -> None:
    with pytest.raises(
        StudioError, match=r'Timeline\(physics="nearest"\) by hand where sway begins'
    ):
        asking(Source(SWAY.encode()), "sway", lambda _: False)


def test_the_distance_is_that_of_the_farthest_part() -> None:
    near = Departure(0.0, 1.0, 0.010, "trunk", 0.5, 0.1, 0.4, -0.02, 0.009, "FR_foot", 0.3)
    far = Departure(2.0, 3.0, 0.025, "FL_foot", 2.5, 0.05, 2.4, 0.01, 0.025, "FL_foot", 2.5)
    assert distance([near, far]) == (
        "at most 25 mm (FL_foot at 2.50 s) and 5.7° (trunk at 0.40 s) from yours, and "
        "0.020 s early; it differs from 0.00 to 1.00 s and from 2.00 to 3.00 s"
    )
    lowered = replace(near, foot_place=0.2)
    assert distance([lowered, far]).startswith(
        "at most 200 mm (FR_foot at 0.30 s), 25 mm (FL_foot at 2.50 s) and 5.7° ("
    )


FILE = "sway.py", SWAY


@pytest.fixture(scope="module")
def studio(file: Path) -> Iterator[Studio]:
    with Studio(file, None, 0) as opened:
        yield opened


def _header(data: bytes) -> dict[str, Any]:
    return read_pack(read_message(data, b"")[1])[0]


@pytest.mark.slow
def test_it_is_shown_beside_and_written_when_it_is_taken(studio: Studio, file: Path) -> None:
    answer = studio.nearest({})
    assert isinstance(answer, bytes)
    told, data = read_message(answer, b"")
    header, arrays = read_pack(data)
    assert str(told["told"]).startswith("at most ")
    assert [row for row in told["diff"] if row[0] in "+-"] == [
        f"{sign}{text.splitlines()[8]}" for sign, text in (("-", SWAY), ("+", ASKED))
    ]
    assert not header["verdict"]["ok"]
    assert header["proposal"]["ok"]
    assert len(header["editor"]["bars"]) == 5
    assert abs(arrays["q"] - arrays["ghost.q"]).max() > 0
    assert file.read_text(encoding="utf-8") == SWAY, "nothing is written silently"
    take = {"op": "nearest", "base": header["editor"]["base"], "commit": True}
    assert isinstance(studio.edit(take), dict)
    assert file.read_text(encoding="utf-8") == ASKED
    taken = _header(studio._server.changes(""))
    assert taken["verdict"]["text"] == header["proposal"]["text"]
    late = {**take, "base": taken["editor"]["base"]}
    assert "look for it again" in str(studio.edit(late)["error"])  # pyright: ignore[reportCallIssue, reportArgumentType]
    assert studio.edit({"op": "undo"}) == {}
    assert file.read_text(encoding="utf-8") == SWAY


@pytest.mark.slow
def test_a_change_of_all_of_it_is_shown_beside_before_it_is_taken(
    studio: Studio, file: Path
) -> None:
    changes = studio.mend({})["changes"]
    assert isinstance(changes, tuple)
    for which in range(len(changes)):
        answer = studio.beside({"which": which})
        assert isinstance(answer, bytes)
        header, arrays = read_pack(read_message(answer, b"")[1])
        assert not header["verdict"]["ok"]
        assert header["proposal"]["ok"]
        assert len(header["editor"]["bars"]) == 5, "one's own"
        assert not np.array_equal(arrays["ghost.q"], arrays["q"])
    for wrong in (len(changes), -1, None, "0"):
        told = studio.beside({"which": wrong})
        assert isinstance(told, dict)
        assert "one of those that were proposed" in str(told["error"])
    assert file.read_text(encoding="utf-8") == SWAY, "nothing is written"


def test_an_edit_ends_the_search(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    begun, stopped, answers = threading.Event(), threading.Event(), list[object]()

    def run(order: Order) -> NoReturn:
        begun.set()
        assert order.task is Task.NEAREST
        assert stopped.wait(LONG)
        raise StudioError(STOPPED)

    monkeypatch.setattr(studio._player, "run", run)
    monkeypatch.setattr(studio._player, "stop", stopped.set)
    search = threading.Thread(target=lambda: answers.append(studio.nearest({})))
    search.start()
    assert begun.wait(LONG)
    editor = _header(studio._server.changes(""))["editor"]
    order = {"op": "set", "site": editor["bars"][0]["site"], "name": "seconds", "value": 0.25}
    assert isinstance(studio.edit({**order, "base": editor["base"]}), bytes)
    search.join(LONG)
    assert answers == [{"error": STOPPED}]


@pytest.mark.slow
def test_the_nearest_of_a_motion_without_an_end_breaks_a_limit_and_is_not_proposed(
    studio: Studio, file: Path
) -> None:
    file.write_text(AWAY, encoding="utf-8")
    assert studio.look() or studio.look()
    told = "the nearest motion that was found still breaks a limit: entry and exit, exit place"
    answer = studio.nearest({})
    assert isinstance(answer, dict)
    assert str(answer["error"]).startswith(told)
    file.write_text(SWAY, encoding="utf-8")
    assert studio.look() or studio.look()


def test_what_is_not_found_yet_is_checked_as_it_is_written_and_said_to_be_coarse() -> None:
    calls = list[int]()

    def progress(iterations: int, _cost: float) -> NoReturn:
        calls.append(iterations)
        raise TooLong

    jumps = Jumps(progress)
    line = Timeline(physics="nearest").body(y=NEVER, over=0.2).body(y=-NEVER, over=0.2)
    line = line.home(over=0.3).hold(0.3)
    shown = Order(Path("sway.py"), b"", None, {}, longest=AT_ONCE, is_shown=True)
    checked, is_coarse = jumps.evaluate(line, shown)
    assert is_coarse
    assert calls == [1]
    written = jumps.checker.check(replace(line, physics="as_written"))
    assert checked.report.failures == written.failures
    assert jumps.evaluate(line, replace(shown, task=Task.DRAFT))[1]
    assert calls == [1], "while something is dragged it is not looked for"
    with pytest.raises(TooLong):
        jumps.evaluate(line, replace(shown, is_shown=False))
    slow = replace(line, physics="as_written")
    assert not jumps.evaluate(slow, shown)[1]


@pytest.mark.slow
def test_a_draft_is_coarse_until_the_exact_answer_replaces_it(studio: Studio, file: Path) -> None:
    file.write_text(ASKED, encoding="utf-8")
    assert studio.look() or studio.look()
    before = _header(studio._server.changes(""))
    assert (before["verdict"]["ok"], before["verdict"]["coarse"]) == (True, "")
    order = {"op": "set", "site": before["editor"]["bars"][4]["site"], "name": "seconds"}
    order |= {"value": 0.35, "base": before["editor"]["base"]}
    draft = studio.edit(order)
    assert isinstance(draft, bytes)
    verdict = _header(draft)["verdict"]
    assert not verdict["ok"], "what is written"
    assert verdict["coarse"].endswith("is looked for when you let go")
    saved = studio.edit({**order, "commit": True})
    assert isinstance(saved, dict)
    assert "error" not in saved
    after = _header(studio._server.changes(""))["verdict"]
    assert (after["ok"], after["coarse"]) == (True, "")
    file.write_text(SWAY, encoding="utf-8")
    assert studio.look() or studio.look()
