"""The robot behind the sport service: a pilot in real time, and what actions and paths do."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final, final

import numpy as np
from jaxtyping import Float

from controller.assembly import build_pilot
from controller.behaviours.plans import ChangePosture
from controller.bridges.unitree.sport_api import Api
from controller.modes import Limited, Mode
from controller.navigation import APPROACH
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS
from go2_wbc.errors import CommandError, Go2WbcError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.plant.base import Plant
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle
from go2_wbc.robot.state import RobotState, Snapshot
from motions import FeasibilityChecker, Timeline, compile_motion, compile_timeline, motion_names
from motions.postures import lean

_log = logging.getLogger(__name__)

MOTIONS: Final[Mapping[int, str]] = {
    Api.HELLO: "wave",
    Api.STRETCH: "stretch",
    Api.CONTENT: "content",
    Api.DANCE1: "dance",
    Api.DANCE2: "dance2",
    Api.SCRAPE: "shake_paw",
    Api.FRONT_JUMP: "jump_forward",
    Api.FRONT_POUNCE: "pounce",
    Api.WIGGLE_HIPS: "wiggle_hips",
    Api.HEART: "heart",
    Api.CROSS_STEP: "cross_step",
}
"""The motion of the library that stands for each of Unitree's, if the library has it."""
WALKS: Final[Mapping[int, str]] = {
    Api.STATIC_WALK: "walk",
    Api.TROT_RUN: "trot",
    Api.FREE_BOUND: "bound",
}
"""The gait that stands for each of Unitree's, if there is one of that name."""
WALKING: Final = frozenset({Api.MOVE, *WALKS})  #: What enters walking mode, or stays in it
STANDING_UP: Final = frozenset({Api.STAND_UP, Api.BALANCE_STAND, Api.RECOVERY_STAND})
POSE: Final = (0.12, -0.15, 0.2)  #: Roll, pitch, yaw [rad] of ``Pose``
FINDINGS_TOLD: Final = 3  #: Findings of the feasibility check that a refusal names
ATTITUDE_TOLERANCE: Final = 0.06  #: Angle [rad] from the asked attitude that still counts as there
LEAN_TIME, LEAN_LIMIT = 1.0, 2.0  #: Time [s] that leaning takes, and may take at most
ARRIVAL_TIME: Final = 2.0
"""Time [s] after its last point that a robot gets to reach it: own choice."""
NEAR_PLACE, NEAR_ANGLE = 0.02, math.radians(1.5)
"""Distance [m] and angle [rad] from the last point that count as there: those of a goal."""


@final
class SportRobot:
    """A robot that lives in real time and does one action after the other.

    Attributes:
        is_locked: whether it stands with locked joints, after ``StandUp``, and does not walk.
        is_leaning: whether it holds an attitude, after ``Euler`` or ``Pose``.
        unsupported: procedures for which the library has no motion, or for which there is no gait.
        pilot: runs the procedures.
        pose: of the trunk while it walks; ``Euler`` and ``BodyHeight`` change it.
    """

    def __init__(self, plant: Plant, config: Config) -> None:
        self._config = config = config.beside_hardware
        # With a model of its own: the loop is another thread.
        self._checker = FeasibilityChecker(RobotModel(motor=config.motor), config.feasibility)
        plans = playable_plans(self._checker.model)
        walks = {api: name for api, name in WALKS.items() if name in GAITS}
        self.unsupported = (MOTIONS.keys() | WALKS.keys()) - plans.keys() - walks.keys()
        self._gait = "trot"
        self.pilot = build_pilot(plant, config, realtime=True, recorded_time=0.0)
        self._runner = self.pilot.runner
        self.is_locked = False
        self.is_leaning = False
        self.pose = LEVEL
        self._actions: Mapping[int, Callable[[], object]] = {
            Api.BALANCE_STAND: self.pilot.stand,
            Api.STAND_UP: self.pilot.stand,
            Api.RECOVERY_STAND: self.pilot.recover,
            Api.RISE_SIT: self.pilot.stand,
            Api.STAND_DOWN: self.pilot.lie_down,
            Api.SIT: self.pilot.sit,
            Api.MOVE: lambda: self._walk(self._gait),
            **{api: partial(self._walk, gait) for api, gait in walks.items()},
            **{api: partial(self.pilot.play, plan) for api, plan in plans.items()},
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

    def _walk(self, gait: str) -> object:
        """Enter walking mode; ``Move`` walks like this from now on."""
        self._gait = gait
        walked = self.pilot.walk(gait)
        self.pilot.set_command(self.pilot.command, self.pose)
        return walked

    def begin(self) -> None:
        """Begin an action: what makes the robot limp ends it; PlantError without a control loop."""
        self.pilot.begin()

    def perform(self, api: int) -> None:
        """Do an action that has begun; ``Aborted`` says why it was not done."""
        if api not in WALKING:
            self.pose = BodyPose(self.pose.height)
        if api not in STANDING_UP:
            if self.is_leaning:
                self.pilot.stand()
            self.is_locked = self.is_leaning = False
        self._actions[api]()
        self.is_locked, self.is_leaning = api == Api.STAND_UP, False

    def lean_to(self, rpy: tuple[float, float, float]) -> None:
        """Turn the trunk to roll, pitch, yaw [rad] over the feet and hold it, or ``Aborted``."""
        self._runner.stop_stepping()
        if self.mode is Mode.WALKING:
            self.pilot.square_up()
        target = np.array(rpy)
        self.is_leaning = True
        behaviour = ChangePosture(lambda pose: lean(pose, target, LEAN_TIME))
        self._runner.run(behaviour, LEAN_LIMIT)

        def asked(snapshot: Snapshot) -> Limited:
            missing = np.abs(snapshot.state.rpy[:2] - target[:2])
            return {"attitude error [rad]": (float(missing.max()), ATTITUDE_TOLERANCE)}

        self._runner.settle("lean", asked)

    def can_hold(self, pose: BodyPose) -> bool:
        """Whether it can hold ``pose`` while it walks."""
        try:
            self._config.pose.require(pose)
        except CommandError as error:
            _log.warning("not while walking: %s", error)
            return False
        return True

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

    def excess(self, command: VelocityCommand) -> tuple[int, str]:
        """Whether ``command`` is far (2) beyond the walking envelope or not (0), and in words."""
        envelope = self._config.cautious_envelope
        return 2 * envelope.is_far(command), envelope.excess(command)

    def steer(self, command: VelocityCommand, share: float) -> None:
        """Follow ``command``, within ``share`` of the walking envelope, in the pose that was asked.

        Only in walking mode.
        """
        x, y, turn = command.linear_x, command.linear_y, command.angular_z
        inside = self._config.cautious_envelope.clip(
            VelocityCommand(x / share, y / share, turn / share)
        )
        x, y, turn = inside.linear_x, inside.linear_y, inside.angular_z
        followed = VelocityCommand(share * x, share * y, share * turn)
        self.pilot.set_command(followed, self.pose)

    def damp(self) -> None:
        """Go limp at once; ends the action that runs."""
        self.pose = LEVEL
        self.is_locked = self.is_leaning = False
        self.pilot.collapse("limp, as asked by Damp")

    def cancel(self) -> None:
        """Leave the motion that plays, safely, and stand."""
        self.pilot.return_safely()

    def close(self) -> None:
        """Go limp and stop."""
        self.pilot.close()


def playable_plans(model: RobotModel) -> Mapping[int, MotionPlan]:
    """The plans of the calls for which the library has a motion that can be compiled here."""
    plans = {}
    for api, name in MOTIONS.items():
        if name not in motion_names():
            continue
        try:
            plans[api] = compile_motion(name, model)
        except Go2WbcError as error:
            _log.warning("%s will not be supported: %s", Api(api).name, error)
    return plans


@final
class SportPath:
    """``TrajectoryFollow``: points in time, walked by velocity commands closed on the odometry.

    As in Unitree's own example (unitree_ros2, ``example/src/src/sport_mode_ctrl.cpp``) places and
    velocities are given in the frame of ``rt/sportmodestate``, and whoever wants to go on sends a
    new path before the old one ends. Its time begins when the robot is ready to walk.
    """

    def __init__(self, points: Float[np.ndarray, "n 7"]) -> None:
        """``points``: time [s], x, y [m], yaw [rad], vx, vy [m/s], vyaw [rad/s] of each."""
        self._times, self._places, self._rates = points[:, 0], points[:, 1:4].copy(), points[:, 4:]
        self._places[:, 2] = np.unwrap(self._places[:, 2])
        self._start: float | None = None

    def command(self, state: RobotState) -> VelocityCommand | None:
        """The velocity, in the robot's frame, that leads along the path; None at its end."""
        if self._start is None:
            self._start = state.time
        t, end = state.time - self._start, float(self._times[-1])
        x, y, yaw = (float(np.interp(t, self._times, column)) for column in self._places.T)
        vx, vy, vyaw = (float(np.interp(t, self._times, column)) for column in self._rates.T)
        if not self._times[0] <= t < end:
            vx = vy = vyaw = 0.0  # it rests where the path begins and ends
        dx, dy = x - float(state.q[0]), y - float(state.q[1])
        turn = wrap_angle(yaw - state.yaw)
        is_there = math.hypot(dx, dy) < NEAR_PLACE and abs(turn) < NEAR_ANGLE
        if t >= end and (is_there or t > end + ARRIVAL_TIME):
            return None
        vx, vy = vx + APPROACH * dx, vy + APPROACH * dy
        c, s = math.cos(state.yaw), math.sin(state.yaw)
        return VelocityCommand(c * vx + s * vy, -s * vx + c * vy, vyaw + APPROACH * turn)
