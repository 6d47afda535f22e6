"""One motion played in MuJoCo, and what physics made of it."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Float

from controller.bench.trials import Subject
from controller.bench.witness import Track
from go2_wbc.legs import LEGS
from go2_wbc.reference import Anchor, MotionPlan
from go2_wbc.robot.model import RobotModel

TRACKING_STRIDE = 5
"""Every fifth tick is compared with the plan."""
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
        tracking: largest distance [m] of the CoM from its plan.
        joint_distance: least distance [rad] of a joint to its limit.
    """

    fall: str | None
    said: bool
    reason: str
    slip: float
    torque: float
    speed: float
    tracking: float
    joint_distance: float

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
    robot.witness.clear()
    said = robot.go2.play(plan, check=False)
    fall = robot.witness.fall()
    track = _of_motion(robot, plan)
    q = track.q[:, 7:]
    return MotionRun(
        fall=fall,
        said=said,
        reason=robot.go2.last_outcome.reason,
        slip=_slip(track, plan),
        torque=float((np.abs(track.tau) / model.torque_limits).max()),
        speed=float((np.abs(track.v[:, 6:]) / model.speed_limits).max()),
        tracking=_tracking(track, plan, model.foot_radius),
        joint_distance=float(np.minimum(q - model.q_lower, model.q_upper - q).min()),
    )


def _of_motion(robot: Subject, plan: MotionPlan) -> Track:
    """The ticks in which the plan was played."""
    recording = robot.go2.recording(rate=1.0 / robot.plant.control_period)
    track = robot.witness.track()
    times = recording.time[np.array(recording.labels) == plan.name]
    times = times[times >= robot.witness.start]
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


def _tracking(track: Track, plan: MotionPlan, foot_radius: float) -> float:
    anchor = Anchor.of_feet(track.p_world_feet[0].copy(), foot_radius)
    start, worst = float(track.time[0]), 0.0
    for row in range(0, len(track.time), TRACKING_STRIDE):
        body = plan.at(float(track.time[row]) - start).placed(anchor).body
        worst = max(worst, _distance(track.p_world_com[row], body.p_world))
    return worst


def _distance(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> float:
    return float(np.linalg.norm(a - b))
