"""What can be ordered by name, and as a motion; both end in jobs of the job server. No ROS here."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

from controller.go2_controller import GO2Controller
from controller.jobs import Job, JobServer, Reply
from controller.modes import Aborted, Measurements, Mode, Outcome
from go2_wbc.errors import CommandError, Go2WbcError, unknown_name
from go2_wbc.motion_plan import MotionPlan, Posture
from motions import Playable, find_motion
from motions.authoring import parse_values
from motions.saved.files import is_saved


@final
@dataclass(frozen=True, slots=True)
class SavedMotions:
    """Saved motions of one folder: files of numbers, never code.

    Clients ask for them by file name; no other file of the machine can be named.
    """

    folder: Path | None = None  #: that they lie in, not below it; None for none

    def __post_init__(self) -> None:
        """Raise CommandError for what is no folder."""
        if self.folder is not None and not self.folder.is_dir():
            raise CommandError(f"{self.folder} is no folder")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the files that are there now; links to other folders are not among them."""
        if self.folder is None:
            return ()
        home = self.folder.resolve()
        found = (file for file in home.iterdir() if is_saved(file.name) and file.is_file())
        return tuple(sorted(file.name for file in found if file.resolve().parent == home))

    def file(self, name: str) -> Path:
        """The file of this name, which ``GO2Controller.prepare`` takes.

        Raises:
            CommandError: for an unknown name; lists the valid ones.
        """
        if self.folder is None:
            raise CommandError(
                "no folder of saved motions was named at the start: --motions FOLDER"
            )
        if name not in (names := self.names):
            raise CommandError(unknown_name("saved motion", f"{name:.80}", names))
        return self.folder / name


NONE_SAVED = SavedMotions()  #: Only motions of the library
STOP, DAMP = "stop", "damp"
ORDERS: Mapping[str, Callable[[GO2Controller], bool]] = {
    "sit": lambda go2: go2.sit(),
    "up": lambda go2: go2.stand(),
    "walk": lambda go2: go2.walk(),
    "stand": lambda go2: go2.stand(),
    "lie_down": lambda go2: go2.lie_down(),
    "high_five": lambda go2: go2.high_five(),
    "recover": lambda go2: go2.recover(),
    "take_over": lambda go2: go2.take_over(),
}
"""What happens for a name; ``up`` and ``stand`` are the same."""
COMMANDS = (*ORDERS, STOP, DAMP)  #: All names, those of the course package's interface first
Jobs = JobServer[GO2Controller]  #: The job server of a robot that ROS 2 drives


def order(jobs: Jobs, command: str, reply: Reply) -> None:
    """Carry out ``command`` (any case); ``reply`` is called once, when it has happened."""
    name = command.strip().lower()
    if name == DAMP:
        reply(_damp(jobs))
    elif name == STOP:
        _stop(jobs, reply)
    elif name in ORDERS:
        act = ORDERS[name]
        jobs.submit(Job(name, lambda _job: _measured(jobs.robot, act), reply))
    else:
        reply(Outcome(False, unknown_name("command", command, COMMANDS)))


def _damp(jobs: Jobs) -> Outcome:
    try:
        jobs.damp()
    except Go2WbcError as error:
        return Outcome(False, str(error))
    return Outcome(True, f"limp; the robot is {jobs.robot.mode.value}")


def _stop(jobs: Jobs, reply: Reply) -> None:
    job, go2 = jobs.job, jobs.robot

    def ended() -> None:
        upright = go2.mode in (Mode.STANDING, Mode.SITTING, Mode.WALKING, Mode.LYING)
        name = job.name if job is not None else ""
        reply(Outcome(upright, f"{STOP}: {name} has ended; the robot is {go2.mode.value}"))

    if not jobs.cancel(ended):
        jobs.submit(Job(STOP, lambda _job: _measured(go2, _come_to_rest), reply))


def _come_to_rest(go2: GO2Controller) -> bool:
    if go2.mode is not Mode.WALKING:
        return True
    go2.stop()
    return go2.last_outcome.ok


def _measured(go2: GO2Controller, act: Callable[[GO2Controller], bool]) -> Measurements:
    """What a call of the robot has measured; raises Aborted, with the reason, if it did nothing."""
    before = go2.last_outcome
    done, outcome = act(go2), go2.last_outcome
    is_new = outcome is not before
    if not done:
        raise Aborted(outcome.reason if is_new and not outcome.ok else "")
    return outcome.measured if is_new else {}


def motion_job(
    motion: str,
    settings: Sequence[str],
    go2: GO2Controller,
    reply: Reply,
    saved: SavedMotions = NONE_SAVED,
) -> Job:
    """The job that goes to where a motion of the library, or a ``saved`` one, starts and plays it.

    It is aborted for what is unknown, damaged, or more than the robot can do, before it moves.
    """
    plans: list[MotionPlan] = []

    def prepare() -> None:
        plans.append(go2.prepare(_meant(motion, settings, saved)))

    def play(job: Job) -> bool:
        (plan,) = plans
        if not _take_entry(go2, plan) or job.is_cancelled:
            return False
        job.phase = "playing"
        return go2.play(plan, check=False)

    return Job(motion, lambda job: _measured(go2, lambda _go2: play(job)), reply, prepare)


def _meant(motion: str, settings: Sequence[str], saved: SavedMotions) -> Playable:
    if not is_saved(motion):
        return find_motion(motion)(**parse_values(settings))
    if settings:
        raise CommandError(f"{motion}: a saved motion has no parameters, got {', '.join(settings)}")
    return saved.file(motion)


def _take_entry(go2: GO2Controller, plan: MotionPlan) -> bool:
    if plan.entry is Posture.STAND:
        return go2.mode in (Mode.STANDING, Mode.WALKING) or go2.stand()
    if plan.entry is Posture.SIT:
        return go2.sit()
    return go2.lie_down()
