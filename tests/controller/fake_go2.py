"""A Go2 for tests that does at once what it is told, and records it: no physics, no QP.

What is called is the real ``GO2Controller``; only how a call is carried out is not, nor the pilot.
"""

import logging
import math
from collections.abc import Mapping

import numpy as np

from controller.go2_controller import GO2Controller
from controller.modes import Asked, Measurements, Mode, Outcome, Procedure
from controller.pacing import LogOnce
from controller.telemetry import Telemetry
from go2_wbc.errors import Go2WbcError, ModeError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.trunk import BodyPose
from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from motions import CompiledPlan, FeasibilityChecker, Playable

STAND_HEIGHT = find_profile().stand_height
SIT_POSE = find_profile().sit_pose

PERIOD = 0.01  #: Time [s] between two samples
SIT = {"base height [m]": float(SIT_POSE[2]), "pitch [deg]": math.degrees(SIT_POSE[4])}
STAND = {"CoM height [m]": STAND_HEIGHT}
RAISED = {"least paw height [m]": 0.6, "mean paw height [m]": 0.61}
ENDS: Mapping[str, tuple[Mode, Measurements]] = {
    "stand": (Mode.STANDING, STAND),
    "sit": (Mode.SITTING, SIT),
    "walk": (Mode.WALKING, STAND),
    "turn_left": (Mode.WALKING, {}),
    "high_five": (Mode.STANDING, RAISED),
}
"""How each call ends: the mode, and what is measured."""


class FakeGo2(GO2Controller):
    """Does what it is told, except where told otherwise.

    Args:
        speed_share: share of the commanded speed that it walks.
        yaw: heading [rad] at the start.
        refusals: reason of each call that returns False, by name.
        errors: error of each call that raises, by name.
        falls_in: name of the call in which it falls.
    """

    def __init__(
        self,
        *,
        speed_share: float = 1.0,
        yaw: float = 0.0,
        refusals: Mapping[str, str] | None = None,
        errors: Mapping[str, Go2WbcError] | None = None,
        falls_in: str = "",
    ) -> None:
        self.calls: list[str] = []
        self._share, self._yaw = speed_share, yaw
        self._refusals, self._errors = dict(refusals or {}), dict(errors or {})
        self._falls_in = falls_in
        self._the_mode, self._last, self._closed = Mode.LYING, Outcome(True, "", 0.0), False
        self._pilot, self._clipped = self, LogOnce(logging.getLogger(__name__))
        self._position, self._speed, self._time = np.zeros(2), 0.0, 0.0
        self._samples: list[tuple[float, float, float, float, float, bool]] = []
        self._telemetry = Telemetry(RobotModel(), 1)
        self._pass(PERIOD)

    def set_command(self, command: VelocityCommand, _pose: BodyPose) -> VelocityCommand:
        self.calls.append("move")
        if self._the_mode is not Mode.WALKING:
            raise ModeError(f"move() needs walking mode, not {self._the_mode.value}")
        self._speed = self._share * command.linear_x
        return command

    def excess(self, _command: VelocityCommand) -> tuple[int, str]:
        return 0, ""

    def wait(self, seconds: float) -> None:
        self._do("wait", seconds)

    def stop(self) -> None:
        self.calls.append("stop")
        self._speed = 0.0

    def turn_left(self, angle: float) -> bool:
        steps = 50
        for _ in range(steps):
            self._yaw += angle / steps
            self._pass(PERIOD)
        return self._do("turn_left")

    def high_five(
        self, side: str = "right", hold: float = 2.0, *, plan: CompiledPlan | None = None
    ) -> bool:
        self._pass(0.5, is_raised=True)
        return self._do("high_five")

    def prepare(self, motion: Playable, *, check: bool = True) -> MotionPlan:
        return FeasibilityChecker().plan(motion, check=check)

    @property
    def mode(self) -> Mode:
        return self._the_mode

    @property
    def telemetry(self) -> Telemetry:
        return self._telemetry

    @property
    def state(self) -> RobotState:
        zeros = np.zeros(4)
        q, v = np.zeros(19), np.zeros(18)
        q[6] = 1.0
        return RobotState(self._time, q, v, np.zeros(12), zeros, zeros > 0)

    def recording(self, rate: float = 100.0) -> Recording:
        time, x, y, yaw, speed, raised = (
            np.array(column) for column in zip(*self._samples, strict=True)
        )
        count = len(time)
        q, v = np.zeros((count, 19)), np.zeros((count, 18))
        q[:, 0], q[:, 1], q[:, 5], q[:, 6] = x, y, np.sin(yaw / 2), np.cos(yaw / 2)
        v[:, 0] = speed
        stance = np.ones((count, 4), dtype=bool)
        stance[:, 1] = ~raised
        forces = np.where(stance, 40.0, 0.0)
        com, margin = np.zeros((count, 3)), np.where(raised, 0.06, 0.15)
        labels = ("fake",) * count
        return Recording(time, q, v, np.zeros((count, 12)), forces, stance, com, margin, labels)

    def close(self) -> None:
        self.calls.append("close")

    def asked(self) -> None:
        """How things are before a motion is planned: as always."""

    def _call(
        self, name: str, run: Procedure, asked: Asked | None = None, *, allow_fallen: bool = False
    ) -> bool:
        return self._do(name)

    def _do(self, name: str, time: float = 0.1) -> bool:
        self.calls.append(name)
        if name in self._errors:
            raise self._errors[name]
        self._pass(time)
        if name == self._falls_in:
            self._the_mode = Mode.FALLEN
            self._last = Outcome(False, "fell at t=3.20 s: roll 71 deg, pitch 2 deg", time)
            return False
        ok = name not in self._refusals
        self._the_mode, measured = ENDS.get(name, (self._the_mode, {}))
        self._last = Outcome(ok, self._refusals.get(name, "done"), time, measured)
        return ok

    def _pass(self, seconds: float, *, is_raised: bool = False) -> None:
        for _ in range(round(seconds / PERIOD)):
            self._time += PERIOD
            ahead = np.array([math.cos(self._yaw), math.sin(self._yaw)])
            self._position = self._position + self._speed * PERIOD * ahead
            row = (self._time, *self._position, self._yaw, self._speed, is_raised)
            self._samples.append(row)
