"""Behaviours that play a motion plan: placed in the world, entered, left, and scaled to the weight.

On four feet the feedback holds a body that is heavier than its model, a little too low. In flight
and on two feet there is no time for that, so the weight is measured before: with 9 % more mass a
rear-up was up to 7 deg off its plan on average, with the measured weight 4 deg at most.

A cancelled motion leaves the plan on a safe path to four loaded feet. A raised paw cannot just be
put down, because only the plan's own path has been checked. So the plan's clock runs backwards or
forwards to the nearest safe instant.

Where feet swing to other footholds, or fewer than three stand, the robot depends on its momentum,
which a clock that slows down or reverses would take away. There the plan keeps its tempo until the
robot stands again: a jump that has begun lands first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from jaxtyping import Float

from controller.behaviours import Behaviour
from go2_wbc.curves import Ease
from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.recording import true_runs
from go2_wbc.reference import STANCE, Anchor, Reference, Target
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.landing import Landings
from go2_wbc.tracking.plan_tracking import Deviation, PlanTracker, fed_back, tracked_position
from motions.dynamics.phases import GRAVITY

TURNING = 0.3  #: Time [s] in which the plan's clock comes to a stop
STEP = 0.05
"""Time [s] between the instants that are looked at; a foot is loaded for longer than that."""
ARRIVED = 1e-3  #: Distance [s] from the safe instant at which the clock stands
_BRAKING = 0.8  #: Share of the clock's deceleration that the approach counts on
ROOM = TURNING / (2.0 * _BRAKING)
"""Time [s] of the plan that passes while the clock comes to a stop."""
PATIENCE = 1.0
"""Time [s] after it first stands on four feet for which a walk goes on until its clock can stop
smoothly; after that it is left where it first stands: own choice."""


class SafeReturn:
    """Runs the clock of a plan smoothly from one instant to the nearest safe one.

    Attributes:
        t, target: where its clock stands, and the safe instant [s].
        is_over: whether it has been reached.
    """

    def __init__(self, plan: MotionPlan, t: float) -> None:
        """Leave ``plan`` ``t`` seconds into it."""
        self._plan, self.t, self._rate = plan, min(t, plan.duration), 1.0
        self._way = way_out(plan, self.t)
        self.target = self._way.target
        self.is_over = False

    def advance(self, dt: float) -> Reference:
        """The reference ``dt`` seconds later, its rates those of the clock."""
        if self.t < self._way.keeps_tempo_until:
            self.t = min(self.t + dt, self._plan.duration)
            return self._plan.at(self.t)
        left = self.target - self.t
        has_stopped = abs(left) < ARRIVED and abs(self._rate) < 0.1
        self.is_over = self.is_over or self._way.is_left_in_motion or has_stopped
        if self.is_over or dt <= 0.0:
            return retimed(self._plan.at(self.t), 0.0 if self.is_over else self._rate, 0.0)
        wanted = np.sign(left) * min(1.0, np.sqrt(2.0 * _BRAKING * abs(left) / TURNING))
        change = float(np.clip(wanted - self._rate, -dt / TURNING, dt / TURNING))
        self._rate += change
        self.t += self._rate * dt
        return retimed(self._plan.at(self.t), self._rate, change / dt)


@dataclass(frozen=True, slots=True)
class WayOut:
    """How a plan is left."""

    target: float  #: instant [s] on four feet at which the clock shall stand
    keeps_tempo_until: float  #: instant [s] before which it keeps its tempo; -inf if it need not
    is_left_in_motion: bool = False
    """Whether the plan is left at the target as it goes, and not slowed down."""


def way_out(plan: MotionPlan, t: float) -> WayOut:
    """How ``plan`` is left from the instant ``t`` [s]."""
    calm = _calm_spans(plan)
    for start, end in calm:
        if start <= t < end and (t + ROOM <= end or end == plan.duration):
            target = nearest_safe_instant(plan, t, start, end)
            if target is not None:
                return WayOut(target, -np.inf)
    landings = (_landing(plan, span) for span in calm if span[0] > t)
    smooth = next(
        (way for way in landings if way is not None),
        WayOut(plan.duration, plan.duration, is_left_in_motion=True),
    )
    first = _next_on_four_feet(plan, t)
    if first + PATIENCE < smooth.keeps_tempo_until:
        return WayOut(first, first, is_left_in_motion=True)
    return smooth


def nearest_safe_instant(
    plan: MotionPlan, t: float, start: float = 0.0, end: float | None = None
) -> float | None:
    """The instant [s] on four fully loaded feet that is reached soonest from ``t``.

    Going back costs the time of turning round. Start and end of a plan are always safe.

    Args:
        t: from where [s].
        start, end: instants [s] between which it must be; the whole plan unless said otherwise.
            None is returned if there is none.
    """
    end = plan.duration if end is None else end
    later, earlier = np.arange(t, end, STEP), np.arange(t, start, -STEP)
    ahead = next((s for s in later.tolist() if _is_safe(plan, s)), np.inf)
    behind = next((s for s in earlier.tolist() if _is_safe(plan, s)), -np.inf)
    ahead = plan.duration if ahead == np.inf and end == plan.duration else ahead
    behind = 0.0 if behind == -np.inf and start == 0.0 else behind
    nearest = ahead if ahead - t <= t - behind + 2.0 * TURNING else behind
    return float(nearest) if np.isfinite(nearest) else None


def _is_safe(plan: MotionPlan, t: float) -> bool:
    reference = plan.at(t)
    loads = reference.normal_force_max
    return bool(reference.stance.all() and loads.min() >= loads.max())


def _calm_spans(plan: MotionPlan) -> list[tuple[float, float]]:
    """Spans [s] in which three feet or more stand and no foot swings to another place."""
    steps = plan.footsteps
    if steps is None:
        return [(0.0, plan.duration)]
    times = [*steps.contacts.times, np.inf]
    is_calm = ~steps.swings.any(axis=1) & (steps.contacts.modes.sum(axis=1) >= 3)
    return [(times[run.start], min(times[run.stop], plan.duration)) for run in true_runs(is_calm)]


def _landing(plan: MotionPlan, span: tuple[float, float]) -> WayOut | None:
    """The way to stop in a calm span ahead, if there is time enough."""
    start, end = span
    if start + ROOM > end:
        return None
    target = nearest_safe_instant(plan, start + ROOM, start + ROOM, end)
    return None if target is None else WayOut(target, start)


def _next_on_four_feet(plan: MotionPlan, t: float) -> float:
    if plan.footsteps is None:
        return plan.duration
    contacts = plan.footsteps.contacts
    on_four_feet = np.flatnonzero(contacts.modes.all(axis=1))
    return next((s for s in np.array(contacts.times)[on_four_feet] if s > t), plan.duration)


def retimed(reference: Reference, rate: float, change: float) -> Reference:
    """``reference`` as it is when its time runs at ``rate``, which grows by ``change`` [1/s].

    Forces that were planned for its own tempo are let go.
    """
    body = reference.body
    return replace(
        reference,
        body=replace(
            body,
            v_world=rate * body.v_world,
            a_world=rate**2 * body.a_world + change * body.v_world,
            w_world=rate * body.w_world,
            dw_world=rate**2 * body.dw_world + change * body.w_world,
        ),
        v_world_feet=rate * reference.v_world_feet,
        a_world_feet=rate**2 * reference.a_world_feet + change * reference.v_world_feet,
        v_joints=rate * reference.v_joints,
        a_joints=rate**2 * reference.a_joints + change * reference.v_joints,
        force_weight=0.0,
    )


LEAST_WEIGHT, MOST_WEIGHT = 0.8, 1.4
"""Bounds of the ratio: of the lightest robot, and of one that carries 6 kg."""
DOUBT = 0.02
"""Time [s] for which the model's weight counts as if it had been felt: a first tick is noisy."""
_JOINTS = [[6 + joint for joint in range(leg.joints.start, leg.joints.stop)] for leg in LEGS]


@final
class FeltWeight:
    """The robot's weight over that of its model.

    Standing on four feet, the mean force of the ground is the mass times gravity and the mean
    acceleration, whose plan is known. The force is that which balances the joints' torques.
    What was felt before the first foot leaves the ground stays.
    """

    def __init__(self, friction: JointFriction) -> None:
        """Begin with the model's; ``friction`` is what the joints take of the motors' torques."""
        self.ratio = 1.0  #: of the weights
        self._friction = friction
        self._felt = self._planned = DOUBT * GRAVITY
        self._is_over = False

    def add_to(self, target: Target, snapshot: Snapshot, dt: float) -> None:
        """Feel for ``dt`` seconds, and let a plan's target ask for more or less.

        The model's mass times the new acceleration and gravity is the felt mass times the planned
        ones: so much force does the plan take.
        """
        a_world = target.a_world
        if not self._is_over:
            self._is_over = bool((target.legs != STANCE).any())
        if not self._is_over:
            mass = float(snapshot.mass_matrix[0, 0])
            self._felt += dt * vertical_force(snapshot, self._friction) / mass
            self._planned += dt * (GRAVITY + float(a_world[2]))
            self.ratio = min(max(self._felt / self._planned, LEAST_WEIGHT), MOST_WEIGHT)
        a_world *= self.ratio
        a_world[2] += (self.ratio - 1.0) * GRAVITY


def vertical_force(snapshot: Snapshot, friction: JointFriction) -> float:
    """Force [N] of the ground on all feet that balances the torques of the joints.

    The inertia of the legs is left out: it is small where all feet stand.
    """
    J = np.stack([snapshot.J_contacts[leg][:, _JOINTS[leg]] for leg in LEGS])
    tau = snapshot.state.tau - friction.torque(snapshot.state.joint_velocities, np.zeros(12))
    load = (snapshot.bias[6:] - tau).reshape(4, 3, 1)
    return float(np.linalg.solve(J.transpose(0, 2, 1), load)[:, 2].sum())


FARTHEST = 0.02
"""Distance [m] by which a plan is moved at most; more than feet are beside their places after
standing up, of which 5 mm are common."""
APPROACH = 0.15
"""Time [s] of the approach: own choice, less than dynamic motions take to leave four feet; 5 mm
take 1.3 m/s^2."""
SAME_PLACE = 0.01
"""Distance [m] below which a foot is where it stood at the start: a landing's, at most."""
_PAIR = 2


def anchor_of(
    plan: MotionPlan, p_world_feet: Float[np.ndarray, "4 3"], foot_radius: float
) -> Anchor:
    """Where ``plan`` is played by a robot whose feet stand there.

    That is the frame of the feet (``Anchor.of_feet``). On two feet, though, the CoM balances over
    the line between them like an inverted pendulum, and where feet are a little beside their
    planned places, so is that line: 5 mm become 30 mm in half a second. So a dynamic plan is moved
    by as much as the lines between such feet are beside their planned places.
    """
    anchor = Anchor.of_feet(p_world_feet, foot_radius)
    pairs = _pairs(plan) if plan.has_dynamic_spans else []
    if not pairs:
        return anchor
    planned = plan.at(0.0).placed(anchor).p_world_feet
    across, beside = [], []
    for pair in pairs:
        x, y = np.subtract(*p_world_feet[pair, :2])
        normal = np.array([-y, x]) / np.hypot(x, y)
        across.append(normal)
        beside.append(normal @ (p_world_feet[pair, :2] - planned[pair, :2]).mean(axis=0))
    moved = np.linalg.lstsq(np.array(across), np.array(beside), rcond=None)[0]
    moved *= min(1.0, FARTHEST / max(float(np.linalg.norm(moved)), FARTHEST))
    return Anchor(anchor.p_world + np.array([*moved, 0.0]), anchor.yaw)


def offset_of(plan: MotionPlan, anchor: Anchor, snapshot: Snapshot) -> Float[np.ndarray, "3"]:
    """Place [m] of the tracked point from its planned one, in the motion's frame.

    Of a plan that is not dynamic zero: feedback alone comes near in half a second.
    """
    if not plan.has_dynamic_spans:
        return np.zeros(3)
    body = plan.at(0.0).body
    p = tracked_position(snapshot, body.point) - anchor.p_world
    return yaw_rotation(anchor.yaw).T @ p - body.p_world


def approach(target: Target, p_start: Float[np.ndarray, "3"], t: float) -> None:
    """Let a plan's target ``t`` seconds into it begin at the offset ``p_start``, by minimum jerk.

    So a plan is met that flies or balances before feedback could come near.
    """
    if t >= APPROACH or not p_start.any():
        return
    values = Ease.MINIMUM_JERK.progress(t / APPROACH)
    derivatives = target.p_world, target.v_world, target.a_world
    for power, derivative in enumerate(derivatives):
        share = values[power] / APPROACH**power
        left = 1.0 - share if power == 0 else -share
        derivative += left * p_start


def _pairs(plan: MotionPlan) -> list[list[Leg]]:
    """Two feet that carry the robot together, where they stand from the start."""
    steps = plan.footsteps
    if steps is None:
        return []
    placed, pairs = plan.at(0.0).p_world_feet, list[list[Leg]]()
    for t, stands in zip(steps.contacts.times, steps.contacts.modes, strict=True):
        pair = [Leg(leg) for leg in np.flatnonzero(stands)]
        if len(pair) == _PAIR and pair not in pairs:
            moved = plan.at(t).p_world_feet[pair] - placed[pair]
            pairs += [pair] if np.abs(moved).max() < SAME_PLACE else []
    return pairs


LOW = 0.15  #: Height [m] of the trunk over the ground below which a posture may begin on the belly
RISEN = 0.22
"""Height [m] of the tracked point over the ground from which on the robot has left its belly."""
SUNK_BACK = 0.04
"""Depth [m] below the highest that it has risen to, from which on a rising robot is falling: one
that is too weak, or carries too much, stops where it is."""


class PlayPlan(Behaviour):
    """Play a plan where the robot stands."""

    is_firm = True  #: Whether the trunk is held to the plan against the friction of the joints
    _anchor: Anchor
    _tracker: PlanTracker
    _p_start: Float[np.ndarray, "3"]
    _weight: FeltWeight

    def __init__(self, plan: MotionPlan, friction: JointFriction | None = None) -> None:
        """Play ``plan``; ``friction`` is that of the joints, by default as configured at first."""
        self._friction = friction or JointFriction()
        self.label, self.duration = plan.name, plan.duration
        self.plan, self.is_dynamic = plan, plan.has_dynamic_spans
        self._start = self._last = 0.0
        self._must_return = False
        self._return: SafeReturn | None = None

    def start(self, snapshot: Snapshot) -> None:
        """Anchor the plan at the feet."""
        super().start(snapshot)
        self._last = self._start
        self._anchor = anchor_of(self.plan, snapshot.p_world_feet, snapshot.foot_radius)
        self._tracker = PlanTracker(self._anchor, self.plan.footsteps, is_firm=self.is_firm)
        self._p_start = offset_of(self.plan, self._anchor, snapshot)
        self._weight = FeltWeight(self._friction)

    def return_safely(self) -> None:
        """Leave the plan: go to its nearest instant on four loaded feet; any thread may call."""
        self._must_return = True

    @property
    def progress(self) -> float:
        """Share of the plan that has been played, 0 to 1; 0 before ``start``."""
        return min(1.0, (self._last - self._start) / self.plan.duration)

    @property
    def deviation(self) -> Deviation:
        """How far the robot has been off the plan since ``start``."""
        return self._tracker.deviation

    @property
    def landings(self) -> Landings:
        """What came of the landings of feet that step."""
        return self._tracker.landings

    def end_error(self, snapshot: Snapshot) -> tuple[float, float]:
        """Distance [m], on the level, and angle [rad] of the feet's middle from its planned end.

        That is where the plan ends, placed where the robot stood when it began.
        """
        planned = self.plan.at(self.plan.duration).placed(self._anchor).p_world_feet
        wanted = Anchor.of_feet(planned, snapshot.foot_radius)
        stands = Anchor.of_feet(snapshot.p_world_feet, snapshot.foot_radius)
        off = (stands.p_world - wanted.p_world)[:2]
        return float(np.linalg.norm(off)), abs(wrap_angle(stands.yaw - wanted.yaw))

    @property
    def sag_and_lean(self) -> tuple[float, float] | None:  # type: ignore[override]
        """From the plan: a correction that pulls against a load is no wanted lean."""
        return self._tracker.sag_and_lean

    def update(self, snapshot: Snapshot) -> Reference:
        """The plan's reference of this instant, in the world."""
        now = snapshot.state.time
        target, t = self._planned(snapshot)
        reference = self._tracker.track(target, snapshot, t, now - self._last)
        self._last = now
        if not self.is_dynamic or self._return is not None:
            return reference
        feedback = self.plan.feedback_at(t)
        if feedback is None:
            return reference
        return fed_back(reference, feedback, self._tracker.anchor, snapshot)

    def _planned(self, snapshot: Snapshot) -> tuple[Target, float]:
        """What the plan asks for in this tick, and how far into the plan it is [s]."""
        now = snapshot.state.time
        if self._must_return and self._return is None:
            self._return = SafeReturn(self.plan, self._last - self._start)
        if self._return is not None:
            target = Target.of(self._return.advance(now - self._last).row)
            return target, self._return.t
        t = now - self._start
        target = Target.of(self.plan.row_at(t))
        approach(target, self._p_start, t)
        if self.is_dynamic:
            self._weight.add_to(target, snapshot, now - self._last)
        return target, t

    def is_finished(self, snapshot: Snapshot) -> bool:
        """Whether the plan is over, or the way back from it."""
        if self._return is not None:
            return self._return.is_over
        return super().is_finished(snapshot)


class ChangePosture(PlayPlan):
    """Play a plan that starts from the measured pose of the body."""

    knows_payload = True
    is_firm = False

    def __init__(self, make_plan: Callable[[Float[np.ndarray, "6"]], MotionPlan]) -> None:
        """Args: make_plan: from the pose (6,) of its point in the feet's frame to the plan."""
        super().__init__(make_plan(np.zeros(6)))  # until ``start`` has measured
        self._make_plan = make_plan
        self._point = self.plan.at(0.0).body.point

    def start(self, snapshot: Snapshot) -> None:
        """Make the plan from the measured pose."""
        super().start(snapshot)
        state, anchor = snapshot.state, self._anchor
        p = tracked_position(snapshot, self._point)
        roll, pitch, yaw = state.rpy
        position = yaw_rotation(anchor.yaw).T @ (p - anchor.p_world)
        pose = np.array([*position, roll, pitch, wrap_angle(float(yaw) - anchor.yaw)])
        self.plan = self._make_plan(pose)
        self.duration = self.plan.duration
        self._highest = float(pose[2])
        self.may_lie = bool(pose[2] < LOW) or self.plan.exit is Posture.LIE

    def update(self, snapshot: Snapshot) -> Reference:
        """The plan's reference; once the robot has risen, or sinks back, it must not lie."""
        height = float(tracked_position(snapshot, self._point)[2] - self._anchor.p_world[2])
        self._highest = max(self._highest, height)
        has_sunk_back = self._highest - height > SUNK_BACK
        if (height > RISEN or has_sunk_back) and self.plan.exit is not Posture.LIE:
            self.may_lie = False
        return super().update(snapshot)
