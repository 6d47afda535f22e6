"""Whoever calls, interrupts or fails, and whenever: a clear error, a safe robot, and no hanging."""

import math
import signal
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from controller import GO2Controller, Mode
from controller.behaviours.plans import PlayPlan
from controller.loop import ControlLoop
from go2_wbc.errors import ModeError, PlantError
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import Task
from motions import Timeline
from motions.dynamics.shooting_problem import Clock
from tests.controller.plants import (
    HANG_GUARD,
    StillPlant,
    WatchedPlant,
    in_thread,
    interrupt_somewhere_in,
    is_limp,
)

UNDER_WAY = 0.1  # s into a call, when it is well under way
SLOW = 0.3  # m/s

Do = Callable[[GO2Controller], object]


def _trot(go2: GO2Controller) -> None:
    assert go2.walk()
    go2.move(SLOW)
    go2.wait(0.6)


def _nothing(_go2: GO2Controller) -> None: ...


def _wait(go2: GO2Controller) -> None:
    go2.wait(1e6)


def refusals(plant: WatchedPlant, time: float, call: Callable[[], object]) -> list[str]:
    """What ``call`` by another thread at a ``time`` is refused with, once it has been."""
    refused: list[str] = []

    def intrude() -> None:
        with pytest.raises(ModeError) as caught:
            call()
        refused.append(str(caught.value))

    plant.once_at(time, lambda: in_thread(intrude).result(HANG_GUARD))
    return refused


@pytest.mark.parametrize(
    "call",
    [
        GO2Controller.stand,
        GO2Controller.sit,
        lambda go2: go2.high_five(hold=0.5),
        lambda go2: go2.play("nod", check=False),
        GO2Controller.lie_down,
    ],
    ids=["stand", "sit", "high five", "play", "lie down"],
)
@pytest.mark.parametrize("delay", [0.05, 0.5])
def test_a_robot_that_leaves_walking_mode_takes_no_command(
    go2: GO2Controller, plant: WatchedPlant, call: Do, delay: float
) -> None:
    # While it came to rest for the call it took one more, walked on, and the call gave up.
    _trot(go2)
    refused = refusals(plant, go2.state.time + delay, lambda: go2.move(SLOW))
    assert call(go2), go2.last_outcome.reason
    assert refused == ["move() needs walking mode, not moving: call walk() first"]


def test_a_robot_that_cannot_come_to_rest_walks_on_and_takes_commands(
    go2: GO2Controller, plant: WatchedPlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    _trot(go2)
    with monkeypatch.context() as patch:
        patch.setattr("controller.walker.STOP_LIMIT", 0.02)
        assert go2.stand() is False
    assert "come to rest not done within 0.0 s: it still slows down" in go2.last_outcome.reason
    assert go2.mode is Mode.WALKING
    go2.move(SLOW)
    go2.wait(0.5)
    assert go2.stand()


def test_stop_does_not_disturb_what_is_no_walk(go2: GO2Controller, plant: WatchedPlant) -> None:
    assert go2.stand()
    plant.once_at(go2.state.time + 1.5, lambda: in_thread(go2.stop).result(HANG_GUARD))
    assert go2.play("nod", check=False)


def test_a_motion_that_is_cancelled_while_it_begins_is_left_at_once(
    go2: GO2Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It was played to its end, and then said to have been cancelled.
    assert go2.stand()
    begin = PlayPlan.start

    def start(self: PlayPlan, snapshot: Snapshot) -> None:
        begin(self, snapshot)
        if self.label == "bow":
            in_thread(go2.cancel).result(HANG_GUARD)

    monkeypatch.setattr(PlayPlan, "start", start)
    before = go2.state.time
    assert go2.play("bow", check=False) is False
    assert "cancelled" in go2.last_outcome.reason
    assert go2.mode is Mode.STANDING
    assert go2.state.time - before < 4.0


INTERRUPTED: dict[str, tuple[Do, Do, str]] = {
    "lying": (_nothing, _wait, "wait"),
    "tucking its legs": (_nothing, GO2Controller.stand, "stand"),
    "standing": (GO2Controller.stand, _wait, "wait"),
    "sitting down": (GO2Controller.stand, GO2Controller.sit, "sit"),
    "sitting": (GO2Controller.sit, _wait, "wait"),
    "lying down": (GO2Controller.stand, GO2Controller.lie_down, "lie_down"),
    "trotting": (_trot, _wait, "wait"),
    "changing its gait": (_trot, lambda go2: go2.walk("flying_trot"), "walk"),
    "coming to rest": (_trot, GO2Controller.stop, "stop"),
    "turning": (_trot, lambda go2: go2.turn_left(1.0), "turn_left"),
    "high five": (GO2Controller.stand, GO2Controller.high_five, "high_five"),
    "playing": (GO2Controller.stand, lambda go2: go2.play("bow", check=False), "play"),
    "recovering": (_nothing, GO2Controller.recover, "recover"),
}


@pytest.mark.parametrize("name", INTERRUPTED)
def test_ctrl_c_leaves_a_limp_robot_that_gets_up_again(
    go2: GO2Controller, plant: WatchedPlant, name: str
) -> None:
    before, call, what = INTERRUPTED[name]
    before(go2)

    def interrupt() -> None:
        raise KeyboardInterrupt

    plant.once_at(go2.state.time + UNDER_WAY, interrupt)
    with pytest.raises(KeyboardInterrupt):
        call(go2)
    assert go2.mode is Mode.DAMPED
    assert is_limp(plant.commands[-1])
    assert go2.last_outcome.reason == f"interrupted during {what}(), damped"
    go2.wait(1.0)
    assert all(map(is_limp, plant.commands[-200:]))
    assert go2.recover(), go2.last_outcome.reason


@pytest.mark.parametrize("name", ["trotting", "high five"])
def test_in_realtime_a_real_ctrl_c_leaves_a_limp_robot(plant: WatchedPlant, name: str) -> None:
    before, call, what = INTERRUPTED[name]
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    main = threading.get_ident()
    try:
        with GO2Controller(plant=plant, realtime=True) as go2:
            before(go2)
            at = go2.state.time + UNDER_WAY

            def interrupt() -> None:
                if plant.inner.time > at and go2._turn:  # planning is no call yet
                    plant.on_write = lambda: None
                    signal.pthread_kill(main, signal.SIGINT)

            plant.on_write = interrupt
            with pytest.raises(KeyboardInterrupt):
                call(go2)
            assert go2.mode is Mode.DAMPED
            assert go2.last_outcome.reason == f"interrupted during {what}(), damped"
            go2.wait(0.1)
            assert is_limp(plant.commands[-1])
    finally:
        signal.signal(signal.SIGINT, usual)


def test_ctrl_c_at_any_moment_of_many_calls_leaves_a_robot_that_can_be_called() -> None:
    # A call that was interrupted as it began was "still running" ever after.
    def call_again_and_again() -> None:
        while True:
            go2.wait(0.0)

    rng = np.random.default_rng(0)
    with GO2Controller(plant=StillPlant()) as go2:
        for _ in range(800):
            interrupt_somewhere_in(call_again_and_again, rng)
            go2.wait(0.01)


def test_no_call_begins_while_one_runs_that_began_as_another_one_ended(go2: GO2Controller) -> None:
    # Between two looks at who is running the first call ended: the second one ran unseen.
    release = threading.Event()

    class LateTurn(dict[str, Any]):
        def setdefault(self, key: str, call: Any = None) -> Any:  # noqa: ANN401
            running = super().setdefault(key, call)
            if running is not call:
                release.set()
                first.result(HANG_GUARD)
            return running

    go2._turn = LateTurn()
    first = in_thread(lambda: go2._call("first", lambda: {"": float(release.wait(HANG_GUARD))}))
    while not go2._turn:
        pass
    with pytest.raises(ModeError, match="while first"):
        go2._call("second", dict)


@pytest.mark.parametrize("realtime", [False, True])
def test_ctrl_c_while_a_motion_is_planned_is_raised_at_once_and_the_robot_stands_on(
    plant: WatchedPlant, monkeypatch: pytest.MonkeyPatch, *, realtime: bool
) -> None:
    count, asked = Clock.__call__, []

    def interrupt(clock: Clock, solver: object) -> None:
        count(clock, solver)
        asked.append(clock.iterations)
        if len(asked) == 2:
            signal.raise_signal(signal.SIGINT)

    jump = Timeline().jump(height=0.1234)  # in no cache of plans
    quick = Timeline().body(z=-0.02, over=0.2).home(over=0.2)
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(Clock, "__call__", interrupt)
    try:
        with GO2Controller(plant=plant, realtime=realtime) as go2:
            assert go2.stand()
            with pytest.raises(KeyboardInterrupt):
                go2.play(jump, check=False)
            assert len(asked) == 2, "in the middle of the search"
            assert go2.mode is Mode.STANDING
            assert not is_limp(plant.commands[-1])
            assert go2.play(quick, check=False), go2.last_outcome.reason
        assert is_limp(plant.commands[-1])
    finally:
        signal.signal(signal.SIGINT, usual)


class Failing(Task):
    """A task of a user's that works until it does not."""

    name, unit, weight = "failing", "m/s^2", 1e-3

    def __init__(self) -> None:
        self.ticks_left = math.inf

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        self.ticks_left -= 1
        if self.ticks_left < 0:
            raise ZeroDivisionError("a bug of mine")
        return Rows(np.eye(SIZE)[6:7], np.zeros(1))


def with_task(go2: GO2Controller, task: Task) -> ControlLoop:
    loop = go2._runner.loop
    wbc = WholeBodyController(RobotModel(), extra_tasks=[task])
    go2._runner.between_ticks(lambda: setattr(loop, "wbc", wbc))
    return loop


@pytest.mark.parametrize("realtime", [False, True])
def test_a_task_of_ones_own_that_fails_at_a_trot_leaves_a_limp_robot(
    plant: WatchedPlant, *, realtime: bool
) -> None:
    task = Failing()
    with GO2Controller(plant=plant, realtime=realtime) as go2:
        loop = with_task(go2, task)
        in_thread(lambda: _trot(go2)).result(HANG_GUARD)
        task.ticks_left = 250  # by which the call has begun
        with pytest.raises(ZeroDivisionError, match="a bug of mine"):
            in_thread(lambda: go2.wait(2.0)).result(HANG_GUARD)
        assert go2.mode is Mode.DAMPED
        assert is_limp(plant.commands[-1])
        assert "ZeroDivisionError" in go2.last_outcome.reason
        assert loop.fault is not None
        task.ticks_left = math.inf
        if realtime:
            with pytest.raises(PlantError, match="close this controller and make a new one"):
                go2.stand()
        else:
            go2.wait(1.0)
            assert go2.recover()


@pytest.mark.parametrize("error", [RuntimeError("a bug of mine"), SystemExit()])
def test_in_realtime_a_failure_after_a_tick_leaves_a_limp_robot_even_if_nobody_waits(
    plant: WatchedPlant, error: BaseException
) -> None:
    # The thread ended, the mode stayed as it was, and the last torques were held.
    fails, has_failed = threading.Event(), threading.Event()

    def after_tick() -> None:
        if fails.is_set():
            has_failed.set()
            raise error

    with GO2Controller(plant=plant, realtime=True, after_tick=after_tick) as go2:
        assert in_thread(go2.stand).result(HANG_GUARD)
        fails.set()
        assert has_failed.wait(HANG_GUARD)
        runner = go2._runner
        assert runner._thread is not None
        runner._thread.join(HANG_GUARD)
        assert go2.mode is Mode.DAMPED
        assert is_limp(plant.commands[-1])
        with pytest.raises(PlantError, match="the loop in the background has ended"):
            go2.sit()
