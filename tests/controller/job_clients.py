"""A robot that does nothing, and clients of its job server that keep what they were answered."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import NoReturn

from controller.jobs import Answer, Job, JobServer
from controller.modes import Measurements
from go2_wbc.robot.state import RobotState
from tests.controller.plants import HANG_GUARD, lying_state


class Robot:
    """Does nothing, and notes what it was told."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.time = 0.0
        self.is_limp = threading.Event()

    @property
    def state(self) -> RobotState:
        return lying_state(self.time)

    def cancel(self) -> None:
        self.calls.append("cancel")

    def damp(self) -> None:
        self.calls.append("damp")
        self.is_limp.set()


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Client:
    """Submits jobs and keeps what they were answered, in order."""

    def __init__(self, jobs: JobServer[Robot]) -> None:
        self.jobs, self.is_accepted = jobs, False
        self.answers: list[tuple[str, Answer]] = []
        self.answered = threading.Condition()

    def submit(
        self,
        name: str,
        act: Callable[[Job], Measurements] = lambda _job: {},
        prepare: Callable[[], None] | None = None,
        begin: Callable[[], str] = lambda: "",
    ) -> None:
        def reply(answer: Answer) -> None:
            with self.answered:
                self.answers.append((name, answer))
                self.answered.notify_all()

        job = Job(name, act, reply, prepare, begin)
        self.is_accepted = self.jobs.submit(job)

    def does(self, name: str, act: Callable[[Job], Measurements] = lambda _job: {}) -> Answer:
        """What a job is answered that is carried out now."""
        self.submit(name, act)
        assert self.jobs.work()
        return self.only(name)

    def told(self, name: str) -> list[Answer]:
        return [answer for told, answer in self.answers if told == name]

    def only(self, name: str) -> Answer:
        """The answer to this job, which has come once; waits for it."""
        with self.answered:
            assert self.answered.wait_for(lambda: self.told(name), HANG_GUARD)
        (answer,) = self.told(name)
        return answer


def now(event: threading.Event) -> None:
    assert event.wait(HANG_GUARD)


def failing(error: Exception) -> Callable[..., NoReturn]:
    def act(*_: object) -> NoReturn:
        raise error

    return act
