"""Walking by command: the gait, how fast it may be walked, and what is followed."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from controller.behaviours.learned import HAND_OVER, Learned
from controller.behaviours.walking import Walking
from controller.modes import Limited, calm
from controller.policies.policy import Policy
from controller.policies.sidecar import CommandRanges
from controller.runner import REST_TIME, Runner
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS, Gait, find_gait
from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand, VelocityEnvelope
from go2_wbc.planning.envelopes import AUTO, LADDER, GaitChoice, envelope_of
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.robot.state import Snapshot

STOP_LIMIT = 4.0  #: Time [s] in which a walking robot must come to rest after ``stop``
CHANGE_SHARE = 0.65
"""Share of both envelopes in which one gait passes over into another: at their edge it fell."""


class Walker:
    """Lets a robot walk, in one gait after the other."""

    def __init__(self, runner: Runner, config: Config) -> None:
        """Walk on ``runner``, at first with the trot."""
        self._runner, self._config = runner, config
        self.walking = Walking(runner.loop.model, find_gait("trot"), config.locomotion)
        """The behaviour that walks, or will."""
        self._envelope: VelocityEnvelope | CommandRanges = self._envelope_of(self.walking)

    def excess(self, command: VelocityCommand) -> tuple[int, str, Hashable]:
        """How far ``command`` is beyond the gait's envelope (0 if not, 2 by far), and in words.

        And of what it is told: of this gait, or policy, in this direction.
        """
        if not (excess := self._envelope.excess(command)):
            return 0, "", None
        name = self.walking.gait.name if self.walking.choice is None else AUTO
        whose = f"gait {name!r}" if self._policy is None else f"policy {self._policy.name}"
        told = f"{excess}; the envelope of {whose} is {self._envelope}"
        way = tuple(np.sign((command.linear_x, command.linear_y, command.angular_z)).tolist())
        return 1 + self._envelope.is_far(command), told, (whose, way)

    @property
    def _policy(self) -> Policy | None:
        learned = self.walking.learned
        return learned.policy if learned is not None and learned.is_wanted else None

    def require(self, gait: str | Gait) -> None:
        """Raise CommandError for a gait that there is not."""
        if gait != AUTO and not isinstance(gait, Gait) and gait not in GAITS:
            raise CommandError(unknown_name("gait", gait, [*GAITS, AUTO]))

    def start(self, gait: str | Gait) -> None:
        """Stand ready to walk with ``gait``."""
        choice = self._choice(gait)
        gait = find_gait(LADDER[0] if gait == AUTO else gait)
        loop, before = self._runner.loop, self.walking
        known = before.friction, before.has_slid, loop.heights
        walking = Walking(loop.model, gait, self._config.locomotion, *known)
        walking.choice = choice
        self._runner.engage(walking)
        self.walking = walking
        self._envelope = self._envelope_of(walking)

    def hand_over(self, policy: Policy | None) -> None:
        """Let ``policy`` walk when there is a command; the whole-body controller if None."""
        walking = self.walking
        if (learned := walking.learned) is not None:
            learned.is_wanted = False
            self._runner.until(lambda: walking.learned is None, 10.0 * HAND_OVER, "hand over")
        walking.refusal = ""
        if policy is None:
            self._envelope = self._envelope_of(walking)
        else:
            self._envelope = policy.sidecar.commands
        walking.command = self._envelope.clip(walking.command)
        if policy is not None:
            loop = self._runner.loop
            viscous = loop.wbc.config.joint_friction.viscous
            walking.learned = Learned(policy, loop.model, viscous)

    @property
    def refusal(self) -> str:
        """Why a policy had to be refused since this was asked last; "" if none had."""
        refusal, self.walking.refusal = self.walking.refusal, ""
        return refusal

    def take(self, gait: str | Gait) -> None:
        """Walk on with ``gait``, slowing down into its envelope before."""
        walking, choice = self.walking, self._choice(gait)
        if choice is not None:
            walking.choice = walking.choice or choice
            self._envelope = self._envelope_of(walking)
        elif walking.choice is not None or find_gait(gait) != walking.gait:
            self._change(find_gait(gait))

    def _change(self, gait: Gait) -> None:
        """Slow down into the middle of both envelopes, pass over, and go on as before.

        Whatever is asked for meanwhile, the robot stays there until it has passed over: of 250 runs
        of ten changes, each with a new command at once, 3 fell as the command was followed at once.
        """
        walking = self.walking
        before, after = (
            envelope_of(g, self._config.cautious_envelope) for g in (walking.gait, gait)
        )
        middle = before.within(after).scaled(CHANGE_SHARE)
        self._envelope = self._widest(gait)
        asked = self._envelope.clip(walking.command)
        walking.command = slowed = middle.clip(asked)
        self._runner.until(lambda: walking.follows_command, STOP_LIMIT, "slow down")

        def pass_over() -> None:
            walking.choice = None
            walking.pass_over(gait, middle, self._runner.loop.state.time)

        self._runner.between_ticks(pass_over)
        if walking.command is slowed:  # nobody has asked for another one
            walking.command = asked

    def _choice(self, gait: str | Gait) -> GaitChoice | None:
        return GaitChoice(self._config.envelope) if gait == AUTO else None

    def _envelope_of(self, walking: Walking) -> VelocityEnvelope:
        return walking.choice.envelope if walking.choice else self._widest(walking.gait)

    def _widest(self, gait: Gait) -> VelocityEnvelope:
        return envelope_of(gait, self._config.envelope, self._runner.loop.model.profile)

    def follow(self, command: VelocityCommand, pose: BodyPose | None = None) -> VelocityCommand:
        """Follow ``command``, clipped to the envelope of the gait; returns what is followed.

        Args:
            command: wanted.
            pose: wanted of the trunk; None keeps the one that is followed.

        Raises:
            CommandError: if the pose is beyond its envelope, or a policy walks, which takes none;
                nothing is followed then.
        """
        if pose is not None:
            self._config.pose.require(pose)
            if pose != LEVEL and self._policy is not None:
                raise CommandError(f"policy {self._policy.name} takes no pose of the trunk")
            self.walking.pose = pose
        self.walking.command = self._envelope.clip(command)
        return self.walking.command

    def halt(self) -> None:
        """Zero the command and level the trunk, from any thread."""
        self.walking.command, self.walking.pose = ZERO_COMMAND, LEVEL

    def finish(self, what: str) -> None:
        """Let the steps come to an end."""
        walking, loop = self.walking, self._runner.loop
        self._runner.until(
            lambda: walking.is_finished(loop.snapshot),
            STOP_LIMIT,
            what,
            lambda: walking.why_not_finished(loop.snapshot),
        )

    def calm_down(self, what: str) -> None:
        """Let the steps come to an end, and what is left of the trunk's motion."""
        self.finish(what)
        walking = self.walking

        def asked(now: Snapshot) -> Limited:
            return {"steps to be ended": (float(not walking.is_finished(now)), 1.0), **calm(now)}

        self._runner.settle(what, asked, REST_TIME)

    def square_up(self) -> bool:
        """Start to put the feet below the hips; returns whether they are."""
        self.start("trot")
        walking, loop = self.walking, self._runner.loop
        return self._runner.between_ticks(lambda: walking.square_up(loop.snapshot))
