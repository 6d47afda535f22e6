"""One motion played in MuJoCo, and what was measured: slip, loads, distance from its plan."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.written_motion import STRIDE, off_written, placed, trunk_off, turned_off
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant.mujoco.ground_truth import TOUCH, GroundTruth, TruthRecording, true_runs
from go2_wbc.reference import STANCE, Anchor, LegTask, Target
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places
from go2_wbc.robot.model import RobotModel

HALF_LENGTH = 0.2
"""Distance [m] from the trunk's middle to its ends: what a wrong attitude moves."""
FULL = 0.999
"""Share of a torque limit from which on a motor gives all it has."""
SETTLED_CONTACT = 0.1
"""Time [s] after a touchdown, and before a lift-off, in which an unloaded foot may skid."""

OF_FEET = ("feet_off", "paw_off", "landed_off")
"""What is measured of feet that were raised or came down: 0 to the last bit if there were none."""


@dataclass(frozen=True, slots=True)
class MotionMeasurement:
    """What was measured while a motion was played.

    Attributes:
        fall: why the robot fell, or went limp because it fell, or None.
        said: what ``play`` said.
        reason: in its words.
        slip: largest distance [m] that the material of a standing foot slid at its contact point.
        torque, speed: largest share of a joint's torque and speed limit.
        saturated: time [s] in which some motor gave all it has.
        tracking: largest distance [m] of the CoM from its plan.
        ends_off: largest distance [m] of the trunk's ends from their plan, seen from its middle.
        feet_off: largest distance [m] of a raised foot from its plan, seen from the trunk.
        joint_distance: least distance [rad] of a joint to its limit.
        stopped: time [s] in which a joint pressed against the stop at its limit.
        touched: time [s] in which a knee or the trunk touched the ground, or a link another.
        trunk_off: largest distance [m] of the trunk from what was written.
        turned_off: largest angle [rad] of the trunk from what was written.
        paw_off: largest distance [m] of a foot in the air from its place in the world.
        landed_off: largest distance [m] of a foot that came down from its place.

    The last four count from where the robot stood at first, and where a part is solved, from where
    it stood then: at the ends of its phases, what was asked there.
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
    stopped: float
    touched: float
    trunk_off: float
    turned_off: float
    paw_off: float
    landed_off: float

    @property
    def ok(self) -> bool:
        """Whether it was done, and the robot is on its feet."""
        return self.said and self.fall is None

    def lines(self) -> list[tuple[str, str, str]]:
        """What was measured: name, value and unit, for a person."""
        return [
            ("CoM off its plan, at most", f"{1000 * self.tracking:.1f}", "mm"),
            ("slip of a standing foot, at most", f"{1000 * self.slip:.1f}", "mm"),
            ("peak joint torque, of its limit", f"{100 * self.torque:.0f}", "%"),
            ("peak joint speed, of its limit", f"{100 * self.speed:.0f}", "%"),
            ("least distance of a joint to its limit", f"{self.joint_distance:.3f}", "rad"),
        ]

    def as_dict(self) -> dict[str, float | bool | str | None]:
        """Plain values, for JSON; None where no foot was raised or came down to be compared."""
        feet = {name: getattr(self, name) or None for name in OF_FEET}
        return {"ok": self.ok, **asdict(self), **feet}


def measure_motion(
    go2: GO2Controller, truth: GroundTruth, plan: MotionPlan, model: RobotModel
) -> MotionMeasurement:
    """Play ``plan``, unchecked, on a robot that is in its entry posture.

    Args:
        go2: the controller, whose plant is ``truth``.
        truth: cleared before the motion.
        plan: the motion.
        model: of the robot, for its limits.
    """
    truth.clear()
    said = go2.play(plan, check=False)
    fall, dt = truth.fall() or _given_up(go2), truth.control_period
    recorded = during_motion(go2, truth, plan.name)
    shares = recorded.torque_shares(model)
    force = np.maximum(recorded.trunk_force, recorded.limb_force)
    com, attitude, feet = _off_plan(recorded, plan, model)
    trunk, turned, paw, landed = off_written(recorded, plan, model).tolist()
    return MotionMeasurement(
        fall=fall,
        said=said,
        reason=go2.last_outcome.reason,
        slip=_slip(recorded, plan, dt),
        torque=float(shares.max()),
        speed=recorded.peak_speed_share(model),
        saturated=dt * float((shares >= FULL).sum()),
        tracking=com,
        ends_off=HALF_LENGTH * attitude,
        feet_off=feet,
        joint_distance=recorded.joint_distance(model),
        stopped=dt * float((recorded.joint_distances(model) <= 0.0).sum()),
        touched=dt * float((recorded.touches_itself | (force > TOUCH)).sum()),
        trunk_off=trunk,
        turned_off=turned,
        paw_off=paw,
        landed_off=landed,
    )


def _given_up(go2: GO2Controller) -> str | None:
    """Why the controller let the robot go limp, or None.

    It does so as soon as a fall cannot be stopped, and ``play`` returns before the trunk lies on
    the ground: what the simulator says at that moment is no proof that the robot is up.
    """
    return go2.last_outcome.reason if go2.mode in (Mode.FALLEN, Mode.DAMPED) else None


def during_motion(go2: GO2Controller, truth: GroundTruth, name: str) -> TruthRecording:
    """The ticks in which the plan was played."""
    ticks = go2.telemetry.samples(1.0 / truth.control_period, since=truth.start).unfinished
    recorded, times = truth.recording(), ticks.time[np.array(ticks.labels) == name]
    if len(times) == 0:
        return recorded
    first, last = np.searchsorted(recorded.time, [times[0], times[-1] + 1e-9])
    return recorded.part(slice(int(first), max(int(last), int(first) + 2)))


def _slip(recorded: TruthRecording, plan: MotionPlan, dt: float) -> float:
    """Largest distance [m] slid in a stance phase, less its edges inside of the motion."""
    start, n = float(recorded.time[0]), len(recorded.time)
    rows = [plan.row_at(t) for t in (recorded.time - start).tolist()]
    stance = np.array([Target.of(row).legs for row in rows]) == STANCE
    margin, worst = round(SETTLED_CONTACT / dt), 0.0
    for leg in LEGS:
        for phase in true_runs(stance[:, leg]):
            first = phase.start + (margin if phase.start > 0 else 0)
            last = phase.stop - (margin if phase.stop < n else 0)
            path = np.cumsum(dt * recorded.v_world_contacts[first : max(first, last), leg], axis=0)
            worst = max(worst, float(np.linalg.norm(path, axis=1).max(initial=0.0)))
    return worst


def _off_plan(
    recorded: TruthRecording, plan: MotionPlan, model: RobotModel
) -> tuple[float, float, float]:
    """Largest deviations from the plan: CoM [m], attitude [rad], raised feet [m]."""
    anchor = Anchor.of_feet(recorded.p_world_feet[0].copy(), model.foot_radius)
    truth = recorded.part(slice(None, None, STRIDE))
    asked = placed(plan, truth.time - recorded.time[0], anchor)
    raised, feet = asked["legs"] == LegTask.JOINTS, 0.0
    for leg in LEGS:
        rows, geometry = raised[:, leg], LegGeometry.of(model, leg)
        real, planned = truth.q[rows, 7:][:, leg.joints], asked["q_joints"][rows][:, leg.joints]
        off = foot_places(geometry, real) - foot_places(geometry, planned)
        feet = max(feet, float(np.linalg.norm(off, axis=1).max(initial=0.0)))
    return float(trunk_off(asked, truth).max()), float(turned_off(asked, truth).max()), feet
