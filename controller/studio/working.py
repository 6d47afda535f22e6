"""In the process that runs an author's file: its motion is made, checked, played or mended."""

from __future__ import annotations

import gc
import math
import os
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from enum import Enum
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from typing import TYPE_CHECKING, final

import numpy as np

from controller.studio import worlds
from controller.studio.grounds import PlayedGround
from controller.studio.literals import Run
from controller.studio.orders import AT_ONCE, STOPPED, Answer, Bar, Cut, Doing, Order, Task, TooLong
from controller.studio.plain import coarsely, in_words, is_unsolved, plainly
from controller.studio.source import Slot, Source
from controller.studio.splitting import split
from go2_wbc.errors import Go2WbcError, StudioError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.world import World

if TYPE_CHECKING:
    from controller.go2_controller import GO2Controller
    from controller.studio.jumping import Jumps
    from controller.studio.making import Made, Maker
    from go2_wbc.recording import Recording
    from motions import CheckedMotion, FeasibilityChecker, Timeline
    from motions.language.tracing import CallMark
    from viz.content import ReplayContent


RARELY = 100_000  #: New objects after which what is unused is looked for; an edit makes 3,000
LEAST_MOVE = 5e-4  #: m or rad, of the trunk or a joint: what moves less is at rest
POSING = ("body", "pose", "home")  #: Calls that are of time only where they change nothing
PERIOD = 0.1  #: s, between two words of how far it is


@final
class Teller:
    """Tells how far the work is, and ends it where that is asked for."""

    def __init__(self, pipe: Connection, stop: Event) -> None:
        self._pipe, self._stop = pipe, stop
        self._longest, self._since, self._told = 0.0, 0.0, math.inf  # nothing before an order
        self._what = "solving"

    def begin(self, order: Order) -> None:
        """Take up an order: how long each jump, or the nearest motion, may be solved for."""
        self._longest, self._told = order.longest, 0.0
        self._what = "nearing" if order.task is Task.NEAREST else "solving"
        self._since = time.thread_time()

    @property
    def _is_stopped(self) -> bool:
        return self._told < math.inf and self._stop.is_set()

    def __call__(self, iterations: int, _cost: float) -> None:
        """As the solver's progress, which counts its iterations anew for each jump."""
        from motions.dynamics.solver import BUDGET

        now = time.thread_time()
        if iterations <= 1 and self._what == "solving":
            self._since = now
        if self._longest != AT_ONCE:
            self.tell(Doing(self._what, now - self._since, self._longest or BUDGET))
        if self._is_stopped:
            raise StudioError(STOPPED)
        if 0.0 < self._longest < now - self._since:
            raise TooLong

    def tell(self, doing: Doing) -> None:
        """At once, and then every ``PERIOD``."""
        if time.monotonic() > self._told + PERIOD:
            self._told = time.monotonic()
            self._pipe.send(doing)

    @contextmanager
    def watching(self, go2: GO2Controller, duration: float) -> Iterator[None]:
        """Meanwhile, tell how much of a motion the robot has played."""
        is_over = threading.Event()

        def watch() -> None:
            played = 0.0  # it is none again where it ends
            while not is_over.is_set():
                played = max(played, go2.progress * duration)
                self.tell(Doing("playing", played, duration))
                if self._is_stopped:
                    return go2.cancel()
                is_over.wait(PERIOD)

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            yield
        finally:
            is_over.set()
            watcher.join()
        if self._is_stopped:
            raise StudioError(STOPPED)


def serve(pipe: Connection, stop: Event, environment: Mapping[str, str]) -> None:
    """Answer orders: a word once the robot is loaded, one when the file has run, and the answer.

    A first order that is ``None`` has it play something before that word: then all of it is loaded.
    What was begun ends where ``stop`` is set. ``environment`` is that of the process.
    """
    os.environ.clear()
    os.environ.update(environment)
    with suppress(EOFError, ConnectionError, KeyboardInterrupt):
        order: Order | None = pipe.recv()
        from controller.studio.jumping import Jumps
        from controller.studio.making import Maker
        from motions import Timeline
        from viz.replay import page_data  # takes its time, which no file has to answer for

        teller = Teller(pipe, stop)
        maker, jumps = Maker(), Jumps(teller)
        if order is None:
            checked = jumps.checker.evaluate(Timeline().body(z=-0.01, over=0.2))
            _played(checked, jumps.checker, World(), PlayedGround(), teller)
        pipe.send("loaded")
        while True:
            if order is not None:
                teller.begin(order)
                answer = _answer(order, jumps, maker, pipe, teller)
                pipe.send(answer)
                if order.task is Task.EXPORT and isinstance(answer, Answer) and answer.content:
                    page_data.prepared(answer.content)  # no drag has to wait for what that loads
                    gc.freeze()  # nor each search for what is unused to go through it
                    gc.set_threshold(RARELY)
            order = pipe.recv()


def _answer(
    order: Order, jumps: Jumps, maker: Maker, pipe: Connection, teller: Teller
) -> Answer | StudioError:
    from controller.motion_files import write_motion
    from controller.report_view import planned, slider
    from controller.studio.nearness import beside
    from controller.studio.writing_out import written_out
    from motions import suggest

    has_run = False
    if order.task is Task.PLAY:
        teller.tell(Doing("playing"))  # the check comes first
    try:
        made = maker.make(order)
        motion, values, line = made.motion, made.values, made.line
        pipe.send("made")
        has_run = True
        source = Source(order.data)
        jumps.meet(order.world)
        if order.task is Task.MEND:
            found = suggest(line, checker=jumps.checker)
            changes = tuple((item.call, item.meaning) for item in found)
            return Answer(motion.name, changes=changes)
        if isinstance(order.part, Cut):
            after = split(source, str(order.path), made.marks, order.part)
            return Answer(motion.name, text=(after.data, after.site and after.offset(after.site)))
        if isinstance(order.part, int):
            after = written_out(source, maker, order, made, order.part)
            return Answer(motion.name, text=(after.data, None))
        if order.out is not None:
            write_motion(line, order.out, jumps.checker)
            return Answer(motion.name)
        (checked, is_coarse), text = jumps.evaluate(line, order), None
        if order.task is Task.PLAY:
            content, told = _played(checked, jumps.checker, order.world, order.ground, teller)
        elif order.task in (Task.NEAREST, Task.BESIDE):
            after, near = _other(source, order, made, maker)
            content, told = beside(checked, jumps.checker.evaluate(near))
            text = after.data, None
        else:
            content, told = planned(checked), ""
    except (Go2WbcError, SystemExit) as error:
        if not has_run:
            pipe.send("failed")
        is_ours = isinstance(error, Go2WbcError)
        return StudioError(str(error) if is_ours else "the file ends the program")
    except TooLong:
        return Answer(order.chosen or "", is_solved=False)
    from viz.replay.page_data import prepared

    sliders = tuple(slider(item, values.get(item.name, item.default)) for item in motion.parameters)
    content = plainly(replace(worlds.judged(content, order.ground), sliders=sliders))
    if is_coarse:
        content = coarsely(content, order)
    bars = tuple(_bars(order, source, made.marks, content))
    shown = content if order.task is Task.EXPORT else prepared(content)
    is_solved = not (is_unsolved(content) or (is_coarse and order.task is not Task.DRAFT))
    more = {"text": text, "is_solved": is_solved}
    return Answer(motion.name, shown, bars, made.names, told, made.notes, **more)


def _other(source: Source, order: Order, made: Made, maker: Maker) -> tuple[Source, Timeline]:
    """The text that is shown beside, and what it makes: if none is given, the nearest motion."""
    from controller.studio.nearness import asking
    from motions.language.timeline_data import NEAREST

    if isinstance(order.part, bytes):
        return Source(order.part), maker.make(replace(order, data=order.part)).line
    found: list[Timeline] = []

    def does_ask(after: Source) -> bool:
        found.append(maker.make(replace(order, data=after.data)).line)
        return found[-1].physics == NEAREST

    return asking(source, made.motion.name, does_ask), found[-1]


def _played(
    checked: CheckedMotion,
    checker: FeasibilityChecker,
    world: World,
    ground: PlayedGround,
    teller: Teller,
) -> tuple[ReplayContent, str]:
    """The motion in MuJoCo, in the world that it was checked for, and how that went."""
    from controller.go2_controller import GO2Controller
    from controller.motion_measurement import measure_motion
    from controller.report_view import performed
    from go2_wbc.motion_plan import Posture
    from go2_wbc.plant import plant_in_world
    from go2_wbc.plant.mujoco.ground_truth import GroundTruth

    with (
        closing(GroundTruth(plant_in_world(world, terrain=ground.terrain))) as truth,
        GO2Controller(plant=truth) as go2,
    ):
        is_ready = go2.sit() if checked.plan.entry is Posture.SIT else go2.stand()
        if not is_ready:
            raise StudioError(f"the robot did not get ready: {go2.last_outcome.reason}")
        with teller.watching(go2, checked.plan.duration):
            result = measure_motion(go2, truth, checked.plan, checker.model)
        run = go2.recording()
    run = replace(run, ground=ground.cells(run.q[:, :2]))
    content = performed(checked, run, checker.model)
    why = result.fall or result.reason
    share = f"{100 * result.torque:.0f} % of the torque, {100 * result.speed:.0f} % of the speed"
    where = worlds.told(world, ground)
    where = "" if (world, ground) == (World(), PlayedGround()) else f" ({where})"
    done = f"played in MuJoCo{where}: done, {share}"
    return content, done if result.ok else f"NOT done{where}: {why}"


def _bars(
    order: Order, source: Source, marks: Sequence[CallMark], content: ReplayContent
) -> Iterator[Bar]:
    runs = Counter((mark.call.file, mark.call.site) for mark in marks)
    plan = content.recording if content.is_plan else content.ghost
    is_draft = order.task is Task.DRAFT
    for mark in marks:
        call = mark.call
        is_here = call.file == str(order.path)
        parts = tuple(part if isinstance(part, str) else part.name for part in mark.parts)
        values = dict(_values(call.arguments))
        if is_here and "others" in call.arguments:  # which have no name but what is written
            values["others"] = source.text(call.site).partition("(")[2][:-1]
        slots = list[Slot]()
        if is_here and not is_draft:
            slots = [*_chosen(source.slots(call.site, Run(call.number, call.callers)), values)]
        yield Bar(
            call.name,
            call.site if is_here else (0, 0),
            runs[call.file, call.site],
            call.number,
            (mark.start, max(mark.move, mark.start), mark.end),
            parts,
            _broken(content, mark.start, mark.end, parts),
            tuple(slots),
            values,
            call.callers,
            "" if is_here else call.file,
            0 if is_here else call.site[0],
            plan is not None
            and ("time" not in parts or call.name in POSING)
            and _rests(plan, mark.start, mark.end),
        )


def _rests(plan: Recording, start: float, end: float) -> bool:
    """Whether nothing moves from one time [s] to another."""
    first, last = np.searchsorted(plan.time, (start, end))
    q = plan.q[first:last]
    return len(q) > 1 and bool(np.all(np.ptp(q, axis=0) < LEAST_MOVE))


def _chosen(slots: Sequence[Slot], values: Mapping[str, float | str]) -> Iterator[Slot]:
    """The slots, of both values of a choice with whether it is the one that was taken."""

    def is_taken(slot: Slot) -> bool:
        value = math.radians(float(slot.value or 0)) if slot.is_angle else slot.value
        return slot.is_choice and slot.of in values and value == values[slot.of]

    known = Counter(slot.of for slot in slots if is_taken(slot))
    for slot in slots:
        is_known = slot.is_choice and known[slot.of] == 1
        yield replace(slot, plays=is_taken(slot)) if is_known else slot


def _values(arguments: Mapping[str, object]) -> Iterator[tuple[str, float | str]]:
    """Those that are numbers or words."""
    for name, value in arguments.items():
        if isinstance(value, Leg):
            yield name, value.name
        elif isinstance(value, Enum):
            yield name, str(value.value)
        elif isinstance(value, int | float | str) and not isinstance(value, bool):
            yield name, value


def _broken(content: ReplayContent, start: float, end: float, parts: Sequence[str]) -> str:
    """The first limit that is broken by these parts while they move."""
    found = content.verdict.annotations if content.verdict is not None else ()
    for item in sorted(found, key=lambda one: one.time):
        legs = {part.partition("_")[0] for part in item.parts} & {leg.name for leg in LEGS}
        concerns = (
            not legs or bool(legs & set(parts)) or not set(parts) & {leg.name for leg in LEGS}
        )
        if item.is_broken and concerns and any(a < end and start < b for a, b in item.spans):
            return in_words(item)
    return ""
