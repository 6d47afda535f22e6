"""A plan followed where the robot stands, tick by tick.

The plan's reference is placed in the world; stepping feet land when they touch the ground
(``landing``); the tracking error is recorded; and the integral of the remaining error corrects the
trunk's target (see ``planning.trunk``). The integral is held in flight, where nothing can be
corrected, and on two feet: these give no moment about the line between them, so position or
attitude is off until the next foot lands, and integrating that only excites the robot. Trots whose
trunk rolled by 26 deg went 0.4 m aside by it, and fell.

A payload is estimated only after a while; until then the correction holds it. Once the payload is
known, its part is removed from the correction at once. The integral alone would need half a second
for that, in which a robot that had just stood up with 4 kg 8 cm aside leaned by 6 deg.

Solved plans on one or two feet are tracked with their own feedback. On two feet the force that
moves the CoM also turns the trunk, since the ground gives no moment about the line between them.
Separate gains for position and attitude then lose one of the two, and the robot falls over in the
end. The plan's own gains, from the Riccati equation along it, couple all errors by how they will
grow (Mastalli et al. 2022).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.linear import rotation_vector
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.contacts import TIE
from go2_wbc.motion_plan import Footsteps, PlanFeedback
from go2_wbc.planning.trunk import (
    ANGLE_LIMIT,
    ANGLE_WINDOW,
    POSITION_LIMIT,
    POSITION_WINDOW,
    RATE,
    integrated,
    turn_by,
)
from go2_wbc.records import Array3, Array6, Record, packed
from go2_wbc.reference import JOINTS, STANCE, Anchor, Reference, Target, TrackedPoint, sag_and_lean
from go2_wbc.robot.rotations import log_rotation, rotation_from_quaternion, yaw_rotation
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.foot_placement import place_feet
from go2_wbc.tracking.landing import Landing, Landings, land
from go2_wbc.tracking.plan_curves import StanceLoad
from go2_wbc.tracking.trunk_firmness import hold_firmly

FIRM_AFTER = 0.15
"""Time [s] on three feet or more after which the trunk is no longer held as in a stride: a trot
stands on four between its steps."""
PAIR = 2  #: Feet that hold a trunk along the line between them, and not across it
HEIGHT_PER_WEIGHT = 0.00055
"""Correction [m/N] that a payload's weight takes; this and the next two as found with 2 to 6 kg, up
to 15 cm beside the middle."""
ROLL_PER_MOMENT, PITCH_PER_MOMENT = 0.08, 0.0085
"""The same of its moment about the axis ahead and the one aside [rad/(N m)]."""


@dataclass(frozen=True, slots=True)
class Deviation:
    """How far a robot has been off its plan, on the average over the ticks so far."""

    place: float  #: of the tracked point [m]
    attitude: float  #: angle of the trunk [rad]
    joints: float | None
    """Angle [rad] of the worst joint of a raised leg, over the ticks that had one; None if there
    was none."""


class Correction(Record):
    """What has been integrated."""

    offset: Array6  #: of the reference: position [m] and rotation vector [rad], in the world
    carried: Array3
    """What the offset would have to do against the payload that is known, in the heading frame:
    upward [m], about the axis ahead and the one aside [rad]."""
    knows_payload: bool  #: whether ``carried`` has been found yet
    friction: Array6  #: what is learned of it, see ``trunk_firmness``
    held: float  #: for how long more than two feet have stood [s]
    is_firm: bool  #: whether the trunk is held firmly then


class Tracking(Record):
    """State of a plan that is followed."""

    landing: Landing  #: where the plan is, and its feet
    correction: Correction  #: of the trunk's target
    place: float  #: see ``Deviation``, as for the next two
    attitude: float
    joints: float
    ticks: float  #: how many there have been
    raised_ticks: float  #: how many of them with a raised leg
    sag: float  #: depth [m] of the tracked point below the plan, now
    lean: float  #: angle [rad] between the measured vertical of the trunk and the plan's, now


class PlanTracker:
    """Turns a plan's references, one a tick, into what is tracked in the world."""

    def __init__(
        self, anchor: Anchor, footsteps: Footsteps | None = None, *, is_firm: bool = False
    ) -> None:
        """Follow a plan at ``anchor``, without correction at first; ``is_firm``: the trunk too."""
        self._state = Tracking(landing=Landing.at(anchor))
        self._state.correction.is_firm = is_firm
        self._events, self._changes, self._load = np.zeros(0), np.zeros((0, 4, 3)), _NO_LOAD
        if footsteps is not None:
            contacts, steps = footsteps.contacts, footsteps
            self._events = np.array(contacts.times)
            self._changes = np.stack([contacts.since, contacts.until, steps.unloads], axis=-1)
            self._load = StanceLoad(steps.ramp, steps.normal_force_min, steps.normal_force_max)
        self._load = packed(self._load)

    def track(self, plan: Target, snapshot: Snapshot, t: float, dt: float) -> Reference:
        """The reference in the world.

        Args:
            plan: what it asks for, in the motion's frame (``MotionPlan.row_at``).
            snapshot: of this tick.
            t: seconds from the plan's start at which it stands there.
            dt: seconds since the last tick.
        """
        target, contact = Target.of(plan.row.copy()), snapshot.state.feet_in_contact
        steps = contact, self._events, self._changes, self._load
        follow(snapshot, t, dt, *steps, self._state, target)
        return Reference.of_row(target.row)

    def follow_ground(self, snapshot: Snapshot, share: float) -> None:
        """Move the plan by this share of the way to the mean height of the feet."""
        p_world = self._state.landing.anchor.p_world
        height = float(snapshot.p_world_feet[:, 2].mean()) - snapshot.foot_radius
        p_world[2] += share * (height - p_world[2])

    @property
    def anchor(self) -> Anchor:
        """Where the plan is now: landings move it."""
        anchor = self._state.landing.anchor
        return Anchor(anchor.p_world.copy(), float(anchor.yaw))

    @property
    def landings(self) -> Landings:
        """What came of the landings of feet that step."""
        landing = self._state.landing
        return Landings(int(landing.missed), float(landing.error) or None)

    @property
    def deviation(self) -> Deviation:
        """How far the robot has been off the plan, the correction left out."""
        s = self._state
        joints = float(s.joints) if s.raised_ticks else None
        return Deviation(float(s.place), float(s.attitude), joints)

    @property
    def sag_and_lean(self) -> tuple[float, float]:
        """Now: depth [m] of the tracked point below the plan, and angle [rad] of the verticals."""
        return float(self._state.sag), float(self._state.lean)


_NO_LOAD = StanceLoad(0.0, 0.0, 0.0)


@kernel
def follow(
    now: Snapshot,
    t: float,
    dt: float,
    contact: Foreign[Bool[np.ndarray, "4"]],
    events: Foreign[Float[np.ndarray, " m"]],
    changes: Foreign[Float[np.ndarray, "m 4 3"]],
    load: StanceLoad,
    s: Tracking,
    target: Target,
) -> None:
    """Change ``target``, a plan's in its frame, to what is tracked in the world.

    ``t``: how far into the plan; ``dt``: since the last tick; ``contact``: feet with a measured
    contact. ``events``, ``changes``: those of ``land``, none for a plan whose feet do not step.
    """
    place(s.landing.anchor, target)
    if len(events) > 0:
        land(t, contact, events, changes, load, now, s.landing, target)
    error = np.empty(6)
    compare(now, target, error)
    note(now, error, s, target)
    place_feet(now, error, target)
    is_held = standing_feet(target) > PAIR
    correct(now, error, dt if is_held else 0.0, s.correction, target)
    c = s.correction
    c.held = c.held + dt if is_held else 0.0
    is_solved = target.force_weight != 0.0  # with forces of its own
    if c.is_firm and not is_solved:
        in_stride = c.held < FIRM_AFTER
        lead = hold_firmly(now, error, c.offset, dt, c.friction, target, in_stride)
        for i in range(3):
            target.p_world[i] += lead[i]
        turn_by((lead[3], lead[4], lead[5]), target.R_world_base)


@subroutine
def place(anchor: Anchor, target: Target) -> None:
    """Turn a plan's target by the anchor's yaw, and move it to its place in the world."""
    c, s = np.cos(anchor.yaw), np.sin(anchor.yaw)
    R = target.R_world_base
    for k in range(3):  # columns of the attitude
        x, y = R[0, k], R[1, k]
        R[0, k], R[1, k] = c * x - s * y, s * x + c * y
    turn(c, s, target.p_world)
    turn(c, s, target.v_world)
    turn(c, s, target.a_world)
    turn(c, s, target.w_world)
    turn(c, s, target.dw_world)
    for leg in range(4):
        turn(c, s, target.p_world_feet[leg])
        turn(c, s, target.v_world_feet[leg])
        turn(c, s, target.a_world_feet[leg])
        turn(c, s, target.f_world_feet[leg])
    for i in range(3):
        target.p_world[i] += anchor.p_world[i]
        for leg in range(4):
            target.p_world_feet[leg, i] += anchor.p_world[i]


@subroutine
def turn(c: float, s: float, a: Float[np.ndarray, "3"]) -> None:
    """Turn a vector about z by the angle of this cosine and sine."""
    a[0], a[1] = c * a[0] - s * a[1], s * a[0] + c * a[1]


@subroutine
def compare(now: Snapshot, target: Target, error: Float[np.ndarray, "6"]) -> None:
    """Fill position [m] and rotation vector [rad] from where the trunk is to where it shall be."""
    R, wanted, left = now.R_world_base, target.R_world_base, np.empty((3, 3))
    for i in range(3):
        error[i] = target.p_world[i] - (now.p_world_com[i] if target.is_com else now.q[i])
        for k in range(3):
            left[i, k] = wanted[i, 0] * R[k, 0] + wanted[i, 1] * R[k, 1] + wanted[i, 2] * R[k, 2]
    error[3], error[4], error[5] = rotation_vector(left)


@subroutine
def note(now: Snapshot, error: Float[np.ndarray, "6"], s: Tracking, target: Target) -> None:
    """Bring what is told of how far the robot is off its plan up to this tick."""
    s.sag, s.lean = sag_and_lean(target, now)
    s.ticks += 1.0
    off = np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    s.place += (off - s.place) / s.ticks
    off = np.sqrt(error[3] ** 2 + error[4] ** 2 + error[5] ** 2)
    s.attitude += (off - s.attitude) / s.ticks
    worst, is_raised = 0.0, False
    for leg in range(4):
        if target.legs[leg] == JOINTS:
            is_raised = True
            for n in range(3 * leg, 3 * leg + 3):
                worst = max(worst, abs(target.q_joints[n] - now.q[7 + n]))
    if is_raised:
        s.raised_ticks += 1.0
        s.joints += (worst - s.joints) / s.raised_ticks


@subroutine
def standing_feet(target: Target) -> int:
    """How many feet stand."""
    count = 0
    for leg in range(4):
        if target.legs[leg] == STANCE:
            count += 1
    return count


@subroutine
def correct(now: Snapshot, error: Array6, dt: float, s: Correction, target: Target) -> None:
    """Put the correction into the body's target, after ``dt`` seconds of ``error``.

    ``error``: of the target less what is measured: position [m] and rotation vector [rad].
    """
    hand_over(now, s)
    for i in range(3):
        at, k = s.offset[i], 3 + i
        s.offset[i] = integrated(at, error[i], dt, RATE, POSITION_WINDOW, POSITION_LIMIT)
        s.offset[k] = integrated(s.offset[k], error[k], dt, RATE, ANGLE_WINDOW, ANGLE_LIMIT)
        target.p_world[i] += s.offset[i]
    turn_by((s.offset[3], s.offset[4], s.offset[5]), target.R_world_base)


@subroutine
def hand_over(now: Snapshot, s: Correction) -> None:
    """Take out of the offset what is known of the payload since the last tick."""
    mass, weight = now.payload[0], now.payload[1]
    gravity = weight / mass if mass > 0.0 else 0.0
    x, y = now.R_world_base[0, 0], now.R_world_base[1, 0]
    length = max(np.hypot(x, y), TIE)
    cosine, sine = x / length, y / length
    moment = now.mass_matrix[0, 0] * gravity
    x, y = moment * now.com_shift[0], moment * now.com_shift[1]
    load = (
        HEIGHT_PER_WEIGHT * weight,
        ROLL_PER_MOMENT * (cosine * y - sine * x),
        -PITCH_PER_MOMENT * (cosine * x + sine * y),
    )
    change = np.zeros(3)
    for i in range(3):
        if s.knows_payload:
            change[i] = load[i] - s.carried[i]
        s.carried[i] = load[i]
    s.knows_payload = True
    about_x, about_y = change[1], change[2]
    change[1], change[2] = cosine * about_x - sine * about_y, sine * about_x + cosine * about_y
    for i in range(3):
        held = s.offset[2 + i]
        s.offset[2 + i] -= max(min(change[i], max(held, 0.0)), min(held, 0.0))


def tracked_position(snapshot: Snapshot, point: TrackedPoint) -> Array3:
    """Measured position [m] of ``point`` in the world."""
    return snapshot.p_world_com if point is TrackedPoint.COM else snapshot.state.p_world_base


MOST_FEET = 2  #: Standing feet up to which the feedback is the plan's; more can give any moment


def fed_back(
    reference: Reference, feedback: PlanFeedback, anchor: Anchor, snapshot: Snapshot
) -> Reference:
    """``reference`` with the accelerations of the trunk that the plan's gains ask for.

    They take the place of the controller's own feedback of the trunk, whose errors are none then;
    legs in the air stay on their way.

    Args:
        reference: of a solved plan, which tracks the CoM, in the world.
        feedback: in the motion's frame.
        anchor: where the motion takes place.
    """
    if not 1 <= reference.stance.sum() <= MOST_FEET:
        return reference
    tau = -feedback.gains @ state_error(feedback, anchor, snapshot)
    a = acceleration_of(tau, reference, snapshot)
    body, R = reference.body, snapshot.R_world_base
    target = replace(
        body,
        p_world=snapshot.p_world_com,
        v_world=snapshot.v_world_com,
        a_world=body.a_world + snapshot.J_com @ a,
        R_world_base=R,
        w_world=R @ snapshot.state.v[3:6],
        dw_world=body.dw_world + R @ a[3:6],
    )
    return replace(reference, body=target)


def state_error(
    feedback: PlanFeedback, anchor: Anchor, snapshot: Snapshot
) -> Float[np.ndarray, "36"]:
    """Measured less planned configuration and velocity, to first order as Pinocchio's."""
    turn, q, state = yaw_rotation(anchor.yaw), feedback.q, snapshot.state
    R = turn @ rotation_from_quaternion(q[3:7])
    p = anchor.p_world + turn @ q[:3]
    return np.concatenate(
        [
            R.T @ (state.q[:3] - p),
            log_rotation(R.T @ snapshot.R_world_base),
            state.q[7:] - q[7:],
            state.v - feedback.v,
        ]
    )


def acceleration_of(
    tau: Float[np.ndarray, "12"], reference: Reference, snapshot: Snapshot
) -> Float[np.ndarray, "18"]:
    """What joint torques ``tau`` [N m] add to the accelerations while the stance feet stay.

    M a - J' f = S' tau, J a = 0.
    """
    J = snapshot.J_contacts[reference.stance].reshape(-1, 18)
    count = len(J)
    system = np.block([[snapshot.mass_matrix, -J.T], [J, -_COMPLIANCE * np.eye(count)]])
    wanted = np.concatenate([np.zeros(6), tau, np.zeros(count)])
    return np.linalg.solve(system, wanted)[:18]


_COMPLIANCE = 1e-9
"""Of the contacts [m/s^2/N]: a leg that is stretched out leaves the system regular."""
