"""The control loop: one tick is read, check, snapshot, behaviour, whole-body QP, write, record.

Where the QP's constraints contradict each other, the relaxed QP (``wbc.solvers``) is solved and the
tick is counted; if constraints are gravely violated for ``grave_limit_time``, the robot is damped
for good. A QP failure is caught only here: the last good torque is held for one tick, then the
robot is damped while the failure lasts, and for good after ``qp_patience`` ticks; every one is
counted. A plant that fails, gives no new state, or gives one that is not finite, ends the behaviour
too.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from math import inf, isfinite

import numpy as np

from controller.behaviours import DAMPING, Behaviour, Damped, Shared
from controller.modes import Fault
from controller.pacing import REASON
from controller.telemetry import Telemetry
from go2_wbc.errors import ModeError, PlantError, PlantTimeout, QpInfeasible
from go2_wbc.planning.height_map import HeightMap, feel, fuse
from go2_wbc.plant.base import Plant, Scan
from go2_wbc.reference import JointReference, Reference, Target, hold_feet, sag_and_lean
from go2_wbc.robot.foot_watch import PULLED, FootWatch
from go2_wbc.robot.latency import LAGS, Latency
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor_watch import MotorWatch
from go2_wbc.robot.payload_estimation import PayloadEstimator
from go2_wbc.robot.rigid_body import NO_PAYLOAD, Payload
from go2_wbc.robot.safety import FallDetector, SafetyConfig, is_plausible
from go2_wbc.robot.state import Health, JointCommand, RobotState, Snapshot
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from go2_wbc.wbc.problem import Problem
from go2_wbc.wbc.solvers import is_grave

_log = logging.getLogger(__name__)

STATE_SIZES = {"q": 19, "v": 18, "tau": 12, "foot_forces": 4, "feet_in_contact": 4}
OLDEST_SCAN = 64  #: Ticks by which a scan may be late


class ControlLoop:
    """Runs one behaviour at a time on a plant."""

    def __init__(
        self,
        plant: Plant,
        model: RobotModel,
        wbc: WholeBodyController,
        telemetry: Telemetry,
        safety: SafetyConfig,
        dynamic_wbc: WholeBodyController | None = None,
        payloads: PayloadEstimator | None = None,
    ) -> None:
        """Start damped.

        Args:
            plant: what to drive.
            model: the robot.
            wbc: what follows references.
            telemetry: what records.
            safety: when to give up.
            dynamic_wbc: what follows those of dynamic behaviours; ``wbc`` unless given.
            payloads: what feels what the robot carries; nobody does unless given.

        Raises:
            PlantError: if the plant does not answer, or its state is not finite, or none.
        """
        self.plant, self.model, self.wbc, self.telemetry = plant, model, wbc, telemetry
        self._dynamic_wbc = dynamic_wbc or wbc
        self._is_hardware = plant.is_hardware
        self._safety = safety
        self._falls = FallDetector(safety, model.profile)
        self._sag = self._lean = 0.0
        self.fault: Fault | None = None  #: why the last behaviour was ended by the loop, or None
        self.warn: Callable[..., None] = _log.warning  #: writes a line of the log
        self.state: RobotState = plant.read()
        _require_state(plant, self.state)
        if not _is_plausible(self.state):
            raise PlantError(f"the first state of the plant is not finite: q={self.state.q}")
        self.snapshot: Snapshot = model.snapshot(self.state)
        """Of the last tick; of a simulated robot when the tick's command acts."""
        self.latency = Latency(plant.control_period)  #: how late that is
        self._ahead = self.state
        self.heights = HeightMap()  #: of the ground, as it has been seen
        self._past: deque[RobotState] = deque(maxlen=OLDEST_SCAN)
        self._payloads = payloads
        self._motors, self._held = MotorWatch(model.motor), np.zeros(4)
        self._feet = FootWatch(model.mass * model.gravity)
        self.health = Health()  #: which parts are broken
        self._commands = deque([JointCommand.damping(DAMPING)], LAGS)
        self._unanswered = 0
        self._qp_failures_in_a_row, self._grave_since = 0, inf
        self._asked: tuple[WholeBodyController, Snapshot, Reference] | None = None
        self._solution: WbcSolution | None = None
        is_up = self.state.tilt < safety.tilt_limit  # one that is found on its back has not fallen
        self.behaviour: Behaviour = Damped("lying", stays_on_belly=is_up)
        """What the robot does now."""
        self.engage(self.behaviour)

    def engage(self, behaviour: Behaviour, *, observe: bool = True) -> None:
        """Start ``behaviour`` from the present state and clear the fault.

        Args:
            behaviour: what to do from the next tick on.
            observe: read the plant before; needless where ticks have just done so.

        Raises:
            PlantTimeout: if the plant does not answer.
        """
        if observe:
            self._observe()
        self.snapshot = self.model.snapshot(self._ahead, self._payload_of(behaviour))
        self.fault = None
        self._qp_failures_in_a_row, self._grave_since = 0, inf
        self._falls.begin()
        self._sag = self._lean = 0.0
        behaviour.start(self.snapshot)
        self.behaviour = behaviour

    def abandon(self, fault: Fault) -> None:
        """Go limp and note why."""
        self.fault = fault
        self.behaviour = Damped("fallen" if fault.is_fall else "damped")
        self.behaviour.start(self.snapshot)
        self.warn(REASON, fault.reason)

    def go_limp(self) -> None:
        """Send the safe command once, even to a plant that fails."""
        with suppress(Exception):
            self.plant.write(JointCommand.damping(DAMPING))

    def tick(self) -> None:
        """One control period.

        Raises:
            PlantError: if the plant fails or stops answering. The robot is damped before, as far
                as the plant still obeys, and the fault is noted; so for any other exception.
        """
        try:
            # What a limp robot's joint is asked for changes with its speed, also within a tick.
            is_limp = isinstance(self.behaviour, Damped)
            if self._observe() and self.plant.motors_obey and not is_limp:
                acted = self._commands[max(-1 - self.latency.acted, -len(self._commands))]
                self._motors.update(acted, self.state, self.plant.control_period)
            self._look_after_parts()
            self._guard()
            self._feel()
            self.behaviour.delay = self.latency.delay
            target = self.behaviour.update(self.snapshot)
            self._sag, self._lean = self._sag_and_lean(target)
            self._watch_feet(target)
            self._foretold = False
            command = self._command(target)
            if not self._foretold:
                self.latency.forget()
            self._commands.append(command)
            self.plant.write(command)
            self._unanswered += 1
        except Exception as error:
            what = "plant failed" if isinstance(error, PlantError) else type(error).__name__
            self.abandon(Fault(f"{what}: {error}"))
            self.go_limp()
            raise
        self.telemetry.record(self.snapshot, target.stance, self.behaviour.label)
        if self.telemetry.explains:
            self.telemetry.note(self._solution)

    def problem(self) -> Problem:
        """The whole-body QP of the last tick.

        Raises:
            ModeError: if it had none.
        """
        if self._asked is None:
            doing = self.behaviour.label
            raise ModeError(f"nothing to explain: the whole-body QP has no part in {doing!r}")
        wbc, snapshot, target = self._asked
        return wbc.formulate(snapshot, target)

    def _observe(self) -> bool:
        """Read the plant; returns whether there is a new state."""
        state = self.plant.read()
        try:
            return self._take(state)
        except (AttributeError, TypeError, ValueError):
            _require_state(self.plant, state)
            raise

    def _take(self, state: RobotState) -> bool:
        is_finite = _is_plausible(state)
        if state.feet_in_contact.dtype.kind != "b":
            raise TypeError(state.feet_in_contact.dtype)
        if is_finite and state.time > self.state.time:
            self._unanswered = 0
            self.state = state
            self._ahead = state if self._is_hardware else self.latency.ahead(state)
            self.snapshot = self.model.snapshot(self._ahead, self._payload_of(self.behaviour))
            self._see(self.plant.scan())
            return True
        silence = self._unanswered * self.plant.control_period
        if silence > self._safety.stale_limit:
            lack = "new" if is_finite else "finite"
            raise PlantTimeout(f"no {lack} state from the plant for {1000 * silence:.0f} ms")
        return False

    def _see(self, scan: Scan | None) -> None:
        """Take scan and feet into the map; a plant that has never scanned has none.

        One that is later than states are kept is left out: nothing tells where it was taken.
        """
        past = self._past
        if scan is None and not past:
            return
        past.append(self.state)
        scan = None if scan is None else scan.checked()
        oldest = self.state.time - OLDEST_SCAN * self.plant.control_period
        if scan is not None and scan.time > oldest:
            taken = min(past, key=lambda state: abs(state.time - scan.time))
            place = taken.p_world_base, taken.R_world_base
            fuse(self.heights, scan.p_base_points, *place, scan.deviation)
            self.telemetry.see(self.heights, place[0])
        feel(self.heights, self.snapshot, self.state.feet_in_contact, self.plant.control_period)

    def _look_after_parts(self) -> None:
        """Say what has broken; a robot that cannot stand without it goes limp before it falls."""
        feet, now = self._feet, self.state.time
        sensed = (fault for fault in self.plant.sensor_faults if not feet.excuses(fault, now))
        faults = (*sensed, *self._motors.faults, *feet.faults)
        if faults != self.health.faults:
            for fault in (fault for fault in faults if fault not in self.health.faults):
                self.warn(REASON, fault)
            self.health = Health(faults)
        if faults and self.fault is None and self.behaviour.needs_balance:
            grave = [str(fault) for fault in faults if not fault.is_survived]
            if grave:
                self.abandon(Fault("; ".join(grave), may_fall=True))

    def _watch_feet(self, target: Reference | JointReference | Shared) -> None:
        if not (isinstance(target, Reference) and self.plant.motors_obey):
            return
        if hold_feet(Target.of(target.row), self.snapshot, self.state.tau, self._held) > PULLED:
            self._feet.update(self._held, self.state, self._sag, self.plant.control_period)

    def _payload_of(self, behaviour: Behaviour) -> Payload:
        return self.telemetry.payload if behaviour.knows_payload else NO_PAYLOAD

    def _feel(self) -> None:
        if self._payloads is None:
            return
        if self.behaviour.knows_payload:
            self.telemetry.payload = self._payloads.update(self.snapshot)
        else:
            self._payloads.pause()

    def _guard(self) -> None:
        fault = self.fault
        limit = self._safety.greatest_tilt(is_astray=True)
        is_tipping = fault is not None and self.state.tilt > limit
        if not (self.behaviour.needs_balance or is_tipping):
            return
        may_lie = self.behaviour.may_lie
        reason = self._falls.reason(self.snapshot, self._sag, self._lean, may_lie=may_lie)
        if reason is None or (fault is not None and fault.is_fall):
            return
        told = reason if fault is None else f"{reason}, after: {fault.reason}"
        self.abandon(Fault(told, is_fall=True))

    def _sag_and_lean(self, target: Reference | JointReference | Shared) -> tuple[float, float]:
        """Depth [m] of the trunk below where it shall be, and its tilt [rad] from how it shall be.

        0 if nothing is asked of it.
        """
        if isinstance(target, JointReference):
            return 0.0, 0.0
        planned, shadow = self.behaviour.sag_and_lean, target
        if isinstance(shadow, Shared):
            shadow = shadow.reference
        return planned or sag_and_lean(Target.of(shadow.row), self.snapshot)

    def _command(self, target: Reference | JointReference | Shared) -> JointCommand:
        self._asked = self._solution = None
        if isinstance(target, JointReference):
            return JointCommand.servo(target.q_joints, target.v_joints, target.kp, target.kd)
        if isinstance(target, Shared):
            if target.share == 1.0:
                return target.command
            own = self._command(target.reference)
            self._foretold = False
            return target.mixed(own, self.state)
        try:
            wbc = self._dynamic_wbc if self.behaviour.is_dynamic else self.wbc
            self._asked = wbc, self.snapshot, target
            self._solution = solution = wbc.solve(self.snapshot, target, relax=True)
        except QpInfeasible as error:
            return self._without_solution(error)
        if solution.is_relaxed:
            return self._relaxed(solution)
        self._qp_failures_in_a_row, self._grave_since = 0, inf
        return self._followed(solution)

    def _followed(self, solution: WbcSolution) -> JointCommand:
        self.latency.note(solution.tau_motors, solution.qdd)
        self._foretold = True
        return self.latency.with_servo(solution.command, solution.qdd, self.snapshot)

    def _relaxed(self, solution: WbcSolution) -> JointCommand:
        """Follow a solution whose constraints gave way, unless they do gravely for too long."""
        self.telemetry.relaxed_ticks += 1
        self._qp_failures_in_a_row = 0
        if not is_grave(solution.violations):
            self._grave_since = inf
            return self._followed(solution)
        self.telemetry.grave_ticks += 1
        self._grave_since = min(self._grave_since, self.state.time)
        lasted = self.state.time - self._grave_since
        if lasted < self._safety.grave_limit_time:
            return self._followed(solution)
        worst = ", ".join(f"{row.name} {row.norm:.0f} {row.unit}" for row in solution.violations)
        reason = f"damped after {lasted:.2f} s of broken constraints: {worst}"
        self.abandon(Fault(reason, may_fall=True))
        return JointCommand.damping(DAMPING)

    def _without_solution(self, error: QpInfeasible) -> JointCommand:
        self.telemetry.qp_failures += 1
        self._qp_failures_in_a_row += 1
        streak = self._qp_failures_in_a_row
        if streak >= self._safety.qp_patience:
            summary = str(error).splitlines()[0]
            reason = f"damped after {streak} QP failures in a row: {summary}"
            self.abandon(Fault(reason, may_fall=True))
        elif streak == 1:
            is_first = self.telemetry.qp_failures == 1
            what = str(error) if is_first else str(error).splitlines()[0]  # one table is enough
            time = self.state.time
            self.warn("QP failure at t=%.3f s, holding the last torque: %s", time, what)
            return self._commands[-1]
        return JointCommand.damping(DAMPING)


def _require_state(plant: Plant, state: RobotState) -> None:
    """Raise PlantError for what a user's plant takes for a state."""
    told = f"{type(plant).__name__}.read() must give a RobotState"
    if not isinstance(state, RobotState):
        raise PlantError(f"{told}, got {state!r:.80}")
    for name, size in STATE_SIZES.items():
        part, kind = getattr(state, name), np.dtype(bool if name == "feet_in_contact" else float)
        if not (isinstance(part, np.ndarray) and part.shape == (size,) and part.dtype == kind):
            given = f"{np.shape(part)} of {getattr(part, 'dtype', type(part).__name__)}"
            raise PlantError(f"{told} with {name} of shape ({size},) of {kind}, got {given}")


def _is_plausible(state: RobotState) -> bool:
    is_a_state = is_plausible(state.q, state.v, state.tau, state.foot_forces)
    return is_a_state and isfinite(state.time)
