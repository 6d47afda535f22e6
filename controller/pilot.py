"""The pilot: sequences behaviours into what a user asks for, and measures what came of it.

Every public method is a procedure that either ends with the measured figures, or raises ``Aborted``
with the reason in plain words. It knows nothing of users, locks or outcomes: ``GO2Controller`` is
the face that turns procedures into calls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from statistics import fmean

import numpy as np

from controller.behaviours.base import Behaviour
from controller.behaviours.joints import Damped, ServoJoints
from controller.behaviours.plans import ChangePosture, PlayPlan
from controller.behaviours.walking import Walking
from controller.checks import (
    LYING_HEIGHT,
    ground_height,
    is_lying,
    is_sitting,
    is_standing,
    posture_figures,
)
from controller.loop import Fault
from controller.modes import Mode
from controller.navigation import DriveStraight, Errand, TurnInPlace
from controller.recovery import roll_over
from controller.runner import Runner
from go2_wbc.config import Config
from go2_wbc.contacts import find_gait
from go2_wbc.errors import ModeError, StanceMismatch
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.locomotion import LocomotionPlanner
from go2_wbc.reference import MotionPlan, Stance, TrackedPoint
from motions.high_five import HighFivePlan
from motions.postures import SPLAYED_JOINTS, TUCKED_JOINTS, lie_down, rise, sit_down

SETTLE_LIMIT = 3.0
"""Time [s] in which a posture must come to rest after its motion."""
STOP_LIMIT = 4.0
"""Time [s] in which a walking robot must come to rest after ``stop``."""
TUCK_TIME = 0.9
"""Time [s] of drawing the feet under the hips while lying."""
SPLAY_TIME = 0.5
"""Time [s] of spreading the folded legs until the belly is on the ground."""
LIMP_TIME = 0.6
"""Time [s] for which the robot is left to sink before it counts as lying."""
SINK_TIME = 1.0
"""Time [s] for which a robot that went limp on its feet is watched: it sinks, or it falls."""

PAW_TOLERANCE = 0.03
"""Distance [m] that the paw, on the average of the hold, may be below its planned height."""

Figures = Mapping[str, float]


class Aborted(Exception):
    """A procedure did not reach its end; the message says why."""


class Pilot:
    """Runs procedures on one loop.

    Attributes:
        mode: what the robot is doing.
    """

    def __init__(self, runner: Runner, config: Config) -> None:
        """Take over a robot that lies on the ground."""
        self._runner = runner
        self._loop = runner.loop
        self._model = runner.loop.model
        self._config = config
        self._walking: Walking | None = None
        self._mode = Mode.LYING

    @property
    def mode(self) -> Mode:
        """What the robot is doing, faults of the loop included."""
        fault = self._loop.fault
        if fault is None:
            return self._mode
        return Mode.FALLEN if fault.is_fall else Mode.DAMPED

    @property
    def command(self) -> VelocityCommand:
        """The velocity command that is being followed."""
        if self._walking is None or self.mode is not Mode.WALKING:
            return ZERO_COMMAND
        return self._walking.command

    def begin(self) -> None:
        """Begin a procedure: the mode is from now on what the last fault, if any, has made it."""
        self._mode = self.mode
        self._runner.begin()

    # --- postures -------------------------------------------------------------------------

    def stand(self) -> Figures:
        """Stand, from any mode but fallen."""
        mode = self.mode
        if mode is Mode.WALKING:
            self.rest()
        if mode in (Mode.LYING, Mode.DAMPED) or self.is_on_the_ground:
            self._tuck()
        entry = {Mode.SITTING: Stance.SIT, Mode.LYING: Stance.LIE}.get(mode, Stance.STAND)
        duration = 0.4 if mode in (Mode.STANDING, Mode.WALKING) else 1.2
        self._take_posture("stand", lambda pose: rise(pose, entry, duration), TrackedPoint.COM)
        self._settle("stand", is_standing)
        self._mode = Mode.STANDING
        return self._figures()

    def sit(self) -> Figures:
        """Sit like a dog, from any mode but fallen."""
        if self.mode is Mode.SITTING:
            self._settle("sit", is_sitting)
            return self._figures()
        self._ensure_standing()
        self._take_posture("sit", sit_down, TrackedPoint.BASE)
        self._settle("sit", is_sitting)
        self._mode = Mode.SITTING
        return self._figures()

    def lie_down(self) -> Figures:
        """Lie down and go limp."""
        if self.mode in (Mode.LYING, Mode.DAMPED) or self.is_on_the_ground:
            self._go_limp()
            return self._figures()
        if self.mode is not Mode.MOVING:  # a stand that failed need not succeed to lie down
            self._ensure_standing()
        self._take_posture("lie down", lie_down, TrackedPoint.BASE)
        self._go_limp()
        return self._figures()

    def recover(self) -> Figures:
        """Get up after a fall onto the belly, a side or the back."""
        if self.mode.is_upright:
            return self.stand()
        self._mode = Mode.DAMPED
        self._run(Damped("recover", LIMP_TIME), LIMP_TIME + 1.0)
        for step in roll_over(self._loop):
            self._run(step, 4.0)
        if self._loop.state.tilt > 0.6:
            reason = f"could not roll onto the belly: {self._attitude()}"
            with self._runner.lock:
                self._loop.abandon(Fault(reason, is_fall=True))
            raise Aborted(reason)
        self._mode = Mode.LYING
        return self.stand()

    def _tuck(self) -> None:
        if self._loop.state.tilt > 0.6:
            raise Aborted(f"cannot stand up from {self._attitude()}; call recover()")
        self._mode = Mode.MOVING
        self._run(ServoJoints("tuck", ((TUCK_TIME, TUCKED_JOINTS),)), TUCK_TIME + 0.5)

    def _go_limp(self) -> None:
        if self._loop.state.tilt < 0.6:  # or it would rest on folded legs, belly in the air
            self._run(ServoJoints("splay", ((SPLAY_TIME, SPLAYED_JOINTS),)), SPLAY_TIME + 0.5)
        self._run(Damped("lie", LIMP_TIME), LIMP_TIME + 0.5)
        self._settle("lie down", is_lying)
        self._mode = Mode.LYING

    def _ensure_standing(self) -> None:
        if self.mode is not Mode.STANDING:
            self.stand()

    # --- walking --------------------------------------------------------------------------

    def walk(self, gait: str) -> Figures:
        """Enter walking mode, ready for commands."""
        find_gait(gait)
        if self.mode is not Mode.WALKING:
            self._ensure_standing()
        self._start_walking(gait)
        self._pass(0.2)
        self._mode = Mode.WALKING
        return self._figures()

    def set_command(self, command: VelocityCommand) -> VelocityCommand:
        """Follow ``command``, clipped to the envelope; returns what is followed.

        Raises:
            ModeError: outside walking mode.
        """
        if self.mode is not Mode.WALKING or self._walking is None:
            raise ModeError(f"move() needs walking mode, not {self.mode.value}: call walk() first")
        self._walking.command = self._config.envelope.clip(command)
        return self._walking.command

    def rest(self) -> Figures:
        """Zero the command and let the walking robot come to rest."""
        walking = self._walking
        if self.mode is Mode.WALKING and walking is not None:
            walking.command = ZERO_COMMAND
            loop = self._loop
            self._until(lambda: walking.is_finished(loop.snapshot), STOP_LIMIT, "come to rest")
        return self._figures()

    def run_errand(self, errand: Errand) -> Figures:
        """Walk an errand to its measured end and come to rest."""
        if self.mode is not Mode.WALKING:
            self.walk("trot")
        self.rest()
        walking, loop = self._walking or self._start_walking("trot"), self._loop

        def arrived() -> bool:
            walking.command = self._config.envelope.clip(errand.command(loop.state))
            return errand.is_done(loop.state)

        errand.begin(loop.state)
        try:
            self._until(arrived, errand.time_limit, errand.name)
        finally:
            walking.command = ZERO_COMMAND
        self.rest()
        figures = errand.figures(loop.state)
        if not errand.is_within_tolerance(loop.state):
            raise Aborted(f"{errand.name} missed: {_listed(figures)}")
        return figures

    def turn(self, angle: float) -> Figures:
        """Turn left by ``angle`` [rad]."""
        return self.run_errand(TurnInPlace(angle))

    def drive(self, distance: float) -> Figures:
        """Walk ``distance`` [m] straight ahead; negative is backward."""
        return self.run_errand(DriveStraight(distance))

    def _start_walking(self, gait: str) -> Walking:
        planner = LocomotionPlanner(self._model, find_gait(gait), self._config.locomotion)
        walking = Walking(planner)
        self._engage(walking)
        self._walking = walking
        return walking

    # --- motions --------------------------------------------------------------------------

    def play(self, plan: MotionPlan, watch: Callable[[float], None] | None = None) -> Figures:
        """Play ``plan``; ``watch(t)`` is called after every tick, t seconds into it.

        Raises:
            StanceMismatch: if the plan starts from another stance.
        """
        self._meet_entry(plan)
        self._mode = Mode.MOVING
        behaviour = PlayPlan(plan, self._model.foot_radius)
        self._engage(behaviour)
        start = self._loop.state.time

        def finished() -> bool:
            if watch is not None:
                watch(self._loop.state.time - start)
            return behaviour.is_finished(self._loop.snapshot)

        self._until(finished, plan.duration + 1.0, plan.name)
        self._settle(plan.name, _CHECK_OF_STANCE[plan.exit])
        self._mode = _MODE_OF_STANCE[plan.exit]
        return self._figures()

    def _meet_entry(self, plan: MotionPlan) -> None:
        mode = self.mode
        if mode is Mode.WALKING and plan.entry is Stance.STAND:
            self.square_up()
            mode = self.mode
        if _MODE_OF_STANCE[plan.entry] is not mode:
            raise StanceMismatch(
                f"motion {plan.name!r} starts from {plan.entry.value}, the robot is {mode.value}"
            )
        if plan.entry is Stance.STAND:
            self.square_up()

    def high_five(self, plan: HighFivePlan) -> Figures:
        """Give a high five, from any mode but fallen, and measure how high the paw was held."""
        self._ensure_standing()
        loop, leg = self._loop, plan.leg
        heights: list[float] = []

        def watch(t: float) -> None:
            if plan.hold_start <= t <= plan.hold_end:
                ground = ground_height(loop.snapshot, self._model)
                heights.append(float(loop.snapshot.p_world_feet[leg, 2]) - ground)

        figures = self.play(plan, watch)
        held = {"least paw height [m]": min(heights), "mean paw height [m]": fmean(heights)}
        if fmean(heights) < plan.paw_height - PAW_TOLERANCE:
            raise Aborted(f"the paw was not held at {plan.paw_height:.2f} m: {_listed(held)}")
        return {**figures, **held}

    def square_up(self) -> None:
        """Stand with the feet below the hips, stepping in place if need be."""
        if self.mode is not Mode.STANDING:
            self._ensure_standing()
        walking = self._start_walking("trot")
        if not walking.square_up(self._loop.snapshot):
            loop = self._loop
            self._mode = Mode.WALKING
            self._until(lambda: walking.is_finished(loop.snapshot), STOP_LIMIT, "square the feet")
            self._mode = Mode.STANDING
        self.stand()

    # --- helpers --------------------------------------------------------------------------

    def collapse(self, reason: str) -> None:
        """Go limp at once; ends the procedure that runs. Any thread may call it."""
        self._runner.interrupt(reason)

    def wait(self, seconds: float) -> Figures:
        """Let time pass, whatever happens in it; a fault ends up in ``mode``."""
        known_fault = self._loop.fault
        self._let_pass(seconds)
        fault = self._loop.fault
        if fault is not None and fault is not known_fault:
            raise Aborted(fault.reason)
        return self._figures()

    def _let_pass(self, seconds: float) -> None:
        end = self._loop.state.time + seconds - 1e-9
        while self._loop.state.time < end:
            self._runner.advance_until(lambda: False, end - self._loop.state.time)

    def _take_posture(
        self,
        label: str,
        make_plan: Callable[[np.ndarray], MotionPlan],
        point: TrackedPoint,
    ) -> None:
        behaviour = ChangePosture(label, make_plan, point, self._model.foot_radius)
        self._mode = Mode.MOVING
        self._run(behaviour, 5.0)

    def _run(self, behaviour: Behaviour, limit: float) -> None:
        self._engage(behaviour)
        loop = self._loop
        self._until(lambda: behaviour.is_finished(loop.snapshot), limit, behaviour.label)

    def _engage(self, behaviour: Behaviour) -> None:
        fault = self._runner.engage(behaviour)
        if fault is not None:
            raise Aborted(fault.reason)

    def _settle(self, what: str, check: Callable[..., bool]) -> None:
        loop, model = self._loop, self._model
        calm_since: list[float] = []

        def calm() -> bool:
            if not check(loop.snapshot, model):
                calm_since.clear()
                return False
            calm_since.append(loop.state.time)
            return loop.state.time - calm_since[0] >= 0.1

        self._until(calm, SETTLE_LIMIT, what)

    def _pass(self, seconds: float) -> None:
        end = self._loop.state.time + seconds - 1e-9
        self._until(lambda: self._loop.state.time >= end, seconds + 0.1, "wait")

    def _until(self, is_done: Callable[[], bool], limit: float, what: str) -> None:
        if self._runner.advance_until(is_done, limit):
            return
        fault = self._loop.fault
        if fault is not None and fault.may_fall:
            self._let_pass(SINK_TIME)
            fault = self._loop.fault or fault
        if fault is not None:
            raise Aborted(fault.reason)
        raise Aborted(f"{what} not done within {limit:.1f} s: {_listed(self._figures())}")

    def _figures(self) -> Figures:
        return posture_figures(self._loop.snapshot, self._model)

    def _attitude(self) -> str:
        roll, pitch, _ = np.degrees(self._loop.state.rpy)
        return f"roll {roll:.0f} deg, pitch {pitch:.0f} deg"

    @property
    def is_on_the_ground(self) -> bool:
        """Whether the trunk is so low that the robot lies."""
        snapshot = self._loop.snapshot
        height = float(snapshot.state.q[2]) - ground_height(snapshot, self._model)
        return math.isfinite(height) and height < LYING_HEIGHT


_MODE_OF_STANCE = {
    Stance.LIE: Mode.LYING,
    Stance.SIT: Mode.SITTING,
    Stance.STAND: Mode.STANDING,
}
_CHECK_OF_STANCE = {Stance.LIE: is_lying, Stance.SIT: is_sitting, Stance.STAND: is_standing}


def _listed(figures: Figures) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in figures.items())
