"""Runs behaviours until something is measured, or says in plain words why it was not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import fmean
from typing import NoReturn

from controller.behaviours.base import Behaviour
from controller.behaviours.plans import PlayPlan
from controller.behaviours.standing import Standing
from controller.checks import (
    arrival_measurements,
    deviation_measurements,
    ground_height,
    has_arrived,
    is_small,
    is_standing,
    posture_measurements,
)
from controller.loop import Fault
from controller.runner import Runner
from go2_wbc.errors import DynamicMotionRefused
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.plant import Plant
from go2_wbc.robot.snapshot import Snapshot

SETTLE_LIMIT = 3.0
"""Time [s] in which a posture must come to rest after its motion."""
STEPS_LIMIT = 4.0
"""Time [s] in which steps for balance must come to rest."""
CALM_TIME = 0.1
"""Time [s] for which a posture must hold without a break."""
ROUNDING = 1e-9
"""Time [s] by which a sum of control periods may miss its end."""
TOUCH_FORCE = 1.0
"""Force [N] of the ground on trunk or legs that counts as a touch."""
TOUCH_TIME = 0.01
"""Time [s] for which they may touch it in a motion: what the benchmarks call a touch."""
PAW_TOLERANCE = 0.03
"""Distance [m] that a foot, on the average of its hold, may be below its planned height."""
SINK_TIME = 1.0
"""Time [s] for which a robot that went limp on its feet is watched: it sinks, or it falls."""

Measurements = Mapping[str, float]
"""Measured quantities by name with unit."""


class Aborted(Exception):
    """A procedure did not reach its end; the message says why, ``measured`` what was measured."""

    def __init__(self, reason: str, measured: Measurements | None = None) -> None:
        super().__init__(reason)
        self.measured = dict(measured or {})


class ProcedureRunner:
    """Lets time pass on a runner until something is measured.

    Attributes:
        loop: what it lets run; to be changed between ticks of the runner.

    Every method but ``measurements`` and ``let_pass`` raises ``Aborted`` if it cannot do its work.
    """

    def __init__(self, runner: Runner) -> None:
        """Run on ``runner``."""
        self._runner = runner
        self.loop = runner.loop

    def engage(self, behaviour: Behaviour) -> None:
        """Switch to ``behaviour``."""
        fault = self._runner.engage(behaviour)
        if fault is not None:
            raise self._aborted(fault.reason)

    def run(self, behaviour: Behaviour, limit: float) -> None:
        """Switch to ``behaviour`` and let it finish, within ``limit`` seconds."""
        self.engage(behaviour)
        self.until(lambda: behaviour.is_finished(self.loop.snapshot), limit, behaviour.label)

    def settle(self, what: str, check: Callable[[Snapshot], bool]) -> None:
        """Let time pass until ``check`` has held for a while."""
        if not self.settles(check):
            raise self._late(what, SETTLE_LIMIT)

    def settles(self, check: Callable[[Snapshot], bool]) -> bool:
        """Let time pass until ``check`` has held for a while; whether it came to that."""
        loop = self.loop
        calm_since: list[float] = []

        def calm() -> bool:
            if not check(loop.snapshot):
                calm_since.clear()
                return False
            calm_since.append(loop.state.time)
            return loop.state.time - calm_since[0] >= CALM_TIME

        return self._comes(calm, SETTLE_LIMIT)

    def until(self, is_done: Callable[[], bool], limit: float, what: str) -> None:
        """Let time pass until ``is_done()``, for ``limit`` seconds at most."""
        if not self._comes(is_done, limit):
            raise self._late(what, limit)

    def _comes(self, is_done: Callable[[], bool], limit: float) -> bool:
        """Whether ``is_done()`` came within ``limit`` seconds; a fault is raised."""
        if self._runner.advance_until(is_done, limit):
            return True
        fault = self.loop.fault
        if fault is not None and fault.may_fall:
            self.let_pass(SINK_TIME)
            fault = self.loop.fault or fault
        if fault is not None:
            raise self._aborted(fault.reason)
        return False

    def _late(self, what: str, limit: float) -> Aborted:
        reason = f"{what} not done within {limit:.1f} s: {listed(self.measurements())}"
        return self._aborted(reason)

    @property
    def is_stepping(self) -> bool:
        """Whether a standing robot steps for balance now."""
        behaviour = self.loop.behaviour
        return isinstance(behaviour, Standing) and behaviour.is_stepping

    def stop_stepping(self) -> None:
        """Wait until a robot that steps for balance stands again."""
        if self.is_stepping:
            self.until(lambda: not self.is_stepping, STEPS_LIMIT, "stand again")
            self.settle("stand again", is_standing)

    def let_pass(self, seconds: float) -> None:
        """Let time pass, whatever happens in it."""
        end = self.loop.state.time + seconds - ROUNDING
        while self.loop.state.time < end:
            self._runner.advance_until(lambda: False, end - self.loop.state.time)

    def give_up(self, reason: str) -> NoReturn:
        """Go limp; the robot counts as fallen."""
        self._runner.between_ticks(lambda: self.loop.abandon(Fault(reason, is_fall=True)))
        raise self._aborted(reason)

    def measurements(self) -> Measurements:
        """What is measured now."""
        return posture_measurements(self.loop.snapshot)

    def _aborted(self, reason: str) -> Aborted:
        return Aborted(reason, self.measurements())


class Touches:
    """Counts for how long more than the feet touches the ground, on a plant that can tell."""

    def __init__(self, plant: Plant) -> None:
        """Count on ``plant``."""
        self._plant, self._time = plant, 0.0

    def note(self) -> None:
        """Once a tick."""
        force = self._plant.body_contact_force
        if force is not None and force > TOUCH_FORCE:
            self._time += self._plant.control_period

    def require_few(self, plan: MotionPlan) -> None:
        """Raise ``Aborted`` if it was for longer than ``TOUCH_TIME``, unless the robot may lie."""
        if self._time > TOUCH_TIME and Posture.LIE not in (plan.entry, plan.exit):
            raise Aborted(
                f"{plan.name} touched the ground with trunk or legs for {self._time:.2f} s"
            )


class HeldFeet:
    """Measures how high the feet are held that a plan holds up."""

    def __init__(self, plan: MotionPlan) -> None:
        """None may be held."""
        self._plan, self._held = plan, plan.held_feet
        self._heights: list[list[float]] = [[] for _ in self._held]

    def note(self, snapshot: Snapshot, t: float) -> None:
        """Once a tick, ``t`` seconds into the plan."""
        for foot, heights in zip(self._held, self._heights, strict=True):
            if foot.start <= t <= foot.end:
                heights.append(float(snapshot.p_world_feet[foot.leg, 2]) - ground_height(snapshot))

    def judged(self, measured: Measurements) -> Measurements:
        """``measured`` with the heights, if they are those of the plan; else raise ``Aborted``."""
        found, is_low = dict(measured), False
        for foot, heights in zip(self._held, self._heights, strict=True):
            where = f" in {foot.name}" if len(self._held) > 1 else ""
            found[f"planned paw height{where} [m]"] = round(foot.height, 9)  # of a curve
            found[f"least paw height{where} [m]"] = min(heights)
            found[f"mean paw height{where} [m]"] = fmean(heights)
            is_low = is_low or fmean(heights) < foot.height - PAW_TOLERANCE
        if is_low:
            name = self._plan.name
            raise Aborted(f"{name} held no paw at its height: {listed(found)}", found)
        return found


def judged(played: PlayPlan, snapshot: Snapshot, at_rest: Measurements) -> Measurements:
    """What was measured of a motion, if that shows that it was done; else raise ``Aborted``.

    Args:
        played: the motion, which is over.
        snapshot: of the robot at rest.
        at_rest: what was measured of it then.
    """
    deviation, name = played.deviation, played.plan.name
    measured = {**at_rest, **deviation_measurements(deviation)}
    if played.plan.footsteps is not None:
        arrival = *played.end_error(snapshot), played.landings
        measured |= arrival_measurements(*arrival)
        if not has_arrived(*arrival):
            raise Aborted(f"{name} ended elsewhere: {listed(measured)}", measured)
    if not is_small(deviation, is_dynamic=played.plan.has_dynamic_spans):
        raise Aborted(f"{name} went another way: {listed(measured)}", measured)
    return measured


def refuse_dynamic_on_hardware(plan: MotionPlan, plant: Plant) -> None:
    """Raise ``DynamicMotionRefused`` for a dynamic plan on a plant that may be a robot."""
    if plan.is_dynamic and plant.is_hardware:
        raise DynamicMotionRefused(
            f"motion {plan.name!r} is dynamic: fewer than three feet carry the robot in parts "
            f"of it, so it cannot be stopped there, and {type(plant).__name__} may move a "
            "robot. No dynamic motion of this project was tried on one. To play it all the "
            "same: play(..., allow_dynamic=True)"
        )


def interruption(name: str, error: BaseException) -> str:
    """Why the call ``name`` ended by ``error``, in plain words."""
    if isinstance(error, KeyboardInterrupt):
        return f"interrupted during {name}()"
    return f"{type(error).__name__} during {name}(): {error}"


def listed(measured: Measurements) -> str:
    """``measured`` in one line."""
    return ", ".join(f"{name} {value:.3g}" for name, value in measured.items())
