"""Walking by command: the gait, how fast it may be walked, and what is followed."""

from __future__ import annotations

from controller.behaviours.walking import Walking
from controller.procedures import ProcedureRunner
from controller.runner import Runner
from go2_wbc.config import Config
from go2_wbc.contacts import Gait, find_gait
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand, VelocityEnvelope
from go2_wbc.planning.pose import LEVEL, BodyPose

STOP_LIMIT = 4.0
"""Time [s] in which a walking robot must come to rest after ``stop``."""


class Walker:
    """Lets a robot walk, in one gait after the other.

    Attributes:
        walking: the behaviour that walks, or will.
    """

    def __init__(self, runner: Runner, config: Config) -> None:
        """Walk on ``runner``, at first with the trot."""
        self._runner, self._config = runner, config
        self._procedures = ProcedureRunner(runner)
        self.walking = self._make(find_gait("trot"))
        self._envelope: VelocityEnvelope = config.envelope

    def _make(self, gait: Gait) -> Walking:
        return Walking(self._runner.loop.model, gait, self._config.locomotion)

    @property
    def command(self) -> VelocityCommand:
        """The velocity that is followed."""
        return self.walking.command

    def start(self, gait: Gait) -> None:
        """Stand ready to walk with ``gait``."""
        walking = self._make(gait)
        self._procedures.engage(walking)
        self.walking = walking
        self._envelope = self._config.envelope.scaled(gait.envelope_share)

    def change_gait(self, gait: Gait) -> None:
        """Walk on with ``gait``, slowing down into its envelope before."""
        walking, self._envelope = self.walking, self._config.envelope.scaled(gait.envelope_share)
        walking.command = self._envelope.clip(walking.command)
        self._procedures.until(lambda: walking.follows_command, STOP_LIMIT, "slow down")
        with self._runner.lock():  # the planner may be at work in another thread
            walking.change_gait(gait)

    def follow(self, command: VelocityCommand, pose: BodyPose | None = None) -> VelocityCommand:
        """Follow ``command``, clipped to the envelope of the gait; returns what is followed.

        Args:
            command: wanted.
            pose: wanted of the trunk; None keeps the one that is followed.

        Raises:
            CommandError: if the pose is beyond its envelope; nothing is followed then.
        """
        if pose is not None:
            self._config.pose.require(pose)
            self.walking.pose = pose
        self.walking.command = self._envelope.clip(command)
        return self.walking.command

    def halt(self) -> None:
        """Zero the command and level the trunk, from any thread."""
        self.walking.command, self.walking.pose = ZERO_COMMAND, LEVEL

    def finish(self, what: str) -> None:
        """Let the steps come to an end."""
        walking, loop = self.walking, self._runner.loop
        self._procedures.until(lambda: walking.is_finished(loop.snapshot), STOP_LIMIT, what)

    def square_up(self) -> bool:
        """Start to put the feet below the hips; returns whether they are."""
        self.start(find_gait("trot"))
        with self._runner.lock():  # the planner may be at work in another thread
            return self.walking.square_up(self._runner.loop.snapshot)
