"""What the process that runs an author's file tells, and how it plays: without a process."""

import math
import signal
import sys
from contextlib import nullcontext
from dataclasses import dataclass, replace
from multiprocessing import Event
from multiprocessing.connection import Connection
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import controller.go2_controller
import controller.motion_files
import controller.motion_measurement
import controller.report_view
import go2_wbc.plant
import go2_wbc.plant.mujoco.ground_truth
import motions
from controller.studio import jumping, nearness, working, writing_out
from controller.studio.grounds import PlayedGround
from controller.studio.making import OURS, Maker
from controller.studio.orders import AT_ONCE, STOPPED, Answer, Bar, Cut, Doing, Order, Task, TooLong
from controller.studio.running import Runner
from controller.studio.source import Source
from controller.studio.working import Teller
from go2_wbc.errors import StudioError
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from go2_wbc.world import World
from motions.dynamics.solver import BUDGET
from viz.replay import page_data

LONGEST = 3.0


def order(task: Task, longest: float = LONGEST) -> Order:
    return Order(Path("own.py"), b"", None, {}, task, longest=longest)


class Pipe(Connection):
    """The end of the process: it ends where no order is left."""

    _handle = None

    def __init__(self, *orders: Order | None) -> None:
        self.orders, self.said = [*orders], list[Any]()

    def recv(self) -> Order | None:
        if not self.orders:
            raise EOFError
        return self.orders.pop(0)

    def send(self, obj: object) -> None:
        self.said.append(obj)


@dataclass
class Clock:
    """Of the process and of the wall."""

    now: float = 10.0

    def thread_time(self) -> float:
        return self.now

    monotonic = thread_time


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(working, "time", clock)
    return clock


@pytest.mark.parametrize(
    ("task", "longest", "what", "since", "whole"),
    [
        (Task.CHECK, LONGEST, "solving", 11.0, LONGEST),
        (Task.NEAREST, LONGEST, "nearing", 10.0, LONGEST),
        (Task.CHECK, 0.0, "solving", 11.0, BUDGET),
    ],
)
def test_each_jump_is_timed_anew_and_a_nearest_motion_as_a_whole(
    clock: Clock, task: Task, longest: float, what: str, since: float, whole: float
) -> None:
    pipe = Pipe()
    teller = Teller(pipe, Event())
    teller.begin(order(task, longest))
    for clock.now, iterations in ((11.0, 1), (11.05, 2), (12.0, 2), (since + LONGEST, 3)):
        teller(iterations, 0.0)
    times = (11.0, 12.0, since + LONGEST)  # not within a tenth of a second
    assert pipe.said == [Doing(what, now - since, whole) for now in times]
    clock.now += 0.5
    with pytest.raises(TooLong) if longest else nullcontext():
        teller(2, 0.0)


def test_what_is_found_at_once_is_not_told_and_what_is_stopped_ends(clock: Clock) -> None:
    pipe, stop = Pipe(), Event()
    stop.set()
    teller = Teller(pipe, stop)
    teller(1, 0.0)  # before an order nothing is stopped
    stop.clear()
    teller.begin(order(Task.CHECK, AT_ONCE))
    teller(1, 0.0)
    assert pipe.said == []
    stop.set()
    with pytest.raises(StudioError, match=STOPPED):
        teller(1, 0.0)


@pytest.mark.parametrize("is_stopped", [False, True])
def test_how_much_is_played_is_told_until_it_ends_or_is_stopped(
    monkeypatch: pytest.MonkeyPatch, *, is_stopped: bool
) -> None:
    monkeypatch.setattr(working, "PERIOD", 1e-4)
    pipe, stop, is_enough = Pipe(), Event(), Event()
    shares = iter([0.25, 0.75])
    cancelled = list[bool]()

    class Robot:
        """It has played its motion at the third look."""

        @property
        def progress(self) -> float:
            share = next(shares, 0.0)
            if not share:
                (stop if is_stopped else is_enough).set()
            return share

        def cancel(self) -> None:
            cancelled.append(True)
            is_enough.set()

    robot: Any = Robot()
    teller = Teller(pipe, stop)
    teller.begin(order(Task.PLAY))
    with (
        pytest.raises(StudioError, match=STOPPED) if is_stopped else nullcontext(),
        teller.watching(robot, 2.0),
    ):
        assert is_enough.wait(5.0)
    done = [said.done for said in pipe.said if said == Doing("playing", said.done, 2.0)]
    assert (done[0], done[-1], len(done)) == (0.5, 1.5, len(pipe.said))
    assert done == sorted(done)
    assert cancelled == [True] * is_stopped


CHECK, EXPORT = order(Task.CHECK), order(Task.EXPORT)
SHOWN, EMPTY = Answer("own", content=object()), Answer("own")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("first", "answer", "is_prepared"),
    [
        (CHECK, SHOWN, False),
        (EXPORT, SHOWN, True),
        (EXPORT, EMPTY, False),
        (EXPORT, StudioError("no"), False),
    ],
)
@pytest.mark.parametrize("is_warmed", [False, True])
def test_what_is_served_is_told_and_loaded(
    monkeypatch: pytest.MonkeyPatch,
    first: Order,
    answer: Answer | StudioError,
    *,
    is_prepared: bool,
    is_warmed: bool,
) -> None:
    done, environment = list[object](), {"OLD": "1"}
    checker = SimpleNamespace(evaluate=lambda line: done.append(len(line.keys)))
    for where, name, value in (
        (working, "os", SimpleNamespace(environ=environment)),
        (working, "gc", SimpleNamespace(freeze=lambda: None, set_threshold=done.append)),
        (working, "_answer", lambda *_: answer),
        (working, "_played", lambda *given: done.append(given[2:4])),
        (jumping, "Jumps", lambda _: SimpleNamespace(checker=checker)),
        (page_data, "prepared", done.append),
    ):
        monkeypatch.setattr(where, name, value)
    pipe = Pipe(*[None] * is_warmed, first, None, CHECK)
    working.serve(pipe, Event(), {"NEW": "2"})
    assert environment == {"NEW": "2"}
    assert pipe.said == ["loaded", answer, answer]
    warmed = [1, (World(), PlayedGround())] if is_warmed else []
    loaded = [SHOWN.content, working.RARELY] if is_prepared else []
    assert done == [*warmed, *loaded]


@dataclass
class Run:
    """What was recorded, and the cells of the ground."""

    q: np.ndarray
    ground: object = None


@pytest.mark.parametrize("entry", [Posture.SIT, Posture.STAND])
@pytest.mark.parametrize(
    ("world", "why", "told"),
    [
        (World(), "", "played in MuJoCo: done, 50 % of the torque, 40 % of the speed"),
        (World(payload=2.0), "", "played in MuJoCo (friction 0.5, payload 2 kg): done, 50 %"),
        (World(), "it fell", "NOT done: it fell"),
        (World(payload=2.0), "it fell", "NOT done (friction 0.5, payload 2 kg): it fell"),
    ],
)
def test_a_motion_is_played_from_its_posture_and_told(
    monkeypatch: pytest.MonkeyPatch, entry: Posture, world: World, why: str, told: str
) -> None:
    asked = list[str]()

    def ready(posture: str) -> bool:
        asked.append(posture)
        return len(asked) == 1

    go2 = SimpleNamespace(
        progress=0.0,
        sit=lambda: ready("sit"),
        stand=lambda: ready("stand"),
        last_outcome=SimpleNamespace(reason="a paw is stuck"),
        recording=lambda: Run(np.zeros((1, 19))),
    )
    result = SimpleNamespace(ok=not why, fall=None, reason=why, torque=0.5, speed=0.4)
    closed = SimpleNamespace(close=lambda: None)
    for where, name, value in (
        (controller.go2_controller, "GO2Controller", lambda plant: nullcontext(go2)),
        (controller.motion_measurement, "measure_motion", lambda *_: result),
        (controller.report_view, "performed", lambda *_: "shown"),
        (go2_wbc.plant, "plant_in_world", lambda *_, terrain: None),
        (go2_wbc.plant.mujoco.ground_truth, "GroundTruth", lambda _: closed),
    ):
        monkeypatch.setattr(where, name, value)
    checked: Any = SimpleNamespace(plan=SimpleNamespace(entry=entry, duration=1.0))
    checker: Any = SimpleNamespace(model=None)
    teller = Teller(Pipe(), Event())
    content, words = working._played(checked, checker, world, PlayedGround(), teller)
    assert content == "shown"
    assert words.startswith(told)
    assert asked == ["sit" if entry is Posture.SIT else "stand"]
    with pytest.raises(StudioError, match="did not get ready: a paw is stuck"):
        working._played(checked, checker, world, PlayedGround(), teller)


def test_values_are_numbers_and_words() -> None:
    given = {"leg": Leg.FL, "entry": Posture.SIT, "z": 0.1, "n": 2, "by": "x", "up": True, "o": ()}
    told = {"leg": "FL", "entry": Posture.SIT.value, "z": 0.1, "n": 2, "by": "x"}
    assert dict(working._values(given)) == told


@pytest.mark.parametrize(
    ("start", "end", "moved", "rests"),
    [
        (0.0, 0.2, 0.0, True),
        (0.0, 0.2, 0.9 * working.LEAST_MOVE, True),
        (0.0, 0.2, working.LEAST_MOVE, False),
        (0.2, 0.4, 1.0, True),
        (0.0, 0.05, 0.0, False),  # of one sample nothing can be told
    ],
)
def test_what_moves_less_is_at_rest(start: float, end: float, moved: float, *, rests: bool) -> None:
    """It moves at 0.1 s."""
    plan: Any = SimpleNamespace(time=0.1 * np.arange(5), q=np.zeros((5, 19)))
    plan.q[1, 2] = moved
    assert working._rests(plan, start, end) is rests


@pytest.mark.parametrize(
    ("start", "end", "parts", "told"),
    [
        (0.0, 1.0, ["trunk"], ""),
        (0.0, 1.1, ["trunk"], "early"),
        (1.0, 2.0, ["FR"], "whole"),
        (1.0, 2.0, ["FL"], "early"),
        (2.0, 3.0, ["FL"], "whole"),
        (3.0, math.inf, ["FL"], ""),
    ],
)
def test_the_first_limit_that_these_parts_break_is_told(
    monkeypatch: pytest.MonkeyPatch, start: float, end: float, parts: list[str], told: str
) -> None:
    monkeypatch.setattr(working, "in_words", attrgetter("name"))
    found = [
        SimpleNamespace(name="whole", time=1.5, parts=("trunk",), is_broken=True, spans=[(1, 3)]),
        SimpleNamespace(name="early", time=1.2, parts=("FL_calf",), is_broken=True, spans=[(1, 2)]),
        SimpleNamespace(name="kept", time=0.0, parts=("FL_calf",), is_broken=False, spans=[(0, 9)]),
    ]
    content: Any = SimpleNamespace(verdict=SimpleNamespace(annotations=found))
    assert working._broken(content, start, end, parts) == told
    assert not working._broken(SimpleNamespace(verdict=None), start, end, parts)  # type: ignore[arg-type]


FILE = b"""from motions import Timeline, motion

FAST = True


@motion
def own() -> Timeline:
    line = Timeline().body(z=0.0, over=1.0).hold(0.4)
    for leg in ("FL", "FR"):
        line = line.foot(leg, z=0.05 if FAST else 0.03, over=0.5).down(leg, over=0.5)
    return line.home(over=0.5).pose("home", over=0.5)
"""


@pytest.mark.parametrize("is_here", [True, False])
@pytest.mark.parametrize("task", [Task.CHECK, Task.DRAFT])
@pytest.mark.parametrize("is_plan", [True, False])
def test_a_bar_is_where_its_call_is_written(
    tmp_path: Path, task: Task, *, is_here: bool, is_plan: bool
) -> None:
    own = replace(order(task), path=tmp_path / "own.py", data=FILE)
    marks = Maker().make(own).marks
    rests = SimpleNamespace(time=np.linspace(0.0, 7.0, 71), q=np.zeros((71, 19)))
    moves = SimpleNamespace(time=rests.time, q=rests.q + rests.time[:, None])
    plan, other = (rests, moves) if is_plan else (moves, rests)
    content: Any = SimpleNamespace(verdict=None, is_plan=is_plan, recording=plan, ghost=other)
    asked = own if is_here else replace(own, path=tmp_path / "other.py")
    bars = list(working._bars(asked, Source(FILE), marks, content))
    assert [(bar.name, bar.runs, bar.number) for bar in bars] == [
        *(("body", 1, 0), ("hold", 1, 0), ("foot", 2, 0), ("down", 2, 0), ("foot", 2, 1)),
        *(("down", 2, 1), ("home", 1, 0), ("pose", 1, 0)),
    ]
    assert [bar.is_idle for bar in bars] == [bar.name != "hold" for bar in bars]
    assert bars[2].span == pytest.approx((1.4, 2.3, 2.8))
    lines = [8, 8, 10, 10, 10, 10, 11, 11]
    assert [bar.site[0] for bar in bars] == (lines if is_here else [0] * 8)
    assert [bar.site[1] > 0 for bar in bars] == [is_here] * 8
    assert [(bar.file, bar.line) for bar in bars] == [
        ("", 0) if is_here else (str(own.path), line) for line in lines
    ]
    slots = [slot.plays for slot in bars[2].slots]
    assert slots == ([None, True, False, None] if is_here and task is Task.CHECK else [])


@dataclass(frozen=True)
class Shown:
    """As content."""

    by: str
    sliders: tuple[()] = ()


BAR = Bar("hold", (1, 9), 1, 0, (0.0, 0.0, 0.4), (), "", (), {})
BESIDE = {"content": ("prepared", "beside"), "told": "near", "text": (b"near", None)}


@pytest.mark.parametrize(
    ("task", "more", "is_coarse", "is_unsolved", "expected"),
    [
        (Task.MEND, {}, False, False, {"changes": ((".home()", "ends"),)}),
        (Task.REWRITE, {"part": Cut((1, 2), 0, 0.5)}, False, False, {"text": (b"split", 9)}),
        (Task.REWRITE, {"part": 3}, False, False, {"text": (b"out", None)}),
        (Task.WRITE, {"out": Path("own.plan")}, False, False, {}),
        (Task.CHECK, {}, False, False, {"content": ("prepared", "planned")}),
        (Task.EXPORT, {}, False, False, {"content": Shown("planned")}),
        (Task.CHECK, {}, False, True, {"content": ("prepared", "planned"), "is_solved": False}),
        (Task.CHECK, {}, True, False, {"content": ("prepared", "coarse"), "is_solved": False}),
        (Task.DRAFT, {}, True, False, {"content": ("prepared", "coarse")}),
        (Task.DRAFT, {}, True, True, {"content": ("prepared", "coarse"), "is_solved": False}),
        (Task.PLAY, {}, False, False, {"content": ("prepared", "played"), "told": "done"}),
        (Task.NEAREST, {}, False, False, BESIDE),
        (Task.BESIDE, {}, False, False, BESIDE),
    ],
)
def test_each_task_has_its_answer(
    monkeypatch: pytest.MonkeyPatch,
    task: Task,
    more: dict[str, Any],
    expected: dict[str, Any],
    *,
    is_coarse: bool,
    is_unsolved: bool,
) -> None:
    made: Any = SimpleNamespace(line="line", motion=SimpleNamespace(name="own", parameters=()))
    made.values, made.marks, made.names, made.notes = {}, (), ("own", "two"), ("random",)
    change = SimpleNamespace(call=".home()", meaning="ends")
    written = list[object]()
    cut = SimpleNamespace(data=b"split", site=(1, 2), offset=lambda site: sum(site) + 6)
    for where, name, value in (
        (working, "split", lambda *_: cut),
        (working, "_played", lambda *_: (Shown("played"), "done")),
        (working, "_other", lambda *_: (SimpleNamespace(data=b"near"), "line")),
        (working, "_bars", lambda *_: [BAR]),
        (working, "plainly", lambda content: content),
        (working, "coarsely", lambda content, order: Shown("coarse")),
        (working, "is_unsolved", lambda content: is_unsolved),
        (working.worlds, "judged", lambda content, ground: content),
        (motions, "suggest", lambda line, checker: [change]),
        (writing_out, "written_out", lambda *_: SimpleNamespace(data=b"out")),
        (nearness, "beside", lambda *_: (Shown("beside"), "near")),
        (controller.motion_files, "write_motion", lambda *given: written.append(given[:2])),
        (controller.report_view, "planned", lambda _: Shown("planned")),
        (page_data, "prepared", lambda content: ("prepared", content.by)),
    ):
        monkeypatch.setattr(where, name, value)
    checker = SimpleNamespace(evaluate=lambda line: line)
    jumps: Any = SimpleNamespace(meet=written.append, checker=checker)
    jumps.evaluate = lambda line, order: (line, is_coarse)
    maker: Any = SimpleNamespace(make=lambda order: made)
    pipe, asked = Pipe(), replace(order(task), **more)
    teller = Teller(pipe, Event())
    teller.begin(asked)
    answer = working._answer(asked, jumps, maker, pipe, teller)
    shown = {"bars": (BAR,), "motions": ("own", "two"), "notes": ("random",)}
    assert answer == Answer("own", **(shown if "content" in expected else {}), **expected)
    assert pipe.said == [*[Doing("playing")] * (task is Task.PLAY), "made"]
    assert written == [World(), *[("line", asked.out)] * (task is Task.WRITE)]


@pytest.mark.parametrize(
    ("error", "answer"),
    [
        (StudioError("no"), StudioError("no")),
        (SystemExit(3), StudioError("the file ends the program")),
        (TooLong(), Answer("own", is_solved=False)),
    ],
)
@pytest.mark.parametrize("has_run", [False, True])
def test_what_fails_is_told_and_whether_the_file_has_run(
    error: BaseException, answer: Answer | StudioError, *, has_run: bool
) -> None:
    def fail(*_: object) -> None:
        raise error

    made = SimpleNamespace(motion=None, values=None, line=None)
    maker: Any = SimpleNamespace(make=(lambda _: made) if has_run else fail)
    pipe, jumps = Pipe(), SimpleNamespace(meet=fail)
    asked: Any = replace(order(Task.CHECK), chosen="own")
    found = working._answer(asked, jumps, maker, pipe, Teller(pipe, Event()))  # type: ignore[arg-type]
    assert (type(found), str(found)) == (type(answer), str(answer))
    failed = ["failed"] * (not isinstance(error, TooLong))
    assert pipe.said == (["made"] if has_run else failed)


def test_a_motion_beside_the_library_leaves_the_library_as_it_is() -> None:
    beside = Path(motions.__file__).parent.parent / "own.py"
    maker, known = Maker(), dict(sys.modules)
    try:
        for _ in range(2):
            maker.make(replace(order(Task.CHECK), path=beside, data=FILE))
        new = {name for name, module in known.items() if sys.modules.get(name) is not module}
    finally:
        sys.modules.update(known)
    assert not {name for name in new if name.partition(".")[0] in OURS}


def test_the_process_of_a_runner_that_nobody_holds_ends_at_once() -> None:
    process = Runner()._process
    process.join(60.0)
    assert process.exitcode == -signal.SIGKILL
