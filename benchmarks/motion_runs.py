"""One motion played in MuJoCo, and what physics made of it."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.ground_truth import Track
from benchmarks.trials import Subject
from go2_wbc.legs import LEGS
from go2_wbc.reference import Anchor, LegTask, MotionPlan, TrackedPoint
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy

TRACKING_STRIDE = 5
"""Every fifth tick is compared with the plan."""
HALF_LENGTH = 0.2
"""Distance [m] from the trunk's middle to its ends: what a wrong attitude moves."""
FULL = 0.999
"""Share of a torque limit from which on a motor gives all it has."""
TOUCH = 1.0
"""Force [N] on a knee or the trunk that counts as a touch."""
SETTLED_CONTACT = 0.1
"""Time [s] after a touchdown, and before a lift-off, in which an unloaded foot may skid."""


@dataclass(frozen=True, slots=True)
class MotionRun:
    """What came of a motion.

    Attributes:
        fall: why the robot fell, or None.
        said: what ``play`` said.
        reason: in its words.
        slip: largest distance [m] that the material of a standing foot slid at its contact point.
        torque, speed: largest share of a joint's torque and speed limit.
        saturated: time [s] in which some motor gave all it has.
        tracking: largest distance [m] of the CoM from its plan.
        ends_off: largest distance [m] of the trunk's ends from their plan, seen from its middle.
        feet_off: largest distance [m] of a raised foot from its plan, seen from the trunk.
        joint_distance: least distance [rad] of a joint to its limit.
        touched: time [s] in which a knee or the trunk touched the ground, or a link another.
    """

    fall: str | None
    said: bool
    reason: str
    slip: float
    torque: float
    speed: float
    saturated: float
    tracking: float
    ends_off: float
    feet_off: float
    joint_distance: float
    touched: float

    @property
    def ok(self) -> bool:
        """Whether it was done, and the robot is on its feet."""
        return self.said and self.fall is None

    def figures(self) -> list[tuple[str, str, str]]:
        """What was measured: name, value and unit, for a person."""
        return [
            ("CoM off its plan, at most", f"{1000 * self.tracking:.1f}", "mm"),
            ("slip of a standing foot, at most", f"{1000 * self.slip:.1f}", "mm"),
            ("peak joint torque, of its limit", f"{100 * self.torque:.0f}", "%"),
            ("peak joint speed, of its limit", f"{100 * self.speed:.0f}", "%"),
            ("least distance of a joint to its limit", f"{self.joint_distance:.3f}", "rad"),
        ]

    def as_dict(self) -> dict[str, float | bool | str | None]:
        """Plain values, for JSON."""
        return {"ok": self.ok, **asdict(self)}


def run_motion(robot: Subject, plan: MotionPlan, model: RobotModel) -> MotionRun:
    """Play ``plan`` on a standing robot, unchecked."""
    robot.truth.clear()
    said = robot.go2.play(plan, check=False)
    fall = robot.truth.fall()
    track = _of_motion(robot, plan)
    q, dt = track.q[:, 7:], robot.plant.control_period
    shares = (np.abs(track.tau) / model.torque_limits).max(axis=1)
    touched = track.touches_itself | (np.maximum(track.trunk_force, track.limb_force) > TOUCH)
    off = _off_plan(track, plan, model)
    return MotionRun(
        fall=fall,
        said=said,
        reason=robot.go2.last_outcome.reason,
        slip=_slip(track, plan),
        torque=float(shares.max()),
        speed=float((np.abs(track.v[:, 6:]) / model.speed_limits).max()),
        saturated=dt * float((shares >= FULL).sum()),
        tracking=off.com,
        ends_off=HALF_LENGTH * off.attitude,
        feet_off=off.feet,
        joint_distance=float(np.minimum(q - model.q_lower, model.q_upper - q).min()),
        touched=dt * float(touched.sum()),
    )


def _of_motion(robot: Subject, plan: MotionPlan) -> Track:
    """The ticks in which the plan was played."""
    recording = robot.go2.recording(rate=1.0 / robot.plant.control_period)
    track = robot.truth.track()
    times = recording.time[np.array(recording.labels) == plan.name]
    times = times[times >= robot.truth.start]
    if len(times) == 0:
        return track
    first, last = np.searchsorted(track.time, [times[0], times[-1] + 1e-9])
    return track.part(slice(int(first), max(int(last), int(first) + 2)))


def _slip(track: Track, plan: MotionPlan) -> float:
    start = float(track.time[0])
    stance = np.array([plan.at(float(t) - start).stance for t in track.time])
    dt = float(np.median(np.diff(track.time)))
    margin = round(SETTLED_CONTACT / dt)
    worst = 0.0
    for leg in LEGS:
        for rows in _runs(stance[:, leg], margin):
            steps = dt * track.v_world_contacts[rows, leg]
            path = np.cumsum(steps, axis=0)
            worst = max(worst, float(np.linalg.norm(path, axis=1).max(initial=0.0)))
    return worst


def _runs(flags: np.ndarray, margin: int) -> list[slice]:
    """Where ``flags`` is true, less ``margin`` rows at every inner edge."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    runs = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        first = start + (margin if start > 0 else 0)
        last = end - (margin if end < len(flags) else 0)
        if last > first:
            runs.append(slice(int(first), int(last)))
    return runs


@dataclass(frozen=True, slots=True)
class _OffPlan:
    """Largest deviations: CoM [m], attitude [rad], raised feet [m]."""

    com: float
    attitude: float
    feet: float


def _off_plan(track: Track, plan: MotionPlan, model: RobotModel) -> _OffPlan:
    anchor = Anchor.of_feet(track.p_world_feet[0].copy(), model.foot_radius)
    start, worst = float(track.time[0]), np.zeros(3)
    legs = [LegGeometry.of(model, leg) for leg in LEGS]
    for row in range(0, len(track.time), TRACKING_STRIDE):
        reference = plan.at(float(track.time[row]) - start).placed(anchor)
        body, q = reference.body, track.q[row]
        R = rotation_from_rpy(*track.rpy[row].tolist())
        point = track.p_world_com[row] if body.point is TrackedPoint.COM else q[:3]
        joints = np.vstack([q[7:], reference.q_joints])
        feet = [
            _distance(*foot_places(legs[leg], joints[:, leg.joints]))
            for leg in LEGS
            if reference.legs[leg] is LegTask.JOINTS
        ]
        turned = float(np.linalg.norm(log_rotation(body.R_world_base @ R.T)))
        worst = np.maximum(worst, [_distance(point, body.p_world), turned, max(feet, default=0.0)])
    return _OffPlan(*worst.tolist())


def _distance(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> float:
    return float(np.linalg.norm(a - b))
