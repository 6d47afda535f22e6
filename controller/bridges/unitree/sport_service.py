"""Unitree's sport service on our robot: requests in, actions out, one at a time.

A request is answered when its action is done, or after ``PATIENCE`` if it is still running then (0:
it has begun), since Unitree's clients wait for one second by default. A request during another
action waits equally long for that action, then is answered 4205. ``Damp`` and ``StopMove`` never
wait.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final, final

import numpy as np

from controller.bridges.unitree import sport_api, sport_robot
from controller.bridges.unitree.messages import Reply, Request
from controller.bridges.unitree.sport_api import Api, Code, SportMode, SportStatus
from controller.jobs import Job, JobServer
from controller.modes import Aborted, Measurements, Mode, Outcome
from controller.pacing import LogOnce
from go2_wbc.errors import Go2WbcError
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.trunk import BodyPose

_log = logging.getLogger(__name__)

PATIENCE: Final = 0.8  #: Time [s] after which a request is answered at the latest
HOLD: Final = 1.0  #: Time [s] for which a ``Move`` holds
WAITING: Final = 8  #: Requests that may wait for the running action
_KNOWN: Final = frozenset(map(int, Api))
_AT_ONCE: Final = frozenset(
    {
        Api.STOP_MOVE,
        Api.MOVE,
        Api.TRAJECTORY_FOLLOW,
        Api.BODY_HEIGHT,
        Api.SPEED_LEVEL,
        Api.GET_SPEED_LEVEL,
        Api.AUTO_RECOVERY_SET,
        Api.AUTO_RECOVERY_GET,
    }
)
"""What needs no action of its own."""
_LIMP: Final = frozenset({Mode.LYING, Mode.DAMPED, Mode.FALLEN})
_ON_FEET: Final = frozenset({Mode.STANDING, Mode.WALKING})
_ENTRY: Final = {
    Api.SIT: _ON_FEET | {Mode.SITTING},
    Api.RISE_SIT: frozenset({Mode.SITTING}),
    Api.EULER: _ON_FEET,
    Api.POSE: _ON_FEET,
    Api.MOVE: _ON_FEET,
    **dict.fromkeys(sport_robot.WALKS, _ON_FEET),
    Api.RECOVERY_STAND: frozenset(Mode),
    **dict.fromkeys(sport_robot.MOTIONS, _ON_FEET),
}
"""Modes from which an action may begin; one that is not listed: from all but fallen."""


@final
class SportService:
    """Turns requests into actions of one robot."""

    def __init__(self, robot: sport_robot.SportRobot, is_released: Callable[[], bool]) -> None:
        """Serve ``robot`` unless ``is_released()`` says that low-level commands have it."""
        self._robot, self._is_released = robot, is_released
        self._jobs = JobServer(robot, queue=WAITING, patience=PATIENCE)
        self._rising: Api | None = None
        self._lock = threading.Lock()
        self._wanted, self._wanted_until = ZERO_COMMAND, 0.0
        self._path: sport_robot.SportPath | None = None
        self._level, self._clipped = 0, LogOnce(_log)
        self._recovers = self._has_tried_to_recover = False
        self._jobs.start("sport")

    # --- requests -------------------------------------------------------------------------

    def handle(self, request: Request, reply: Reply) -> None:
        """Answer a request, now or later; CommandError for a parameter that is not valid."""
        if request.api_id not in _KNOWN or request.api_id in self._robot.unsupported:
            _log.warning("request %d is not supported", request.api_id)
            reply(Code.NOT_SUPPORTED, "")
            return
        api = Api(request.api_id)
        if api is Api.DAMP:
            self._halt()
            self._jobs.damp()
            reply(Code.OK, "")
        elif self._is_released():
            reply(Code.NOT_READY, "")
        elif api in _AT_ONCE:
            reply(*self._do_at_once(api, request.parameter))
        else:
            self._path = None  # what is asked now takes its place
            self._submit(api, self._procedure(api, request.parameter), reply)

    def _do_at_once(self, api: Api, parameter: str) -> tuple[int, str]:
        """Do what needs no action of its own; the response's code, and what it says besides."""
        if api is Api.STOP_MOVE:
            self._halt()
            self._follow()
        elif api is Api.MOVE:
            self._move(sport_api.vector(parameter))
        elif api is Api.TRAJECTORY_FOLLOW:
            self._path = sport_robot.SportPath(np.array(sport_api.path_points(parameter)))
            self._follow()
        elif api is Api.BODY_HEIGHT:
            return self._raise_to(sport_api.height(parameter)), ""
        elif api is Api.SPEED_LEVEL:
            self._level = sport_api.level(parameter)
        elif api is Api.AUTO_RECOVERY_SET:
            self._recovers = sport_api.flag(parameter)
        elif api is Api.AUTO_RECOVERY_GET:
            return Code.OK, sport_api.answer(self._recovers)
        else:  # GET_SPEED_LEVEL
            return Code.OK, sport_api.answer(self._level)
        return Code.OK, ""

    def _raise_to(self, height: float) -> Code:
        """Walk at that height [m] from the usual one, from now on; 4206 if it cannot."""
        pose = replace(self._robot.pose, height=height)
        if not self._robot.can_hold(pose):
            return Code.POSE_REFUSED
        self._robot.pose = pose
        self._follow()
        return Code.OK

    def _halt(self) -> None:
        self._wanted, self._path = ZERO_COMMAND, None

    def _procedure(self, api: Api, parameter: str) -> Callable[[], None]:
        robot = self._robot
        if api is Api.EULER:
            rpy = sport_api.vector(parameter)
            return lambda: self._lean(rpy)
        if api is Api.POSE and sport_api.flag(parameter):
            return lambda: robot.lean_to(sport_robot.POSE)
        if api is Api.POSE or (api is Api.CROSS_STEP and not sport_api.flag(parameter)):
            return lambda: robot.perform(Api.BALANCE_STAND)
        if api is Api.FREE_BOUND and not sport_api.flag(parameter):
            return lambda: robot.perform(Api.TROT_RUN)
        if api in sport_robot.STANDING_UP:
            return lambda: self._rise(api)
        return lambda: robot.perform(api)

    def _rise(self, api: Api) -> None:
        """Stand up, and do what was asked meanwhile: ``BalanceStand`` may come while it rises."""
        asked, self._rising = api, api
        try:
            while True:
                self._robot.perform(asked)
                with self._lock:
                    if self._rising is asked:
                        self._rising = None  # what is asked from now on is another action
                        return
                    asked = self._rising or asked
        finally:
            self._rising = None

    def _joins(self, api: Api) -> bool:
        """Whether a robot that rises anyway needs no other action for ``api``."""
        with self._lock:
            is_rising = self._rising is not None and api in sport_robot.STANDING_UP
            if is_rising and api is not Api.STAND_UP:
                self._rising = api
        return is_rising

    def _lean(self, rpy: tuple[float, float, float]) -> None:
        """Take an attitude: on the way, if the robot walks and can hold it then, else standing."""
        pose = BodyPose(self._robot.pose.height, *rpy)
        if self._robot.mode is Mode.WALKING and self._robot.can_hold(pose):
            self._robot.pose = pose
            return
        is_beyond = (np.abs(rpy) > sport_api.EULER_LIMITS).any()
        if is_beyond or not self._robot.can_lean_to(rpy):
            raise _PoseRefused("the robot cannot take this attitude")
        self._robot.lean_to(rpy)

    def _submit(self, api: Api, perform: Callable[[], None], reply: Reply) -> None:
        def act(_job: Job) -> Measurements:
            perform()
            return {}

        def answer(answer: Outcome) -> None:
            reply(_code_of(answer), "")

        if self._joins(api):
            reply(Code.OK, "")
        else:
            self._jobs.submit(Job(api.name, act, answer, begin=lambda: self._begin(api)))

    def _begin(self, api: Api) -> str:
        """Why an action cannot begin; empty when it has."""
        self._robot.begin()
        mode = self._robot.mode
        if self._is_released():
            return f"{api.name}: low-level commands have the robot"
        if mode not in _ENTRY.get(api, frozenset(Mode) - {Mode.FALLEN}):
            return f"{api.name}: not from {mode.value}"
        return ""

    # --- walking --------------------------------------------------------------------------

    def _move(self, velocity: tuple[float, float, float]) -> None:
        self._path = None
        self._clipped.warn(*self._robot.excess(VelocityCommand(*velocity)))
        self._wanted = VelocityCommand(
            *np.clip(velocity, sport_api.MOVE_LEAST, sport_api.MOVE_GREATEST)
        )
        self._wanted_until = time.monotonic() + HOLD
        self._follow()

    def _follow(self) -> None:
        robot = self._robot
        if time.monotonic() > self._wanted_until:
            self._wanted = ZERO_COMMAND
        if self._jobs.job is not None or self._is_released():
            return
        wants_to_walk = self._path is not None or not self._wanted.is_zero
        if robot.mode is Mode.WALKING:
            self._steer()
        elif wants_to_walk and robot.mode is Mode.STANDING and not robot.is_locked:
            self._submit(Api.MOVE, lambda: robot.perform(Api.MOVE), lambda *_: None)
        elif wants_to_walk:
            what = "locked after StandUp" if robot.is_locked else robot.mode.value
            _log.warning("walking ignored: the robot is %s; BalanceStand first", what)
            self._halt()

    def _steer(self) -> None:
        """Walk along the path, or as ``Move`` says; ``SpeedLevel`` is for the latter."""
        robot, path = self._robot, self._path
        if path is None:
            robot.steer(self._wanted, sport_api.SPEED_LEVELS[self._level])
            return
        command = path.command(robot.state)
        robot.steer(command or ZERO_COMMAND, 1.0)
        if command is None and self._path is path:
            self._path = None

    def patrol(self) -> None:
        """Look after what is pending; to be called every few hundredths of a second."""
        self._jobs.expire()
        try:
            self._follow()
        except Go2WbcError as error:  # the robot fell or was damped in between
            _log.info("Move ended: %s", error)
        self._recover()

    def _recover(self) -> None:
        """Get up after a fall, once, if ``AutoRecoverySet`` has asked for it."""
        if self._robot.mode is not Mode.FALLEN:
            self._has_tried_to_recover = False
        elif self._recovers and not (self._has_tried_to_recover or self._jobs.job is not None):
            self._has_tried_to_recover = True
            self._submit(
                Api.RECOVERY_STAND, lambda: self._rise(Api.RECOVERY_STAND), lambda *_: None
            )

    # --- what it does ---------------------------------------------------------------------

    @property
    def is_idle(self) -> bool:
        """Whether no action runs or waits and the robot lies limp."""
        return self._robot.mode in _LIMP and self._jobs.job is None

    @property
    def status(self) -> SportStatus:
        """What ``rt/sportmodestate`` says of what the robot is doing."""
        job, last, robot = self._jobs.job, self._jobs.last, self._robot
        action = self._rising or (None if job is None else Api[job.name])
        if robot.is_leaning and robot.mode not in _LIMP:
            mode = SportMode.POSE
        elif action in _MODE_OF_ACTION:
            mode = _MODE_OF_ACTION[action]
        elif robot.mode is Mode.STANDING and robot.is_locked:
            mode = SportMode.JOINT_LOCK
        else:
            mode = _MODE_OF_STATE.get(robot.mode, SportMode.IDLE)
        code = Code.OK if last is None else _code_of(last)
        return SportStatus(mode, job is not None, robot.mode is Mode.WALKING, code)

    def close(self) -> None:
        """Stop: who waits is answered; the action that runs ends when the robot is closed."""
        self._jobs.abandon("the service ends")


class _PoseRefused(Aborted):
    """The robot cannot take the attitude that was asked for."""


_CODE_OF_ERROR: Final = {Aborted: Code.ACTION_TIMEOUT, _PoseRefused: Code.POSE_REFUSED}
_MODE_OF_ACTION: Final[Mapping[Api | None, SportMode]] = {
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


def _code_of(answer: Outcome) -> Code:
    if answer.ok:
        return Code.OK
    if answer.is_refused:
        return Code.NOT_READY
    return _CODE_OF_ERROR.get(type(answer.error), Code.INTERNAL)
