"""Behaviours that play a motion plan: where, how they come to it, and for how heavy a robot.

On four feet the feedback holds a body that is heavier than its model, a little too low. In flight
and on two feet there is no time for that, so the weight is felt before: with 9 % more mass a
rear-up was up to 7 deg off its plan on the average, with what is felt here 4 deg at most.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from controller.behaviours import Behaviour
from controller.behaviours.safe_return import SafeReturn
from go2_wbc.curves import Ease
from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.reference import STANCE, Anchor, Reference, Target
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.landing import Landings
from go2_wbc.tracking.plan_tracking import Deviation, PlanTracker, fed_back, tracked_position
from motions.dynamics.phases import GRAVITY

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

    Attributes:
        ratio: of the weights.
    """

    def __init__(self, friction: JointFriction) -> None:
        """Begin with the model's; ``friction`` is what the joints take of the motors' torques."""
        self.ratio = 1.0
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


@dataclass(frozen=True, slots=True)
class Approach:
    """The way from where the robot stands to a dynamic plan, by minimum jerk.

    Feedback alone comes near in half a second; a plan that flies or balances before is met so.

    Attributes:
        p_start: (3,) place [m] of the tracked point from its planned one, in the motion's frame.
    """

    p_start: Float[np.ndarray, "3"]

    @staticmethod
    def of(plan: MotionPlan, anchor: Anchor, snapshot: Snapshot) -> Approach:
        """From where the robot stands; none for a plan that is not dynamic."""
        if not plan.has_dynamic_spans:
            return Approach(np.zeros(3))
        body = plan.at(0.0).body
        seen = yaw_rotation(anchor.yaw).T @ (
            tracked_position(snapshot, body.point) - anchor.p_world
        )
        return Approach(seen - body.p_world)

    def add_to(self, target: Target, t: float) -> None:
        """Add what is left of the way ``t`` seconds into the plan to its target of that instant."""
        if t >= APPROACH or not self.p_start.any():
            return
        values = Ease.MINIMUM_JERK.progress(t / APPROACH)
        derivatives = target.p_world, target.v_world, target.a_world
        for power, derivative in enumerate(derivatives):
            share = values[power] / APPROACH**power
            left = 1.0 - share if power == 0 else -share
            derivative += left * self.p_start


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

    _anchor: Anchor
    _tracker: PlanTracker
    _approach: Approach
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
        self._tracker = PlanTracker(self._anchor, self.plan.footsteps)
        self._approach = Approach.of(self.plan, self._anchor, snapshot)
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
        self._approach.add_to(target, t)
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
