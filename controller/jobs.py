"""The job server: what a robot is asked to do, one job at a time, whatever thread asks.

While one job is carried out others are refused, or wait for their turn. Slow preparation runs in a
thread of its own. Every job is answered exactly once. The ROS 2 node, Unitree's sport service and
teleoperation are built on it; it does not depend on them.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar, final, runtime_checkable

from controller.modes import Aborted, Measurements, Outcome, listed
from go2_wbc.errors import Go2WbcError
from go2_wbc.robot.state import RobotState

_log = logging.getLogger(__name__)


@runtime_checkable
class _Stoppable(Protocol):
    @property
    def state(self) -> RobotState: ...
    def cancel(self) -> None: ...
    def damp(self) -> None: ...


Robot = TypeVar("Robot", bound=_Stoppable)


Reply = Callable[[Outcome], None]
"""Is told what came of a job, which is ``ok`` too if it has begun when the patience ends."""


@dataclass(slots=True, eq=False)
class Job:
    """Something to do."""

    name: str  #: what the user calls it
    act: Callable[[Job], Measurements]
    """Does it and returns what was measured; raises ``Aborted`` or a ``Go2WbcError`` if it was not
    done."""
    reply: Reply  #: is told what came of it, once
    prepare: Callable[[], None] | None = None
    """Slow work, done in a thread of its own before ``act``."""
    begin: Callable[[], str] = lambda: ""
    """Called just before ``act``; returns why the job cannot begin, or nothing. A ``damp`` from now
    on must end ``act``."""
    phase: str = "preparing"  #: "preparing", "playing" or "returning"
    is_cancelled: bool = False  #: whether it has been called off
    start: float = 0.0  #: robot time [s] at which its turn came
    _due: float = math.inf
    _is_prepared: bool = True
    _is_answered: bool = False
    _error: Exception | None = None
    _followers: list[Callable[[], None]] = field(default_factory=list)


@final
class JobServer(Generic[Robot]):
    """Carries out one job at a time on a robot.

    Any thread may submit, cancel and damp, also while a job is carried out. That happens in the
    thread that calls ``work``, or in one of the server's own after ``start``; never in both.
    """

    def __init__(self, robot: Robot, *, queue: int = 0, patience: float = math.inf) -> None:
        """Serve ``robot``.

        Args:
            robot: that carries out the jobs.
            queue: jobs that may wait for their turn; with 0 a second one is refused.
            patience: time [s] after which ``expire`` answers a job that is not over.
        """
        self.robot = robot  #: that carries them out
        self.last: Outcome | None = None  #: what came of the last job whose turn came, or None
        self._queue, self._patience = queue, patience
        self.job: Job | None = None  #: what is being prepared or carried out, or None
        self._waiting: deque[Job] = deque()
        self._changed = threading.Condition()
        self._end = ""
        self._thread: threading.Thread | None = None

    def refusal(self) -> str:
        """Why a job cannot be accepted now; empty if it can."""
        job = self.job
        if self._end or job is None or len(self._waiting) < self._queue:
            return self._end
        lasted = self._lasted(job)
        return f"busy with {job.name!r} since {lasted:.1f} s; ask again when it has answered"

    def submit(self, job: Job) -> bool:
        """Accept ``job``, or answer why not; returns whether it was accepted."""
        with self._changed:
            refusal = self.refusal()
            if not refusal:
                job._due = time.monotonic() + self._patience
                self._waiting.append(job)
                self._take_turn()
        if refusal:
            self._answer(job, Outcome(False, refusal, is_refused=True))
        return not refusal

    def expire(self) -> None:
        """Answer what has lasted longer than the patience; to be called again and again."""
        now = time.monotonic()
        with self._changed:
            running, waiting = self.job, self._waiting
            self._waiting = deque(job for job in waiting if now <= job._due)
        if running is not None and now > running._due:
            self._answer(running, Outcome(True, f"{running.name} has begun"))
        self._refuse((job for job in waiting if now > job._due), "has waited in vain")

    def cancel(self, then: Callable[[], None] | None = None) -> bool:
        """Call off what is being carried out, if anything; ``then`` is called when it has ended."""
        with self._changed:
            job = self.job
            if job is None:
                return False
            job.is_cancelled, job.phase = True, "returning"
            if then is not None:
                job._followers.append(then)
        self.robot.cancel()
        return True

    def damp(self) -> None:
        """Go limp at once; what waits is refused, what is carried out ends."""
        with self._changed:
            waiting, self._waiting = self._waiting, deque()
            if self.job is not None:
                self.job.is_cancelled = True
        self._refuse(waiting, "was cancelled")
        self.robot.damp()

    def abandon(self, reason: str, limit: float = 0.0) -> None:
        """The end: who waits is told why; a thread of the server's own gets ``limit`` seconds."""
        with self._changed:
            self._end = reason
            running, waiting, self._waiting = self.job, self._waiting, deque()
            if running is not None:
                running.is_cancelled = True
            self._changed.notify_all()
        self._refuse(waiting, f"was not begun: {reason}")
        if running is not None:
            self._finish(running, Outcome(False, reason, self._lasted(running)))
        if self._thread is not None:
            self._thread.join(limit)

    # --- carrying out ---------------------------------------------------------------------

    def start(self, name: str) -> None:
        """Carry out jobs in a thread called ``name``, until ``abandon``."""
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(
                    lambda: self._end or (self.job is not None and self.job._is_prepared)
                )
                if self._end:
                    return
            self.work()

    def work(self) -> bool:
        """Carry out the job whose turn it is, if it is prepared; returns whether there was one."""
        job = self.job
        if job is None or not job._is_prepared:
            return False
        self.last = answer = self._carry_out(job)
        level = logging.INFO if answer.ok else logging.WARNING
        _log.log(level, "%s: %s", job.name, answer.reason)
        self._finish(job, answer)
        return True

    def _carry_out(self, job: Job) -> Outcome:
        error: Exception
        try:
            with self._changed:  # a damp() before this keeps the job from beginning
                if job._error is not None:
                    raise job._error
                refusal = f"{job.name} was cancelled" if job.is_cancelled else job.begin()
            measured = {} if refusal else job.act(job)
        except (Aborted, Go2WbcError) as failure:
            error, message = failure, str(failure) or f"{job.name} was cancelled"
        except Exception as failure:  # a bug must not leave its caller without an answer
            _log.exception("%s failed", job.name)
            error, message = failure, f"{type(failure).__name__}: {failure}"
        else:
            lasted, was_cancelled = self._lasted(job), job.is_cancelled
            if refusal:
                return Outcome(False, refusal, lasted, cancelled=was_cancelled, is_refused=True)
            told = f": {listed(measured)}" if measured else ""
            return Outcome(True, f"done in {lasted:.1f} s{told}", lasted, measured)
        was_cancelled = job.is_cancelled and isinstance(error, Aborted)
        return Outcome(False, message, self._lasted(job), cancelled=was_cancelled, error=error)

    def _lasted(self, job: Job) -> float:
        return self.robot.state.time - job.start

    def _take_turn(self) -> None:
        """Let the next job have its turn; the lock is held."""
        if self.job is not None or not self._waiting:
            return
        job = self._waiting.popleft()
        job.start = self.robot.state.time
        if job.prepare is not None:
            job._is_prepared = False
            args = (job, job.prepare)
            threading.Thread(target=self._prepare, args=args, name="prepare", daemon=True).start()
        self.job = job
        self._changed.notify_all()

    def _prepare(self, job: Job, prepare: Callable[[], None]) -> None:
        try:
            prepare()
        except Exception as error:  # raised again when the job is carried out
            job._error = error
        with self._changed:
            job._is_prepared = True
            self._changed.notify_all()

    def _refuse(self, jobs: Iterable[Job], why: str) -> None:
        for job in jobs:
            self._answer(job, Outcome(False, f"{job.name} {why}", is_refused=True))

    def _finish(self, job: Job, answer: Outcome) -> None:
        with self._changed:
            if self.job is job:
                self.job = None
                self._take_turn()
            followers, job._followers = job._followers, []
        self._answer(job, answer)
        for then in followers:
            self._guarded(job, then)

    def _answer(self, job: Job, answer: Outcome) -> None:
        with self._changed:
            if job._is_answered:
                return
            job._is_answered = True
        self._guarded(job, lambda: job.reply(answer))

    @staticmethod
    def _guarded(job: Job, tell: Callable[[], object]) -> None:
        try:
            tell()
        except Exception:  # of the middleware; the robot goes on
            _log.exception("%s could not be answered", job.name)
