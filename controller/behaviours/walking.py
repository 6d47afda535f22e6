"""Walking: the locomotion planner under a velocity command that may change at any time."""

from __future__ import annotations

import logging
import math

import numpy as np

from controller.behaviours import Behaviour, Shared
from controller.behaviours.learned import Learned
from go2_wbc.contacts import Gait
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand, VelocityEnvelope
from go2_wbc.planning.envelopes import DWELL, GaitChoice
from go2_wbc.planning.gait_clock import time_between
from go2_wbc.planning.ground import is_rough
from go2_wbc.planning.height_map import HeightMap
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.trunk import LEVEL, SETTLED_COMMAND, BodyPose
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot

_log = logging.getLogger(__name__)

STEADYING = 0.15
"""Speed [m/s] up to which a command only keeps the robot in its place, as while it turns."""


class Walking(Behaviour):
    """Walk with ``gait`` and follow ``command`` and ``pose``; stand ready without command.

    With a ``choice`` the gait is chosen by the speed. What is ``learned``, if anything, walks in
    its stead while there is a command, until it has to be refused.
    """

    label = "walk"
    knows_payload = True

    def __init__(
        self,
        model: RobotModel,
        gait: Gait,
        config: LocomotionConfig,
        friction: float | None = None,
        has_slid: bool = True,
        heights: HeightMap | None = None,
    ) -> None:
        """Walk with ``gait``, on ground of which that is known; see ``LocomotionPlanner``."""
        self.gait = gait
        self._known_friction, self._had_slid = friction, friction is not None and has_slid
        self.command: VelocityCommand = ZERO_COMMAND
        self.pose: BodyPose = LEVEL
        self.choice: GaitChoice | None = None
        self.learned: Learned | None = None
        self.refusal = ""
        self._limit, self._is_limited_until = VelocityEnvelope(), -np.inf
        self._planner = LocomotionPlanner(model, gait, config, heights)
        self._most = config.rough.speed
        self._has_told, self._told_block = False, ""

    def start(self, snapshot: Snapshot) -> None:
        """Start from the measured state, standing."""
        self._planner.start(snapshot, self._known_friction, self._had_slid)

    def update(self, snapshot: Snapshot) -> Reference | Shared:
        """The planner's reference, and what a policy makes of the command."""
        reference, learned = self.planned(snapshot), self.learned
        if learned is None:
            return reference
        command = self.asked(snapshot.state.time)
        target = learned.update(snapshot, reference, command, self._planner)
        self.label = "policy" if learned.share else Walking.label
        if learned.refusal:
            self.refusal, self.command = learned.refusal, ZERO_COMMAND
        if learned.is_over:
            self.learned = None
        return target

    def planned(self, snapshot: Snapshot) -> Reference:
        """The planner's reference."""
        now = snapshot.state.time
        command = self.asked(now)
        if self.choice is not None:
            velocity = self._planner.velocity
            gait, command = self.choice.update(now, velocity, command)
            if gait != self.gait:
                self.change_gait(gait)
        reference = self._planner.update(snapshot, command, self.pose, self.delay)
        is_own = self.learned is None or not self.learned.share
        if is_own and not self._has_told and self._planner.is_slowed:
            self._has_told = True
            if self._planner.is_late:
                _log.warning("commands act %.0f ms late: it walks slower", 1000.0 * self.delay)
            else:
                _log.warning("rough ground: %g m/s at most until it is smooth again", self._most)
        blocked = self.blocked
        if blocked and not self._told_block:
            _log.warning("stopped: %s", blocked)
        self._told_block = blocked
        return reference

    def square_up(self, snapshot: Snapshot) -> bool:
        """Step in place unless the feet are below the hips; returns whether they are."""
        return self._planner.square_up(snapshot)

    def change_gait(self, gait: Gait) -> None:
        """Walk on with another gait, within whose envelope the robot must walk already."""
        self._planner.change_gait(gait)
        self.gait = gait

    def pass_over(self, gait: Gait, limit: VelocityEnvelope, now: float) -> None:
        """Change the gait, the velocity clipped into ``limit`` until that has happened.

        A change within another one takes as long as what is left of that takes, and both together.

        Args:
            gait: wanted.
            limit: in which the robot walks already.
            now: time of the robot [s].
        """
        until = max(self._is_limited_until, now)
        self._limit = limit if until == now else limit.within(self._limit)
        self._is_limited_until = until + max(time_between(self.gait, gait), DWELL)
        self.change_gait(gait)

    def asked(self, now: float) -> VelocityCommand:
        """The command, within what a change of gait permits at ``now`` [s]."""
        return self._limit.clip(self.command) if now < self._is_limited_until else self.command

    @property
    def is_on_rough_ground(self) -> bool:
        """Whether feet have found the ground rough, lately."""
        return bool(is_rough(self._planner.ground))

    @property
    def friction(self) -> float | None:
        """Of the ground, as far as it is known; None if nothing is."""
        return self._planner.friction or self._known_friction

    @property
    def has_slid(self) -> bool:
        """Whether a foot has, and has shown that friction."""
        return self._planner.has_slid if self._planner.friction else self._had_slid

    @property
    def follows_command(self) -> bool:
        """Whether the planner has ramped the command, as far as the ground lets it.

        The robot itself may yet catch up.
        """
        if self._planner.is_slowed or self._planner.sight.is_slowed:
            return True
        command = self.command.linear_x, self.command.linear_y, self.command.angular_z
        return bool(np.allclose(self._planner.velocity, command, atol=SETTLED_COMMAND))

    @property
    def blocked(self) -> str:
        """What stops the robot that is commanded to go on, in plain words; "" if nothing does."""
        sight, command = self._planner.sight, self.command
        is_asked = sight.is_slowed and math.hypot(command.linear_x, command.linear_y) > STEADYING
        return sight.why_blocked if is_asked else ""

    def is_finished(self, snapshot: Snapshot) -> bool:
        """Whether the robot has come to rest."""
        return self.command.is_zero and not self._planner.is_stepping

    def why_not_finished(self, snapshot: Snapshot) -> str:
        """What has yet to happen until the robot rests, in plain words."""
        if not self.command.is_zero:
            return "it is commanded"
        return self._planner.why_not_resting(snapshot)
