"""Plants that can be watched and made to fail, a QP that cannot be solved, threads, and Ctrl-C."""

import gc
import itertools
import logging
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from typing import Any, NoReturn, TypeVar

import numpy as np
import pytest

from controller.behaviours import DAMPING
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.reference import Reference
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.state import JointCommand, RobotState, Snapshot
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController

TUCKED_JOINTS = find_profile().tucked_joints

# s; twice the usual control period: the robot stands alike and the tests take half the time.
PERIOD = 0.004
# s; only ends a test that hangs. No result depends on it.
HANG_GUARD = 120.0
MID_RISE = 1.5  # s of robot time: in the middle of rising, when the whole-body QP is at work

# s; range of the time after which Ctrl-C comes, and after which it comes again: Python swallows one
# that comes in a destructor.
SOON, LATER, AGAIN = 1e-3, 4e-3, 5.0

_Result = TypeVar("_Result")


class WatchedPlant(Plant):
    """Hands everything on to a ``MujocoPlant``; ``on_write`` and ``on_read`` may interfere."""

    def __init__(self, inner: MujocoPlant | None = None) -> None:
        self.inner = MujocoPlant(control_period=PERIOD) if inner is None else inner
        self.commands: list[JointCommand] = []
        self.on_write: Callable[[], None] = lambda: None
        self.on_read: Callable[[RobotState], RobotState] = lambda state: state

    @property
    def control_period(self) -> float:
        return self.inner.control_period

    def read(self) -> RobotState:
        return self.on_read(self.inner.read())

    def write(self, command: JointCommand) -> None:
        self.on_write()
        self.inner.write(command)
        self.commands.append(command)

    def close(self) -> None:
        self.inner.close()

    def once_at(self, time: float, action: Callable[[], None]) -> None:
        """Does ``action`` in the first write at or after ``time`` [s]."""

        def act() -> None:
            if self.inner.time >= time - 1e-9:
                self.on_write = lambda: None
                action()

        self.on_write = act

    def from_time(self, time: float, action: Callable[[], None]) -> None:
        """Does ``action`` in every write from ``time`` [s] on."""
        self.on_write = lambda: action() if self.inner.time >= time - 1e-9 else None


class StillPlant(Plant):
    """A robot that lies still whatever its motors do, in vain; only its clock goes on."""

    def __init__(self, period: float = PERIOD) -> None:
        self._period = period
        self.commands: list[JointCommand] = []
        self.on_write: Callable[[], None] = lambda: None
        self.state = lying_state(0.0)
        self.is_clock_standing = False

    @property
    def control_period(self) -> float:
        return self._period

    def read(self) -> RobotState:
        return self.state

    def write(self, command: JointCommand) -> None:
        self.on_write()
        self.commands.append(command)
        if not self.is_clock_standing:
            pull = command.kp * (command.q_des - self.state.joint_positions)
            tau = command.tau + pull + command.kd * command.v_des
            self.state = replace(self.state, time=self.state.time + self._period, tau=tau)

    def close(self) -> None: ...


def lying_state(time: float) -> RobotState:
    """A robot on its belly with tucked legs."""
    q = np.concatenate([[0.0, 0.0, 0.08, 0.0, 0.0, 0.0, 1.0], TUCKED_JOINTS])
    return RobotState(time, q, np.zeros(18), np.zeros(12), np.full(4, 10.0), np.ones(4, bool))


def is_limp(command: JointCommand) -> bool:
    """Whether ``command`` is the safe one: damping, nothing else."""
    passive = not (command.tau.any() or command.kp.any() or command.v_des.any())
    return passive and bool((command.kd == DAMPING).all())


def break_qp(monkeypatch: pytest.MonkeyPatch, is_broken: Callable[[int], bool]) -> None:
    """Asks the impossible of the n-th QP for which ``is_broken(n)``: more force than is allowed."""
    real, count = WholeBodyController.solve, itertools.count()

    def solve(
        self: WholeBodyController, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        if is_broken(next(count)):
            least = reference.normal_force_max + 100.0
            reference = replace(reference, normal_force_min=least)
        return real(self, snapshot, reference, relax=relax)

    monkeypatch.setattr(WholeBodyController, "solve", solve)


class Clock:
    """Stands still unless a test changes ``now``."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def wait_for(event: threading.Event) -> None:
    assert event.wait(HANG_GUARD)


def failing(error: BaseException) -> Callable[..., NoReturn]:
    def act(*_: object, **__: object) -> NoReturn:
        raise error

    return act


def in_thread(call: Callable[[], _Result]) -> Future[_Result]:
    """Runs ``call`` in another thread, one that cannot keep the process alive."""
    future: Future[_Result] = Future()

    def run() -> None:
        try:
            future.set_result(call())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return future


def interrupt_somewhere_in(endless: Callable[[], object], rng: np.random.Generator) -> None:
    """Raises KeyboardInterrupt wherever the main thread then is in ``endless()``, and catches it.

    By a timer of the kernel: a thread that interrupts does so only while the main thread waits.
    Without the test run's own hooks: an interrupt is lost in a callback of the garbage collector,
    and one in a log handler, before Python 3.13, leaves its lock taken for all other threads.
    """

    def begin() -> None:
        signal.setitimer(signal.ITIMER_REAL, rng.uniform(SOON, LATER), AGAIN)
        endless()

    hooks: list[list[Any]] = [gc.callbacks, logging.root.handlers]
    kept = [list(some) for some in hooks]
    usual = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        for some in hooks:
            some.clear()
        with pytest.raises(KeyboardInterrupt):
            begin()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, usual)
        for some, before in zip(hooks, kept, strict=True):
            some[:] = before
