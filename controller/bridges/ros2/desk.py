"""The desk: takes orders for behaviours, one at a time, and answers when they have happened.

An order that comes while another is carried out is refused at once, with the reason; ``stop`` and
``damp`` always get through. It knows nothing of ROS.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.procedures import listed
from go2_wbc.errors import Go2WbcError

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of an order.

    Attributes:
        success: whether the measured state shows that it was done.
        message: why, in plain words, with what was measured.
        duration: robot time [s] that it took.
        cancelled: whether it ended early because it was called off.
    """

    success: bool
    message: str
    duration: float = 0.0
    cancelled: bool = False


Reply = Callable[[Answer], None]


@dataclass(slots=True)
class Job:
    """An order that has been accepted.

    Attributes:
        name: what the user calls it.
        act: does it; False if it was not done, with the reason in the robot's last outcome.
        reply: is told what came of it, once.
        prepare: slow work, done in a thread of its own before ``act``.
        phase: "preparing", "playing" or "returning".
        is_cancelled: whether it has been called off.
    """

    name: str
    act: Callable[[GO2Controller, Job], bool]
    reply: Reply
    prepare: Callable[[], None] | None = None
    phase: str = "preparing"
    is_cancelled: bool = False
    start: float = 0.0
    _worker: threading.Thread | None = None
    _error: Go2WbcError | None = None

    def begin(self, now: float) -> None:
        """Note the robot time and start the slow work."""
        self.start = now
        if self.prepare is not None:
            self._worker = threading.Thread(target=self._work, name="go2-prepare", daemon=True)
            self._worker.start()

    def _work(self) -> None:
        try:
            if self.prepare is not None:
                self.prepare()
        except Go2WbcError as error:
            self._error = error
        except Exception as error:  # a bug in a motion must not leave its caller without answer
            self._error = Go2WbcError(f"{type(error).__name__}: {error}")

    @property
    def is_ready(self) -> bool:
        """Whether the slow work is over."""
        return self._worker is None or not self._worker.is_alive()

    def check_prepared(self) -> None:
        """Raise the error of the slow work, if it had one."""
        if self._error is not None:
            raise self._error


@dataclass(slots=True)
class Desk:
    """Carries out one job at a time on a robot.

    ``submit``, ``cancel`` and ``damp`` may be called by any thread, also while ``work`` runs.
    """

    go2: GO2Controller
    _job: Job | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _waiting: list[tuple[str, Reply]] = field(default_factory=list)

    @property
    def job(self) -> Job | None:
        """What is being carried out."""
        return self._job

    def refusal(self) -> str:
        """Why an order cannot be accepted now; empty if it can."""
        job = self._job
        if job is None:
            return ""
        since = self.go2.state.time - job.start
        return f"busy with {job.name!r} since {since:.1f} s; ask again when it has answered"

    def submit(self, job: Job) -> str:
        """Accept ``job``, or return why not."""
        with self._lock:
            refusal = self.refusal()
            if not refusal:
                job.begin(self.go2.state.time)
                self._job = job  # from here on the loop may carry it out
        return refusal

    def work(self) -> bool:
        """Carry out the job, if there is one that is prepared; returns whether there was."""
        job = self._job
        if job is None or not job.is_ready:
            return False
        answer = self._carry_out(job)
        self._finish(job, answer)
        return True

    def _carry_out(self, job: Job) -> Answer:
        before = self.go2.last_outcome
        try:
            job.check_prepared()
            done = not job.is_cancelled and job.act(self.go2, job)
            refusal = ""
        except Go2WbcError as error:
            done, refusal = False, str(error)
        duration = self.go2.state.time - job.start
        if refusal:
            return Answer(False, refusal, duration)
        outcome = self.go2.last_outcome
        is_new = outcome is not before
        if done:
            figures = listed(outcome.measured) if is_new else ""
            message = f"done in {duration:.1f} s" + (f": {figures}" if figures else "")
            return Answer(True, message, duration)
        is_told = is_new and not outcome.ok
        reason = outcome.reason if is_told else f"{job.name} was cancelled"
        return Answer(False, reason, duration, cancelled=job.is_cancelled)

    def _finish(self, job: Job, answer: Answer) -> None:
        with self._lock:
            self._job = None
            waiting, self._waiting = self._waiting, []
        level = logging.INFO if answer.success else logging.WARNING
        _log.log(level, "%s: %s", job.name, answer.message)
        job.reply(answer)
        upright = self.go2.mode in (Mode.STANDING, Mode.SITTING, Mode.WALKING, Mode.LYING)
        for name, reply in waiting:
            reply(Answer(upright, f"{name}: {job.name} has ended; the robot is {self.state_word}"))

    @property
    def state_word(self) -> str:
        """The robot's mode as a word."""
        return self.go2.mode.value

    def cancel(self, name: str, reply: Reply | None = None) -> bool:
        """Call off what is being carried out; a motion is left safely, a posture is finished.

        Returns:
            Whether there was something; ``reply`` is told when it has ended.
        """
        with self._lock:
            job = self._job
            if job is None:
                return False
            job.is_cancelled, job.phase = True, "returning"
            if reply is not None:
                self._waiting.append((name, reply))
        self.go2.cancel()
        return True

    def damp(self) -> Answer:
        """Go limp at once; what is being prepared or carried out is called off."""
        with self._lock:
            if self._job is not None:
                self._job.is_cancelled = True
        try:
            self.go2.damp()
        except Go2WbcError as error:
            return Answer(False, str(error))
        return Answer(True, f"limp; the robot is {self.state_word}")

    def abandon(self, reason: str) -> None:
        """The end: whoever waits is told so."""
        job = self._job
        if job is not None:
            self._finish(job, Answer(False, reason, self.go2.state.time - job.start))
