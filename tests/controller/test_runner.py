"""Time passes inside calls or in the background, and no thread can hang a call."""

import gc
import io
import logging
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future

import numpy as np
import pytest

import controller.runner
from controller.behaviours import Damped, ServoJoints
from controller.loop import ControlLoop
from controller.modes import Aborted, Fault
from controller.runner import Runner
from controller.telemetry import Telemetry
from go2_wbc.errors import ClosedError, ModeError, PlantTimeout
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.safety import SafetyConfig
from go2_wbc.wbc.controller import WholeBodyController
from tests.controller.plants import (
    HANG_GUARD,
    PERIOD,
    StillPlant,
    failing,
    in_thread,
    interrupt_somewhere_in,
    is_limp,
    wait_for,
)

TUCKED_JOINTS = find_profile().tucked_joints

FOREVER = 1e6  # s of robot time; far more than any of these tests lets pass

MakeRunner = Callable[..., Runner]


@pytest.fixture
def plant() -> StillPlant:
    return StillPlant()


@pytest.fixture
def make_runner(plant: StillPlant, model: RobotModel) -> Iterator[MakeRunner]:
    """Makes a runner; closes it at the end."""
    made: list[Runner] = []

    def make(
        *, realtime: bool, after_tick: Callable[[], None] = lambda: None, plant: StillPlant = plant
    ) -> Runner:
        wbc = WholeBodyController(model)
        loop = ControlLoop(plant, model, wbc, Telemetry(model, 1000), SafetyConfig())
        made.append(Runner(loop, realtime=realtime, after_tick=after_tick))
        return made[-1]

    yield make
    for runner in made:
        close(runner)


@pytest.fixture
def runner(make_runner: MakeRunner) -> Runner:
    """Lets time pass in calls only."""
    return make_runner(realtime=False)


@pytest.fixture
def live(make_runner: MakeRunner) -> Runner:
    """Lets time pass all the time."""
    return make_runner(realtime=True)


def close(runner: Runner) -> None:
    """Closes from another thread, so that a runner that cannot be closed fails the test."""
    in_thread(runner.close).result(HANG_GUARD)


def loop_threads() -> set[threading.Thread]:
    """The threads in which loops run, those of other tests included."""
    return {thread for thread in threading.enumerate() if thread.name == "go2-loop"}


def test_time_passes_in_calls_only_and_on_each_until_it_is_done_or_at_its_limit(
    runner: Runner, plant: StillPlant
) -> None:
    runner.engage(Damped())
    assert not plant.commands
    assert runner.loop.state.time == 0.0
    assert runner.advance_until(lambda: len(plant.commands) == 7, FOREVER)
    assert len(plant.commands) == 7
    assert not runner.advance_until(lambda: False, 10 * PERIOD)
    assert len(plant.commands) in (17, 18)


def test_an_interruption_between_two_calls_damps_at_once(runner: Runner, plant: StillPlant) -> None:
    runner.interrupt("a test")
    assert runner.loop.fault == Fault("a test")
    assert len(plant.commands) == 1
    assert is_limp(plant.commands[0])


def under_way(runner: Runner) -> Future[bool]:
    """A call without an end, which another thread makes."""
    begun = threading.Event()
    call = in_thread(lambda: runner.advance_until(lambda: bool(begun.set()), FOREVER))
    wait_for(begun)
    return call


@pytest.mark.parametrize("realtime", [False, True])
def test_closing_from_another_thread_ends_a_long_call_and_no_tick_follows(
    make_runner: MakeRunner, plant: StillPlant, *, realtime: bool
) -> None:
    before = loop_threads()
    runner = make_runner(realtime=realtime)
    assert len(loop_threads() - before) == realtime
    call = under_way(runner)
    for _ in range(2):
        close(runner)
    with pytest.raises(ClosedError, match="closed during a call"):
        call.result(HANG_GUARD)
    assert loop_threads() == before
    assert is_limp(plant.commands[-1])
    ticks = len(plant.commands)
    with pytest.raises(ClosedError):
        runner.advance_until(lambda: False, FOREVER)
    with pytest.raises(ClosedError):
        runner.engage(Damped())
    assert len(plant.commands) == ticks


def test_a_fault_between_two_behaviours_of_a_call_is_not_lost(runner: Runner) -> None:
    # damp() once vanished when it came just before the next behaviour of a running call.
    runner.begin()
    runner.engage(Damped("first"))
    runner.interrupt("a test")
    with pytest.raises(Aborted, match=r"^a test$"):
        runner.engage(Damped("second"))
    assert runner.loop.behaviour.label == "damped"


def test_a_fault_from_before_a_call_does_not_forbid_it_and_the_same_one_again_does(
    runner: Runner,
) -> None:
    for _ in range(2):
        runner.interrupt("a test")
        runner.begin()
    runner.interrupt("a test")
    with pytest.raises(Aborted, match=r"^a test$"):
        runner.engage(Damped())
    runner.begin()
    runner.engage(Damped())
    assert runner.loop.fault is None


def test_the_last_word_to_the_plant_is_to_go_limp(runner: Runner, plant: StillPlant) -> None:
    runner.engage(ServoJoints("hold", ((1.0, TUCKED_JOINTS),)))
    runner.advance_until(lambda: False, 5 * PERIOD)
    assert not is_limp(plant.commands[-1])
    close(runner)
    assert is_limp(plant.commands[-1])


def test_in_realtime_time_passes_by_itself(make_runner: MakeRunner, plant: StillPlant) -> None:
    tenth = threading.Event()
    plant.on_write = lambda: tenth.set() if len(plant.commands) == 10 else None
    make_runner(realtime=True)
    wait_for(tenth)


def test_in_realtime_a_call_waits_for_what_it_wants_to_see(live: Runner, plant: StillPlant) -> None:
    assert live.advance_until(lambda: plant.state.time > 0.1, FOREVER)
    assert not live.advance_until(lambda: False, 0.02)


def test_in_realtime_late_ticks_are_counted_in_the_telemetry(
    make_runner: MakeRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    class LatePacer:
        def __init__(self, *_: float) -> None:
            self.missed = 0

        def wait(self) -> float:
            self.missed += 1
            return 0.0

    monkeypatch.setattr(controller.runner, "Pacer", LatePacer)
    runner = make_runner(realtime=True)
    assert runner.advance_until(lambda: runner.loop.telemetry.missed_deadlines >= 3, FOREVER)


def test_garbage_is_looked_for_in_new_objects_only_while_a_loop_keeps_pace(
    make_runner: MakeRunner,
) -> None:
    gc.unfreeze()
    for are_frozen in (False, True):  # by the program itself, the second time
        runner = make_runner(realtime=True)
        assert runner.advance_until(lambda: True, FOREVER)
        assert gc.get_freeze_count() > 0
        close(runner)
        assert (gc.get_freeze_count() > 0) is are_frozen
        gc.freeze()


@pytest.mark.parametrize("error", [PlantTimeout("no answer"), ValueError("a bug")])
@pytest.mark.parametrize("is_after_tick", [False, True])
def test_a_failure_in_the_background_ends_a_waiting_call_with_it_and_every_later_one(
    make_runner: MakeRunner, plant: StillPlant, error: Exception, *, is_after_tick: bool
) -> None:
    # Anything but a PlantError once killed the thread and left the call waiting for ever.
    def fail_later() -> None:
        if len(plant.commands) >= 5:
            raise error

    if not is_after_tick:
        plant.on_write = fail_later
    runner = make_runner(realtime=True, after_tick=fail_later)
    for _ in range(2):
        call = in_thread(lambda: runner.advance_until(lambda: False, FOREVER))
        with pytest.raises(type(error), match=str(error)):
            call.result(HANG_GUARD)
    assert runner.loop.fault is not None


def test_in_realtime_ctrl_c_at_any_moment_of_a_wait_leaves_a_loop_that_runs(
    make_runner: MakeRunner,
) -> None:
    # It was raised just after a lock had been taken, or before it was given back: 1 of 80 hung.
    runner = make_runner(realtime=True, plant=StillPlant(period=2e-4))
    rng = np.random.default_rng(0)
    for _ in range(800):
        interrupt_somewhere_in(lambda: runner.advance_until(lambda: False, FOREVER), rng)
        runner.interrupt("a test")
        runner.begin()
        runner.engage(Damped())
        assert runner.advance_until(lambda: True, FOREVER)


def test_in_realtime_a_log_handler_that_is_taken_keeps_no_robot_from_going_limp(
    make_runner: MakeRunner, plant: StillPlant
) -> None:
    # Ctrl-C in a program that logged left its lock taken: the loop waited for it before it damped.
    runner = make_runner(realtime=True)
    runner.engage(ServoJoints("hold", ((1.0, TUCKED_JOINTS),)))
    handler = logging.StreamHandler(io.StringIO())
    logging.getLogger().addHandler(handler)
    handler.acquire()
    try:
        runner.interrupt("a test")
        ticks = len(plant.commands)
        assert not runner.advance_until(lambda: True, FOREVER)
        assert runner.between_ticks(lambda: len(plant.commands)) > ticks
        assert is_limp(plant.commands[-1])
    finally:
        handler.release()
        logging.getLogger().removeHandler(handler)
    close(runner)
    assert "a test" in handler.stream.getvalue().splitlines()  # beside a lag, on a busy machine


def test_in_realtime_no_call_begins_within_a_tick(
    make_runner: MakeRunner, plant: StillPlant
) -> None:
    refused = threading.Event()

    def call() -> None:
        plant.on_write = lambda: None
        with pytest.raises(ModeError, match="within"):
            runner.begin()
        assert runner.between_ticks(lambda: True)
        refused.set()

    runner = make_runner(realtime=True)
    plant.on_write = call
    assert runner.advance_until(refused.is_set, FOREVER)


def test_an_interruption_is_told_if_what_another_thread_does_to_the_loop_does_not_end(
    make_runner: MakeRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controller.runner, "HANG_LIMIT", 0.1)
    runner = make_runner(realtime=False)
    begun, released = threading.Event(), threading.Event()

    def hang() -> None:
        begun.set()
        released.wait(HANG_GUARD)

    work = in_thread(lambda: runner.between_ticks(hang))
    wait_for(begun)
    with pytest.raises(PlantTimeout):
        in_thread(lambda: runner.interrupt("a test")).result(HANG_GUARD)
    released.set()
    work.result(HANG_GUARD)


def test_what_is_done_between_ticks_is_done_after_the_end_too(live: Runner) -> None:
    here = threading.current_thread()
    assert live.between_ticks(threading.current_thread) is not here
    close(live)
    assert live.between_ticks(threading.current_thread) is here


def test_closing_a_runner_whose_plant_has_died_does_not_raise(
    runner: Runner, plant: StillPlant
) -> None:
    plant.on_write = failing(PlantTimeout("no answer"))
    close(runner)
