"""Unitree's sport service on our robot: requests in, actions out, one at a time.

A request is answered when its action is done, or after ``PATIENCE`` if it is still running then (0:
it has begun), since Unitree's clients wait for one second by default. One that meets a running
action waits for it as long, then is answered 4205. ``Damp`` and ``StopMove`` never wait.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, final

from controller.bridges.unitree import sport_api
from controller.bridges.unitree.codec import Reply, Request
from controller.bridges.unitree.sport_api import Api, Code, SportMode
from controller.bridges.unitree.sport_robot import MOTIONS, POSE, SportRobot
from controller.modes import Mode
from controller.procedures import Aborted
from go2_wbc.errors import ClosedError, Go2WbcError
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand

_log = logging.getLogger(__name__)

PATIENCE: Final = 0.8
"""Time [s] after which a request is answered at the latest."""
HOLD: Final = 1.0
"""Time [s] for which a ``Move`` holds."""
WAITING: Final = 8
"""Requests that may wait for the running action."""
_SUPPORTED: Final = frozenset(map(int, Api))
_STANDING_UP: Final = frozenset({Api.STAND_UP, Api.BALANCE_STAND, Api.RECOVERY_STAND})
_LIMP: Final = frozenset({Mode.LYING, Mode.DAMPED, Mode.FALLEN})
_ON_FEET: Final = frozenset({Mode.STANDING, Mode.WALKING})
_ENTRY: Final = {
    Api.SIT: _ON_FEET | {Mode.SITTING},
    Api.RISE_SIT: frozenset({Mode.SITTING}),
    Api.EULER: _ON_FEET,
    Api.POSE: _ON_FEET,
    Api.MOVE: _ON_FEET,
    **dict.fromkeys(MOTIONS, _ON_FEET),
}
"""Modes from which an action may begin; one that is not listed: from all but fallen."""


@dataclass(slots=True)
class _Job:
    api: int
    perform: Callable[[], None]
    reply: Reply
    due: float
    is_answered: bool = False
    is_over: bool = False

    def answer(self, code: Code) -> None:
        if not self.is_answered:
            self.is_answered = True
            self.reply(code, "")


@final
class SportService:
    """Turns requests into actions of one robot.

    Attributes:
        error_code: of the last action that failed, 0 since one was done.
    """

    def __init__(self, robot: SportRobot, is_released: Callable[[], bool]) -> None:
        """Serve ``robot`` unless ``is_released()`` says that low-level commands have it."""
        self.error_code = 0
        self._robot, self._is_released = robot, is_released
        self._waiting: deque[_Job] = deque()
        self._running: _Job | None = None
        self._changed = threading.Condition()
        self._stopping = False
        self._wanted, self._wanted_until = ZERO_COMMAND, 0.0
        self._share = sport_api.SPEED_LEVELS[0]
        self._worker = threading.Thread(target=self._work, name="sport", daemon=True)
        self._worker.start()

    # --- requests -------------------------------------------------------------------------

    def handle(self, request: Request, reply: Reply) -> None:
        """Answer a request, now or later.

        Raises:
            CommandError: for a parameter that is not valid.
        """
        if request.api_id not in _SUPPORTED:
            _log.warning("request %d is not supported", request.api_id)
            reply(Code.NOT_SUPPORTED, "")
            return
        api = Api(request.api_id)
        if api is Api.DAMP:
            self._damp(reply)
        elif self._is_released():
            reply(Code.NOT_READY, "")
        elif api is Api.STOP_MOVE:
            self._wanted = ZERO_COMMAND
            self._follow()
            reply(Code.OK, "")
        elif api is Api.MOVE:
            self._move(sport_api.vector(request.parameter))
            reply(Code.OK, "")
        elif api is Api.SPEED_LEVEL:
            self._share = sport_api.SPEED_LEVELS[sport_api.level(request.parameter)]
            reply(Code.OK, "")
        else:
            self._submit(_Job(api, self._procedure(api, request.parameter), reply, _in(PATIENCE)))

    def _procedure(self, api: Api, parameter: str) -> Callable[[], None]:
        robot = self._robot
        if api is Api.EULER:
            rpy = sport_api.vector(parameter)
            return lambda: self._lean(rpy)
        if api is Api.POSE and sport_api.flag(parameter):
            return lambda: robot.lean_to(POSE)
        if api is Api.POSE:
            return lambda: robot.perform(Api.BALANCE_STAND)
        return lambda: robot.perform(api)

    def _lean(self, rpy: tuple[float, float, float]) -> None:
        limits = zip(rpy, sport_api.EULER_LIMITS, strict=True)
        if any(abs(angle) > limit for angle, limit in limits) or not self._robot.can_lean_to(rpy):
            raise _PoseRefused
        self._robot.lean_to(rpy)

    def _damp(self, reply: Reply) -> None:
        self._wanted = ZERO_COMMAND
        with self._changed:
            for job in self._waiting:
                job.answer(Code.NOT_READY)
            self._waiting.clear()
        self._robot.collapse("limp, as asked by Damp")
        reply(Code.OK, "")

    def _submit(self, job: _Job) -> None:
        with self._changed:
            running = self._running
            is_running = running is not None and not running.is_over
            if running and is_running and {running.api, job.api} <= _STANDING_UP:
                if job.api is not Api.STAND_UP:
                    running.perform = job.perform  # what the worker does at the end: see _work
                    running.api = job.api
                job.answer(Code.OK)
            elif len(self._waiting) >= WAITING:
                job.answer(Code.NOT_READY)
            else:
                self._waiting.append(job)
                self._changed.notify_all()

    # --- walking --------------------------------------------------------------------------

    def _move(self, velocity: tuple[float, float, float]) -> None:
        clipped = [
            min(max(value, low), high)
            for value, (low, high) in zip(velocity, sport_api.MOVE_RANGES, strict=True)
        ]
        self._wanted, self._wanted_until = VelocityCommand(*clipped), _in(HOLD)
        self._follow()

    def _follow(self) -> None:
        robot = self._robot
        if time.monotonic() > self._wanted_until:
            self._wanted = ZERO_COMMAND
        if self._running is not None or self._waiting or self._is_released():
            return
        if robot.mode is Mode.WALKING:
            robot.steer(self._wanted, self._share)
        elif not self._wanted.is_zero and robot.mode is Mode.STANDING and not robot.is_locked:
            walk = _Job(Api.MOVE, lambda: robot.perform(Api.MOVE), _no_reply, _in(PATIENCE))
            self._submit(walk)
        elif not self._wanted.is_zero:
            what = "locked after StandUp" if robot.is_locked else robot.mode.value
            _log.warning("Move ignored: the robot is %s; BalanceStand first", what)
            self._wanted = ZERO_COMMAND

    # --- actions --------------------------------------------------------------------------

    def patrol(self) -> None:
        """Look after what is pending; to be called every few hundredths of a second."""
        now = time.monotonic()
        with self._changed:
            if self._running is not None and now > self._running.due:
                self._running.answer(Code.OK)
            late = [job for job in self._waiting if now > job.due]
            for job in late:
                self._waiting.remove(job)
                job.answer(Code.NOT_READY)
        try:
            self._follow()
        except Go2WbcError as error:  # the robot fell or was damped in between
            _log.info("Move ended: %s", error)

    def _work(self) -> None:
        while True:
            with self._changed:
                self._running = None
                self._changed.wait_for(lambda: self._waiting or self._stopping)
                if self._stopping:
                    return
                job = self._running = self._waiting.popleft()
                code = self._begin(job)  # under the lock: a Damp after it ends the action
            code = code or self._perform(job)
            self.error_code = int(code)
            try:
                job.answer(code)
            except Exception:
                _log.exception("%s could not be answered", Api(job.api).name)

    def _begin(self, job: _Job) -> Code | None:
        """Why the action cannot begin, or None when it has."""
        try:
            self._robot.begin()
        except Go2WbcError as error:
            _log.error("%s not begun: %s", Api(job.api).name, error)
            return Code.INTERNAL
        return self._refusal(job)

    def _refusal(self, job: _Job) -> Code | None:
        mode, api = self._robot.mode, Api(job.api)
        if mode is Mode.FALLEN and api is not Api.RECOVERY_STAND:
            return Code.NOT_READY
        if self._is_released() or mode not in _ENTRY.get(api, Mode):
            return Code.NOT_READY
        return None

    def _perform(self, job: _Job) -> Code:
        try:
            while not job.is_over:
                perform = job.perform
                perform()
                with self._changed:  # BalanceStand may have come while it stood up
                    job.is_over = job.perform is perform
            return Code.OK
        except _PoseRefused:
            return Code.POSE_REFUSED
        except Aborted as aborted:
            _log.warning("%s not done: %s", Api(job.api).name, aborted)
            return Code.ACTION_TIMEOUT
        except ClosedError:
            return Code.INTERNAL
        except Exception:
            _log.exception("%s failed", Api(job.api).name)
            return Code.INTERNAL

    @property
    def is_idle(self) -> bool:
        """Whether no action runs or waits and the robot lies limp."""
        is_limp = self._robot.mode in _LIMP
        with self._changed:
            return is_limp and self._running is None and not self._waiting

    @property
    def is_acting(self) -> bool:
        """Whether an action is running."""
        return self._running is not None

    def sport_mode(self) -> SportMode:
        """What ``rt/sportmodestate`` calls what the robot is doing."""
        running, robot = self._running, self._robot
        if robot.is_leaning and robot.mode not in _LIMP:
            return SportMode.POSE
        if running is not None and running.api in _MODE_OF_ACTION:
            return _MODE_OF_ACTION[running.api]
        if robot.mode is Mode.STANDING and robot.is_locked:
            return SportMode.JOINT_LOCK
        return _MODE_OF_STATE.get(robot.mode, SportMode.IDLE)

    def close(self) -> None:
        """Stop; the action that runs ends when the robot is closed."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()


class _PoseRefused(Exception):
    """The robot cannot take the attitude that was asked for."""


_MODE_OF_ACTION: Final[Mapping[int, SportMode]] = {
    Api.RECOVERY_STAND: SportMode.RECOVERY_STAND,
    Api.STAND_DOWN: SportMode.LIE_DOWN,
    Api.SIT: SportMode.SIT,
}
_MODE_OF_STATE: Final = {
    Mode.LYING: SportMode.LIE_DOWN,
    Mode.STANDING: SportMode.BALANCE_STAND,
    Mode.SITTING: SportMode.SIT,
    Mode.WALKING: SportMode.LOCOMOTION,
    Mode.FALLEN: SportMode.DAMPING,
    Mode.DAMPED: SportMode.DAMPING,
}


def _in(seconds: float) -> float:
    return time.monotonic() + seconds


def _no_reply(code: int, data: str) -> None:
    """Nobody waits for it."""
