"""What a page is shown of files in many habits, and what every edit makes of them, is recorded."""

import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from multiprocessing import Event, Pipe
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from controller.studio import bars, worlds
from controller.studio.edits import PALETTE, cut_of, edited, run_of, site_of
from controller.studio.grounds import KINDS, ground_of
from controller.studio.jumping import Jumps
from controller.studio.making import Maker
from controller.studio.orders import Answer, Order, Task
from controller.studio.plain import refusal
from controller.studio.proposals import proposal, read
from controller.studio.rewriting import offers
from controller.studio.shows import with_show
from controller.studio.source import Source
from controller.studio.splitting import split
from controller.studio.together import copied, edited_together, pasted
from controller.studio.working import Teller, _answer
from go2_wbc.errors import StudioError
from motions.language.tracing import CallMark
from tests.controller.studio.habits import FILES
from tests.recorded import assert_as_recorded, digest

FILE = Path(__file__).with_name("recorded.json")
PATH = Path("/nowhere/shown.py")
SOME = 9  #: Bars of a file that are edited
WORDS = {"leg": "RL", "name": "bow", "ease": "out", "frame": "body", "gait": "trot"}
MORE = {"x": 0.03, "yaw": 7.0, "height": 0.05, "over": 0.75, "sideways": 1.0, "ease": "in"}
BAD: tuple[dict[str, Any], ...] = (
    *({"op": "set", "name": "over"}, {"op": "set", "name": 3, "value": 1.0}, {"op": "nothing"}),
    *({"op": "insert", "title": "?"}, {"op": "insert", "title": "Walk", "values": {"over": True}}),
    *({"op": "delete", "site": [1]}, {"op": "delete", "site": [1, 2]}, {"op": "pace"}),
    *({"op": "set", "name": "over", "value": 1.0, "callers": [[1, 2]]}, {"op": "library"}),
    *({"op": "parameter", "name": "nothing"}, {"op": "set", "name": "over", "value": "long"}),
)


def orders_of(bar: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Edits of a bar of all kinds, right and wrong."""
    where = {"site": list(bar["site"]), "number": bar["number"], "callers": bar["callers"]}
    for slot in bar["slots"]:
        value = slot["value"]
        new = WORDS.get(slot["name"], "FL") if isinstance(value, str) else 1.1 * (value or 0) + 0.1
        yield "set", {**where, "op": "set", "name": slot["name"], "value": new}
        yield "parameter", {**where, "op": "parameter", "name": slot["name"]}
    for name, new in MORE.items():
        yield "more", {**where, "op": "set", "name": name, "value": new}
    for title, template in PALETTE.items():
        values = {name: 0.3 for name in template.arguments if name == "over"}
        yield "insert", {**where, "op": "insert", "title": title, "values": values}
    for op in ("delete", "duplicate", "unroll"):
        yield op, {**where, "op": op}
    for step in (-1, 1):
        yield "swap", {**where, "op": "swap", "step": step}
    for name in ("nod", "wave", "?"):
        yield "library", {**where, "op": "library", "name": name}
    for bad in BAD:
        yield "bad", {**where, **bad}


def whole_orders() -> Iterator[dict[str, Any]]:
    """Edits of a motion as a whole."""
    yield {"op": "pace", "value": 1.25}
    yield {"op": "library", "name": "nod"}
    for title in ("Pause", "Lift and put down", "Turn round"):
        yield {"op": "last", "title": title}
        yield {"op": "begin", "title": title}


def said(act: Callable[[], object]) -> str:
    """What comes of it, or why nothing does."""
    try:
        done = act()
    except StudioError as error:
        return f"error: {error}"
    return f"{done.site} {done.data!r}" if isinstance(done, Source) else repr(done)


@pytest.fixture(scope="module")
def working() -> Iterator[tuple[Jumps, Maker, Any, Teller]]:
    """What the process has that runs files."""
    teller = Teller(Pipe()[1], Event())
    path = list(sys.path)
    yield Jumps(teller), Maker(), SimpleNamespace(send=lambda _: None), teller
    sys.path[:] = path


@pytest.mark.parametrize("habit", FILES)
def test_bars_and_edits_of_a_file_are_those_recorded(
    habit: str, working: tuple[Jumps, Maker, Any, Teller]
) -> None:
    data, made = FILES[habit], working[1].make(Order(PATH, FILES[habit], "shown", {}))
    order = Order(PATH, data, "shown", {}, Task.CHECK)
    answer = _answer(order, *working)
    assert isinstance(answer, Answer)
    shown: list[dict[str, Any]] = [bars.saved(bar) for bar in answer.bars]
    lines: dict[str, list[str]] = {"bars": list(map(repr, shown))}
    lines["bars"] += [repr(answer.notes), repr(answer.motions), repr(bars.draft(answer.bars[0]))]
    lines["read"] = [said(lambda bar=bar: read(bar)) for bar in answer.bars[:SOME]]
    own = [bar for bar in shown if not bar["file"]][:SOME]
    source = Source(data)
    for bar in own:
        for what, edit in orders_of(bar):
            lines.setdefault(what, []).append(said(lambda edit=edit: edited(source, edit, "shown")))
        lines.setdefault("split", []).extend(halves(source, bar, made.marks))
        run = site_of(list(bar["site"])), run_of(bar)
        lines.setdefault("offers", []).append(said(lambda run=run: offers(source, "shown", *run)))
    lines["whole"] = [
        said(lambda edit=edit: edited(source, edit, "shown")) for edit in whole_orders()
    ]
    lines["together"] = list(map(said, together(source, own)))
    lines["written out"] = [written_out_of(bar, order, working) for bar in range(len(shown[:SOME]))]
    assert_as_recorded(FILE, habit, {what: "\n".join(each) for what, each in lines.items()})


def halves(source: Source, bar: dict[str, Any], marks: tuple[CallMark, ...]) -> Iterator[str]:
    """What comes of splitting a bar."""
    start, _, end = bar["span"]
    for share in (0.0, 0.4, 1.0):
        time = round(start + share * (end - start), 3)
        cut = cut_of({"site": list(bar["site"]), "number": bar["number"], "time": time})
        yield said(lambda cut=cut: split(source, str(PATH), marks, cut))


def together(source: Source, here: list[dict[str, Any]]) -> Iterator[Callable[[], object]]:
    """Edits of several bars, copies, a show, and what is told of two texts."""
    sites = [list(bar["site"]) for bar in here[:3]]
    taken: tuple[str, ...] = ()
    with suppress(StudioError):
        taken = copied(source, {"sites": sites[:2]})
    yield lambda: taken
    yield lambda: pasted(source, {"site": sites[-1]}, taken)
    values = {"over": 0.7, "yaw": 3.0}
    many = [{"op": "set", "site": site, "name": "over", "value": 0.7} for site in sites]
    for order in (
        {"op": "many", "orders": many},
        {"op": "many", "orders": [{"op": "delete", "site": site} for site in sites[1:]]},
        {"op": "set_many", "site": sites[0], "values": values},
        {"op": "set_many", "site": sites[0], "values": {}},
        {"op": "copies", "sites": sites[:2], "site": sites[-1]},
        *({"op": "move", "sites": sites[:1], "site": sites[-1], "step": step} for step in (0, 1)),
        {"op": "move", "sites": sites[1:], "site": sites[0], "is_ahead": True},
        {"op": "move", "sites": sites[-1:], "site": sites[0], "is_ahead": True},
        {"op": "many", "orders": [3]},
    ):
        yield lambda order=order: edited_together(
            source, order, lambda text, one: edited(text, one, "shown")
        )
    yield lambda: with_show(source, ("shown", "other"))[0]
    longer = source.append("shown", ".hold(0.3).home(over=1.0)")
    yield lambda: proposal(source, longer, "shown")
    yield lambda: proposal(longer, source, "shown")
    for line in (1, 5, 8, 12):
        told = f"shown.py, line {line}: foot FR is raised, and home() is not called"
        yield lambda told=told: refusal(told, source.data, longer.data)


def written_out_of(bar: int, order: Order, working: tuple[Jumps, Maker, Any, Teller]) -> str:
    """The text in which what a bar has computed is written out."""
    rewritten = Order(PATH, order.data, "shown", {}, Task.REWRITE, bar)
    answer = _answer(rewritten, *working)
    return str(answer) if isinstance(answer, StudioError) else repr(answer.text)


WORLDS: tuple[dict[str, Any], ...] = (
    *({}, {"friction": 0.4, "payload": 2.0}, {"sensors": "imu"}, {"friction": 9.0}),
    *({"payload": "much"}, {"friction": True}, {"sensors": "?"}, {"ground": 3}),
    *({"ground": kind} for kind in (*KINDS, "?")),
    *({"ground": kind, "size": size} for kind in KINDS for size in (0.01, 0.15, 25.0, True)),
)


def test_worlds_and_grounds_are_told_as_recorded() -> None:
    told = []
    for order in WORLDS:
        told.append(said(lambda order=order: worlds.world_of(order)))
        told.append(said(lambda order=order: ground_of(order)))
        with suppress(StudioError):
            world, ground = worlds.world_of(order), ground_of(order)
            told += [worlds.told(world, ground), repr(worlds.shown(world, ground))]
            told += [repr(ground.terrain), digest(ground.cells(np.array([[0.1, 0.0], [0.9, 0.2]])))]
    assert_as_recorded(FILE, "worlds", {"told": "\n".join(map(str, told))})
