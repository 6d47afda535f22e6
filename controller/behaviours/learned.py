"""A learned policy walks; it and the whole-body controller hand the robot over to each other.

While the policy walks, the gait planner runs along: its references start from the measured state,
and its clock is synchronised with each touchdown. So the whole-body controller can take over in any
tick. During a hand-over the torques of both are blended:

    tau = (1 - s) tau_wbc + s (kp (q_des - q) - kd v + f v)     s: the share of the policy

where f is the viscous joint friction that is fed forward: 0, except for a robot whose own file has
much of it, which no policy has seen in training.

The policy controls the robot while there is a velocity command; without one the whole-body
controller brings it to rest, and stands.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from controller.behaviours import Shared
from controller.policies.policy import Player, Policy
from go2_wbc.errors import PolicyError
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.locomotion import LocomotionPlanner
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState, Snapshot

_log = logging.getLogger(__name__)

HAND_OVER = 0.1  #: Time [s] in which one hands over to the other
SWING = 0.06  #: Time [s] that a foot must have been in the air to have come down
FOLLOWED = 0.3  #: Share by which the clock goes towards a foot that comes down


class Learned:
    """A policy that walks a robot, while it is wanted.

    Attributes:
        policy: what walks.
        is_wanted: whether it shall have the robot when there is a command.
        share: of the policy in what the motors are told, 0 to 1.
        refusal: why it may not go on, in plain words; "" if it may.
    """

    def __init__(self, policy: Policy, model: RobotModel, viscous: Sequence[float]) -> None:
        """Let ``policy`` drive ``model``, from the next command on.

        Args:
            policy: what walks.
            model: of the robot.
            viscous: friction of each joint [N m s/rad] that is fed forward.
        """
        self.policy, self.is_wanted, self.share, self.refusal = policy, True, 0.0, ""
        self._player = Player(policy, model.q_lower, model.q_upper)
        self._time, self._viscous = np.nan, np.array(viscous)
        self._in_air_since = np.full(4, np.inf)

    @property
    def is_over(self) -> bool:
        """Whether it has handed over for good."""
        return self.share == 0.0 and not (self.is_wanted and not self.refusal)

    def update(
        self,
        now: Snapshot,
        reference: Reference,
        command: VelocityCommand,
        planner: LocomotionPlanner,
    ) -> Reference | Shared:
        """What to track now, with what the shadow would track, and its planner."""
        state = now.state
        step = (state.time - self._time) / HAND_OVER if self._time < state.time else 0.0
        self._time = state.time
        landed = self._landed(state)
        wants = self.is_wanted and not self.refusal and not command.is_zero
        if wants and self.share == 0.0:
            self._player.restart(planner.phase)
        self.share = min(self.share + step, 1.0) if wants else max(self.share - step, 0.0)
        if self.share == 0.0:
            return reference
        planner.follow_feet(landed, FOLLOWED)
        try:
            asked = self._player.command(state, command)
            asked = replace(asked, tau=self._viscous * state.joint_velocities)
            return Shared(reference, asked, self.share)
        except PolicyError as error:
            self.refusal, self.share = f"{error} at t={state.time:.2f} s", 0.0
            _log.warning("%s: the whole-body controller takes over", self.refusal)
            return reference

    def _landed(self, state: RobotState) -> Bool[np.ndarray, "4"]:
        contact, since = state.feet_in_contact, self._in_air_since
        landed = contact & (state.time - since > SWING)
        self._in_air_since = np.where(contact, np.inf, np.minimum(since, state.time))
        return landed
