"""The robot behind the sport service: a pilot in real time, and what each action does with it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Final, final

import numpy as np
from jaxtyping import Float

from controller.assembly import PilotSettings, build_pilot
from controller.behaviours.plans import ChangePosture
from controller.bridges.unitree.sport_api import Api
from controller.modes import Mode
from controller.procedures import ProcedureRunner
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant.base import Plant
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.state import RobotState
from motions import FeasibilityChecker, Timeline, compile_timeline, load_motion
from motions.postures import lean

_log = logging.getLogger(__name__)

MOTIONS: Final[Mapping[int, str]] = {
    Api.HELLO: "wave",
    Api.STRETCH: "stretch",
    Api.DANCE1: "dance",
    Api.SCRAPE: "shake_paw",
}
"""The motion of the library that stands for each of Unitree's."""
POSE: Final = (0.12, -0.15, 0.2)
"""Roll, pitch, yaw [rad] of ``Pose``."""
FINDINGS_TOLD: Final = 3
"""Findings of the feasibility check that a refusal names."""
ATTITUDE_TOLERANCE: Final = 0.06
"""Angle [rad] from the asked attitude that still counts as there."""
LEAN_TIME, LEAN_LIMIT = 1.0, 2.0
"""Time [s] that leaning takes, and may take at most."""


@final
class SportRobot:
    """A robot that lives in real time and does one action after the other.

    Attributes:
        is_locked: whether it stands with locked joints, after ``StandUp``, and does not walk.
        is_leaning: whether it holds an attitude, after ``Euler`` or ``Pose``.
        pilot: runs the procedures.
    """

    def __init__(
        self, plant: Plant, config: Config, after_tick: Callable[[], None] = lambda: None
    ) -> None:
        """Take over a robot that lies on the ground; call ``after_tick`` after every tick."""
        self._config = config
        self._checker = FeasibilityChecker()  # with a model of its own: the loop is another thread
        self._plans: dict[int, MotionPlan] = {
            api: compile_timeline(load_motion(name), self._checker.model)
            for api, name in MOTIONS.items()
        }
        settings = PilotSettings(realtime=True, recorded_time=0.0, after_tick=after_tick)
        self._assembly = build_pilot(plant, config, settings)
        self.pilot, self._runner = self._assembly.pilot, self._assembly.runner
        self._procedures = ProcedureRunner(self._runner)
        self.is_locked = False
        self.is_leaning = False
        self._actions: Mapping[int, Callable[[], None]] = {
            Api.BALANCE_STAND: self._balance_stand,
            Api.STAND_UP: self._stand_up,
            Api.STAND_DOWN: self._stand_down,
            Api.RECOVERY_STAND: self._recover,
            Api.SIT: self._sit,
            Api.RISE_SIT: self._balance_stand,
            Api.MOVE: self._start_walking,
        }

    @property
    def mode(self) -> Mode:
        """What the robot is doing."""
        return self.pilot.mode

    @property
    def state(self) -> RobotState:
        """The newest measured state."""
        return self._runner.loop.state

    @property
    def is_alive(self) -> bool:
        """Whether the control loop still runs."""
        return self._runner.is_alive

    def begin(self) -> None:
        """Begin an action: whatever makes the robot limp from now on ends it.

        Raises:
            PlantError: if the control loop has ended.
        """
        self.pilot.begin()

    def perform(self, api: int) -> None:
        """Do an action that has begun, or play the motion that stands for it.

        Raises:
            Aborted: if it was not done; says why.
        """
        if api in self._plans:
            self._stand_if_leaning()
            self.is_locked = False
            self.pilot.play(self._plans[api])
        else:
            self._actions[api]()

    def lean_to(self, rpy: tuple[float, float, float]) -> None:
        """Turn the trunk to roll, pitch, yaw [rad] over the feet and hold it.

        Raises:
            Aborted: if it does not get there.
        """
        if self.mode is Mode.WALKING:
            self.pilot.square_up()
        target = np.array(rpy)
        self.is_leaning = True
        behaviour = ChangePosture(lambda pose: lean(pose, target, LEAN_TIME))
        self._procedures.run(behaviour, LEAN_LIMIT)
        self._procedures.settle("lean", lambda snapshot: self._is_at(target, snapshot.state.rpy))

    def _is_at(self, wanted: Float[np.ndarray, "3"], rpy: Float[np.ndarray, "3"]) -> bool:
        return bool(np.abs(rpy[:2] - wanted[:2]).max() < ATTITUDE_TOLERANCE)

    def can_lean_to(self, rpy: tuple[float, float, float]) -> bool:
        """Whether the feasibility check finds nothing against this attitude."""
        roll, pitch, yaw = rpy
        line = Timeline().body(roll=roll, pitch=pitch, yaw=yaw, over=LEAN_TIME).hold(0.2)
        plan = compile_timeline(line.home(over=LEAN_TIME), self._checker.model)
        report = self._checker.check(plan)
        if not report.ok:
            first = "; ".join(map(str, report.failures[:FINDINGS_TOLD]))
            _log.warning("attitude %s refused, %d findings: %s", rpy, len(report.failures), first)
        return report.ok

    def steer(self, command: VelocityCommand, share: float) -> None:
        """Follow ``command``, within ``share`` of the walking envelope; only in walking mode."""
        x, y, turn = command.linear_x, command.linear_y, command.angular_z
        inside = self._config.envelope.clip(VelocityCommand(x / share, y / share, turn / share))
        x, y, turn = inside.linear_x, inside.linear_y, inside.angular_z
        self.pilot.set_command(VelocityCommand(share * x, share * y, share * turn))

    def damp(self) -> None:
        """Go limp at once; ends the action that runs."""
        self.is_locked = self.is_leaning = False
        self.pilot.collapse("limp, as asked by Damp")

    def cancel(self) -> None:
        """Leave the motion that plays, safely, and stand."""
        self.pilot.return_safely()

    def close(self) -> None:
        """Go limp and stop."""
        self._assembly.close()

    def _balance_stand(self) -> None:
        self.pilot.stand()
        self.is_locked = self.is_leaning = False

    def _stand_up(self) -> None:
        self.pilot.stand()
        self.is_locked, self.is_leaning = True, False

    def _stand_down(self) -> None:
        self._stand_if_leaning()
        self.is_locked = False
        self.pilot.lie_down()

    def _recover(self) -> None:
        self.pilot.recover()
        self.is_locked = self.is_leaning = False

    def _sit(self) -> None:
        self._stand_if_leaning()
        self.is_locked = False
        self.pilot.sit()

    def _start_walking(self) -> None:
        self._stand_if_leaning()
        self.pilot.walk("trot")

    def _stand_if_leaning(self) -> None:
        if self.is_leaning:
            self.pilot.stand()
            self.is_leaning = False
