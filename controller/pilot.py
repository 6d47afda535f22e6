"""The pilot: turns what a user asks for into a sequence of behaviours, and measures the result.

Every public method is a procedure that returns what it measured, or raises ``Aborted`` with the
reason in plain words. It knows nothing of users, locks or outcomes: ``GO2Controller`` turns
procedures into calls.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from functools import partial
from math import inf

from controller import modes
from controller.acceptance import Acceptance
from controller.behaviours.plans import ChangePosture, PlayPlan
from controller.behaviours.standing import Standing
from controller.modes import Aborted, Asked, Measurements, Mode
from controller.navigation import Goal
from controller.pacing import LogOnce
from controller.policies.policy import Policy
from controller.recovery import get_onto_belly, lie_limp, tuck
from controller.runner import Runner
from controller.telemetry import SeenTerrain
from controller.walker import Walker
from go2_wbc.config import Config
from go2_wbc.contacts import Gait
from go2_wbc.errors import DynamicMotionRefused, ModeError, StanceMismatch
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.trunk import LEVEL, BodyPose
from motions.postures import lie_down, rise, sit_down, sit_raise

READY_TIME = 0.2  #: Time [s] that a robot is given to stand ready in walking mode
HOLD_TIME = 0.4  #: Time [s] in which a robot that stands takes the exact posture
LOOK_TIME = 0.03
"""Time [s] for which a limp robot's feet are looked at: one that stands sinks by 3 mm."""
UNMOVED = (
    "stop() comes before any time has passed since move(): the robot has not moved. Time passes in "
    "wait(2.0), not in time.sleep(2); with GO2Controller(realtime=True) in both"
)
STEP_AHEAD, STEP_TIME = VelocityCommand(0.2), 0.6
"""How, and for how long [s], a robot goes on whose calf lies on an edge."""
_log = logging.getLogger(__name__)


class Pilot:
    """Runs procedures on one loop.

    Attributes:
        mode, playing: what the robot is doing; the behaviour that plays a motion, or None.
        runner: lets time pass; ``runner.loop`` has the newest state and the telemetry.
        close: go limp and stop; the plant stays open. Idempotent.
        collapse: goes limp at once, for a reason; ends the procedure that runs, from any thread.
        excess: how far a command is beyond what is followed (0 if not, 2 by far), and in words.
    """

    def __init__(self, runner: Runner, config: Config) -> None:
        """Take over a robot that lies on the ground, or stands and will sink."""
        self.runner = self._runner = runner
        self.close: Callable[[], None] = runner.close
        self._loop, self._config = runner.loop, config
        self._walker = Walker(runner, config)
        self.excess, self.collapse = self._walker.excess, runner.interrupt
        self._goal: Goal | None = None
        self._asked_at, self._unmoved = -inf, LogOnce(_log)
        self._commands = threading.Lock()  # held to take one, and to begin what takes none
        self.playing: PlayPlan | None = None
        self._cancelled = self._known_cancelled = 0  # how often, and before what runs
        self._mode = Mode.LYING if self._is_on_the_ground else Mode.DAMPED

    @property
    def mode(self) -> Mode:
        """What the robot is doing, faults of the loop included."""
        fault = self._loop.fault
        if fault is not None:
            return Mode.FALLEN if fault.is_fall else Mode.DAMPED
        is_stepping = self._mode is Mode.STANDING and self._runner.is_stepping
        return Mode.MOVING if is_stepping else self._mode

    @property
    def command(self) -> VelocityCommand:
        """The velocity command that is being followed."""
        return self._walker.walking.command if self.mode is Mode.WALKING else ZERO_COMMAND

    @property
    def terrain(self) -> SeenTerrain | None:
        """The ground as it has been seen; None if nothing has."""
        heights = self._loop.heights
        return SeenTerrain(heights, self._walker.walking.blocked) if heights.is_used else None

    @property
    def body_pose(self) -> BodyPose:
        """The pose of the trunk that is being followed while the robot walks."""
        return self._walker.walking.pose if self.mode is Mode.WALKING else LEVEL

    def asked(self) -> Asked:
        """How things are as a procedure is asked for: what comes up from now on ends it."""
        return Asked(self._loop.fault, self._cancelled)

    def begin(self, asked: Asked | None = None) -> None:
        """Begin a procedure: the mode is from now on what the last fault, if any, has made it.

        Args:
            asked: how things were when it was asked for; None for as they are.

        Raises:
            Aborted: if a fault has come up since then.
        """
        if self._loop.fault is not None:
            self._mode = self.mode
        self._known_cancelled = self._cancelled if asked is None else asked.cancelled
        self._runner.begin(asked)

    @property
    def _must_return(self) -> bool:
        """Whether what runs has been cancelled."""
        return self._cancelled > self._known_cancelled

    # --- postures -------------------------------------------------------------------------

    def stand(self) -> Measurements:
        """Stand, from any mode but fallen."""
        self._runner.stop_stepping()
        mode = self.mode
        if mode is Mode.WALKING:
            self._finish_walking("come to rest")
        if mode in (Mode.LYING, Mode.DAMPED) or self._is_on_the_ground:
            self._mode = Mode.MOVING
            tuck(self._runner)
        entry = {Mode.SITTING: Posture.SIT, Mode.LYING: Posture.LIE}.get(mode, Posture.STAND)
        is_up = mode in (Mode.STANDING, Mode.WALKING)
        return self._rise(entry, HOLD_TIME if is_up else 1.2, has_walked=mode is Mode.WALKING)

    def take_over(self) -> Measurements:
        """Stand on the feet where they are; a robot that does not stand stays limp."""
        if self.mode.is_upright:
            return self.stand()
        loop = self._loop
        self._runner.advance_until(lambda: bool(loop.state.feet_in_contact.all()), LOOK_TIME)
        if why_not := self._runner.between_ticks(lambda: modes.why_not_standing(loop.snapshot)):
            raise Aborted(f"the robot does not stand: {why_not}", self._runner.measurements())
        return self._rise(Posture.STAND, 1.2)

    def _rise(self, entry: Posture, duration: float, *, has_walked: bool = False) -> Measurements:
        self._take_posture(self._make_standing(entry, duration))
        is_rough = has_walked and self._walker.walking.is_on_rough_ground
        for _ in range(2 if is_rough else 1):
            if self._runner.settles(modes.is_standing):
                return self._arrive(Posture.STAND)
            # It stands on other ground than it believed in: feet slid, left a box, or hang.
            self._runner.stop_stepping()
            hanging = 4 - int(self._loop.state.feet_in_contact.sum())
            if is_rough and 1 <= hanging <= 2 and self._loop.health.is_sound:
                self._step_ahead()
            self._take_posture(self._make_standing(Posture.STAND, HOLD_TIME))
        return self._settle(Posture.STAND, "stand")

    def _step_ahead(self) -> None:
        """A calf lies on an edge behind its foot, which hangs: go on until it has come off."""
        _log.warning("stand: a foot hangs on rough ground, it goes on for a step")
        self._walker.start("trot")
        self._walker.follow(STEP_AHEAD)
        self._runner.let_pass(STEP_TIME)
        self._finish_walking("stand")

    def sit(self) -> Measurements:
        """Sit like a dog, from any mode but fallen."""
        if self.mode is not Mode.SITTING:
            self._ensure_standing()
            model = self._loop.model
            raised = sit_raise(self._loop.snapshot.p_world_feet, model)
            sit = partial(sit_down, profile=model.profile, raised=raised)
            self._take_posture(ChangePosture(sit))
        return self._settle(Posture.SIT, "sit")

    def lie_down(self) -> Measurements:
        """Lie down and go limp."""
        self._runner.stop_stepping()
        if self.mode not in (Mode.LYING, Mode.DAMPED) and not self._is_on_the_ground:
            if self.mode is not Mode.MOVING:  # a stand that failed need not succeed to lie down
                self._ensure_standing()
            self._take_posture(ChangePosture(partial(lie_down, profile=self._loop.model.profile)))
        lie_limp(self._runner)
        return self._settle(Posture.LIE, "lie down")

    def recover(self) -> Measurements:
        """Get up after a fall onto the belly, a side or the back."""
        if self.mode.is_upright:
            return self.stand()
        self._mode = Mode.DAMPED
        get_onto_belly(self._runner)
        self._mode = Mode.LYING
        return self.stand()

    def _take_posture(self, change: ChangePosture) -> None:
        self._mode = Mode.MOVING
        self._runner.run(change, 5.0)

    def _make_standing(self, entry: Posture, duration: float) -> Standing:
        own = self._loop.model.profile
        make_plan = partial(rise, entry=entry, duration=duration, profile=own)
        walking = self._walker.walking
        friction = walking.friction if walking.has_slid else None
        return Standing(make_plan, self._loop.model, self._config.locomotion, friction)

    def _settle(self, posture: Posture, what: str) -> Measurements:
        _, asked = _RESTING[posture]
        self._runner.settle(what, asked)
        return self._arrive(posture)

    def _arrive(self, posture: Posture) -> Measurements:
        self._mode, _ = _RESTING[posture]
        return self._runner.measurements()

    def _ensure_standing(self) -> None:
        if self.mode is not Mode.STANDING:
            self.stand()

    # --- walking --------------------------------------------------------------------------

    def walk(self, gait: str | Gait, policy: Policy | None = None) -> Measurements:
        """Enter walking mode, ready for commands; one that walks goes on, with this gait.

        With a ``policy`` that walks when there is a command, and the gait without one.
        """
        self._walker.require(gait)
        if self.mode is not Mode.WALKING:
            self._ensure_standing()
            self._walker.start(gait)
        else:
            self._walker.take(gait)
        self._walker.hand_over(policy)
        self.wait(READY_TIME)
        self._mode = Mode.WALKING
        return self._runner.measurements()

    def set_command(
        self, command: VelocityCommand, pose: BodyPose | None = None
    ) -> VelocityCommand:
        """Follow ``command``, clipped to the envelope; returns what is followed.

        Args:
            command: wanted.
            pose: wanted of the trunk; None keeps the one that is followed.

        Raises:
            CommandError: if the pose is beyond its envelope.
            ModeError: outside walking mode, or during a goal.
        """
        with self._commands:
            goal, mode = self._goal, self.mode
            if goal is not None:
                raise ModeError(f"move() during a goal ({goal.name}): end it by stop()")
            if mode is not Mode.WALKING:
                raise ModeError(f"move() needs walking mode, not {mode.value}: call walk() first")
            if command != ZERO_COMMAND and self.command == ZERO_COMMAND:
                self._asked_at = self._loop.state.time
            return self._walker.follow(command, pose)

    def rest(self) -> Measurements:
        """Zero the command, level the trunk and let the walking robot come to rest."""
        if self.mode is Mode.WALKING:
            self._walker.halt()
            self._walker.calm_down("come to rest")
        return self._runner.measurements()

    def _finish_walking(self, what: str) -> None:
        """Come to rest in order to do something else: no command is taken any more."""
        with self._commands:
            self._mode = Mode.MOVING
            self._walker.halt()
        try:
            self._walker.finish(what)
        except Aborted:
            self._mode = Mode.WALKING  # it still does, unless there is a fault
            raise

    def run_goal(self, goal: Goal) -> Measurements:
        """Walk a goal to its measured end and come to rest."""
        loop = self._loop
        with self._commands:
            self._goal = goal
        try:
            if self.mode is not Mode.WALKING:
                self.walk("trot")
            self.rest()

            def is_over() -> bool:
                if self._goal is None:
                    return True
                self._walker.follow(goal.command(loop.state))
                walking = self._walker.walking
                return goal.is_done(loop.state) or bool(walking.blocked or walking.refusal)

            goal.begin(loop.state)

            def got() -> str:
                return modes.listed(goal.measurements(loop.state))

            self._runner.until(is_over, goal.time_limit, goal.name, got)
            blocked = self._walker.walking.blocked or self._walker.refusal
            self.rest()
            was_halted = self._goal is None
        finally:
            self.halt()
        measured = goal.measurements(loop.state)
        if was_halted:
            raise Aborted(f"{goal.name} ended by stop()", measured)
        if blocked:
            raise Aborted(f"{goal.name} ended: {blocked}; {modes.listed(measured)}", measured)
        if why := modes.told(goal.errors(loop.state)):
            raise Aborted(f"{goal.name} missed: {why}; {modes.listed(measured)}", measured)
        return measured

    def halt(self) -> bool:
        """Zero the command, from any thread; returns whether that ends a goal.

        The goal's own call then brings the robot to rest.
        """
        had_goal, self._goal = self._goal is not None, None
        if self.mode is Mode.WALKING:
            if self._asked_at == self._loop.state.time and not self._runner.is_realtime:
                self._unmoved.warn(1, UNMOVED)
            self._walker.halt()
        return had_goal

    # --- motions --------------------------------------------------------------------------

    def play(
        self, plan: MotionPlan, *, allow_dynamic: bool = False, stands_up: bool = False
    ) -> Measurements:
        """Play ``plan``, and measure whether it was done.

        Args:
            plan: the motion.
            allow_dynamic: let also a plant that may be a robot play a dynamic plan.
            stands_up: stand before, from any mode but fallen.

        Raises:
            DynamicMotionRefused: if the plan is dynamic, the plant may be a robot, and the caller
                does not allow it.
            StanceMismatch: if the plan starts from another stance.
        """
        plant = self._loop.plant
        if stands_up:
            self._ensure_standing()
        if plan.is_dynamic and plant.is_hardware and not allow_dynamic:
            raise DynamicMotionRefused(
                f"motion {plan.name!r} is dynamic: fewer than three feet carry the robot in parts "
                f"of it, so it cannot be stopped there, and {type(plant).__name__} may move a "
                "robot. No dynamic motion of this project was tried on one. To play it all the "
                "same: play(..., allow_dynamic=True)"
            )
        self._meet_entry(plan)
        behaviour = PlayPlan(plan, self._config.wbc.joint_friction)
        acceptance = Acceptance(plan, plant)

        def finished() -> bool:
            acceptance.note(self._loop.snapshot, self._loop.state.time - start)
            return behaviour.is_finished(self._loop.snapshot)

        self.playing = behaviour  # from now on a cancel() reaches it; one before is seen here
        try:
            if self._must_return:
                measured = self._runner.measurements()
                raise Aborted(f"{plan.name} was cancelled before it began", measured)
            self._mode = Mode.MOVING
            self._runner.engage(behaviour)
            start = self._loop.state.time
            self._runner.until(finished, plan.duration + 1.0, plan.name)
            if self._must_return:
                raise Aborted(f"{plan.name} was cancelled; the robot stands", self.stand())
            at_rest = self._settle(plan.exit, plan.name)
            if plan.exit is Posture.STAND:
                self._runner.engage(self._make_standing(Posture.STAND, HOLD_TIME))
        finally:
            self.playing = None
        return acceptance.judged(behaviour, self._loop.snapshot, at_rest)

    def return_safely(self) -> None:
        """Let the procedure that plays a motion leave it and stand; any thread may call it."""
        self._cancelled += 1
        if (playing := self.playing) is not None:
            playing.return_safely()

    def _meet_entry(self, plan: MotionPlan) -> None:
        self._runner.stop_stepping()
        mode, (entry, _) = self.mode, _RESTING[plan.entry]
        if mode is not entry and (mode, entry) != (Mode.WALKING, Mode.STANDING):
            raise StanceMismatch(
                f"motion {plan.name!r} starts from {plan.entry.value}, the robot is {mode.value}"
            )
        if plan.entry is Posture.STAND:
            self.square_up()

    def square_up(self) -> None:
        """Stand with the feet below the hips, stepping in place if need be."""
        self._ensure_standing()
        if not self._walker.square_up():
            self._finish_walking("square the feet")
            self._mode = Mode.STANDING
        self.stand()

    # --- helpers --------------------------------------------------------------------------

    def wait(self, seconds: float) -> Measurements:
        """Let time pass, whatever happens in it; a fault ends up in ``mode``."""
        known_fault = self._loop.fault
        self._runner.let_pass(seconds)
        fault = self._loop.fault
        if fault is not None and fault is not known_fault:
            raise Aborted(fault.reason, self._runner.measurements())
        if refusal := self._walker.refusal:
            raise Aborted(refusal, self._runner.measurements())
        return self._runner.measurements()

    @property
    def _is_on_the_ground(self) -> bool:
        return modes.base_height(self._loop.snapshot) < modes.LYING_HEIGHT


_RESTING = {
    Posture.LIE: (Mode.LYING, modes.lying),
    Posture.SIT: (Mode.SITTING, modes.sitting),
    Posture.STAND: (Mode.STANDING, modes.standing),
}
"""The mode of a robot that rests in a posture, and what is asked of it then."""
