"""What a dynamic plan must keep, and what it breaks, measured on the plan itself.

Nothing here trusts the solver: the defects are those of the equations of motion at every knot, by
Pinocchio's inverse dynamics.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS
from go2_wbc.robot.model import RobotModel
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, SHARE, ranged
from motions.dynamics.dynamic_trajectory import DynamicTrajectory, feet_at

SOFT = 0.1  #: Share of the costs with which a start begins; see ``Weights.softened``


@dataclass(frozen=True, slots=True)
@ranged(
    SHARE,
    friction=POSITIVE,
    force_max=POSITIVE,
    joint_margin=NOT_NEGATIVE,
    knee_height=NOT_NEGATIVE,
    clearance=NOT_NEGATIVE,
)
class PlanLimits:
    """What every plan keeps."""

    torque_share: float = 0.85
    """Share of the motors' torque; the rest is the controller's, for feedback."""
    end_share: float = 0.95
    """The same at the speed that a joint has at the end of a step, through which its torque holds.

    It is reached for an instant only, so less is left; the friction of the joints takes 8 % there.
    Bounded by the speed in the middle alone, motors at take-off gave all they have for up to 10 ms
    of each of the last steps.
    """
    friction: float = 0.5
    """Coefficient of the cone, whose facets are inside it; less than the controller's 0.6."""
    force_max: float = 160.0
    """Normal force [N] of a foot. It costs no height and tames a push-off that would otherwise end
    in one knot of 900 N (own experiments)."""
    speed_share: float = 0.85  #: of the joints' speed limit
    joint_margin: float = 0.03  #: distance [rad] from the joints' position limits
    knee_height: float = 0.09  #: least height [m] of the knees' axes
    clearance: float = 0.02  #: height [m] that a foot in the air keeps, once it is under way


@dataclass(frozen=True, slots=True)
class Weights:
    """Costs per squared unit and second, or at a knot where that is said (own experiments)."""

    torque: float = 1e-3  #: [1/(N m)^2], of the difference from standing
    friction: float = 1.0  #: of forces outside the cone or above ``force_max`` [1/N^2]
    joint_range: float = 2e3  #: beyond the limits [1/rad^2]
    joint_speed: float = 50.0  #: likewise [s^2/rad^2]
    ground: float = 1e4  #: of a foot or knee below its height [1/m^2]
    clearance: float = 2e4  #: of a foot below its clearance [1/m^2]
    foot_place: float = 2e4  #: of a foot at touchdown or in its place, at one knot
    foot_speed: float = 50.0  #: likewise
    trunk: float = 2e3  #: of the trunk at the end of a phase [1/m^2, 1/rad^2], at one knot
    end: float = 1e3  #: of the last state, at one knot
    posture: float = 0.1  #: of joints against the path of the first guess [1/rad^2]
    speed: float = 0.01  #: of all velocities
    track: float = 0.0
    """Of the trunk against the path of the first guess [1/m^2, 1/rad^2]: nothing, unless that path
    is what is asked."""

    def softened(self) -> Weights:
        """The same with everything but effort at a tenth, for a rough guess.

        From one, the full costs are so steep that solving takes five times the iterations, if it
        converges at all (own experiments).
        """
        eased = {
            part.name: SOFT * getattr(self, part.name)
            for part in fields(self)
            if part.name not in ("torque", "posture", "speed", "track")
        }
        return replace(self, **eased)


_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True, slots=True)
class Reading:
    """The worst of one quantity over a plan."""

    name: str  #: of the quantity
    value: float  #: the worst
    limit: float  #: what it must not exceed, at least 0
    unit: str  #: of both
    subject: str  #: whose it is
    time: float  #: when [s]

    @property
    def is_kept(self) -> bool:
        """Whether the limit is kept."""
        return self.value <= self.limit

    def __str__(self) -> str:
        return (
            f"{self.name} of {self.subject} at {self.time:.2f} s: {abs(self.value):.3g}"
            f"{self.unit and f' {self.unit}'}, at most {self.limit:.3g}"
        )


DEFECT = 1e-3  #: What is left of the equations of motion [N, N m], at most
FRICTION = 0.55  #: Tangential over normal force
PULL = 1.0  #: Of the ground [N]
PENETRATION = 0.005  #: Of a foot in the air into the ground [m]
SLIP = 0.02  #: Of a standing foot, from where it touched down [m]
TOUCHDOWN = 1.0  #: Speed of a foot [m/s]
ROTATION = 0.2  #: Difference [rad] between the integrated rate and the change of attitude


def audit(plan: DynamicTrajectory, model: RobotModel) -> tuple[Reading, ...]:
    """The worst of everything that a plan must keep."""

    def worst(
        name: str,
        values: Float[np.ndarray, "n k"],
        limit: float,
        unit: str,
        subjects: tuple[str, ...],
    ) -> Reading:
        row, column = np.unravel_index(int(np.argmax(values)), values.shape)
        time = float(plan.times[row])
        return Reading(name, float(values[row, column]), limit, unit, subjects[column], time)

    ends = plan.v[:-1, 6:], plan.v[1:, 6:]  # a torque holds through its step
    tau_share = np.max([model.motor.share(plan.tau, v) for v in ends], axis=0)
    joints = plan.q[:, 7:]
    beyond = np.maximum(model.q_lower - joints, joints - model.q_upper)
    normal = plan.forces[:, :, 2]
    tangential = np.hypot(plan.forces[:, :, 0], plan.forces[:, :, 1])
    ratio = np.where(normal > 1.0, tangential / np.maximum(normal, 1.0), 0.0)
    speed = np.abs(plan.v[:, 6:]) / model.speed_limits
    slip = drift(plan.p_feet, plan.stance)
    feet, names = FOOT_NAMES, JOINT_NAMES
    return (
        worst("defect", defects(plan, model), DEFECT, "N or N m", _ROWS),
        worst("friction", ratio, FRICTION, "", feet),
        worst("pull of the ground", -normal, PULL, "N", feet),
        worst("torque share", tau_share, 1.0, "", names),
        worst("speed share", speed, 1.0, "", names),
        worst("angle beyond its limit", beyond, 0.0, "rad", names),
        worst("depth under ground", _depth(plan, model), PENETRATION, "m", feet),
        worst("slip", slip, SLIP, "m", feet),
        worst("touchdown speed", _touchdown(plan, model), TOUCHDOWN, "m/s", feet),
        Reading("integrated rotation", _lost_turn(plan), ROTATION, "rad", "trunk", plan.duration),
    )


def _depth(plan: DynamicTrajectory, model: RobotModel) -> Float[np.ndarray, "n1 4"]:
    """Of the feet in the air; one that stands in a step does so until the step's end."""
    stance = plan.stance
    stands = np.vstack([stance, stance[-1:]]) | np.vstack([stance[:1], stance])
    return np.where(stands, 0.0, model.foot_radius - plan.p_feet[:, :, 2])


def drift(
    p_feet: Float[np.ndarray, "n1 4 3"], stance: Bool[np.ndarray, "n 4"]
) -> Float[np.ndarray, "n1 4"]:
    """Distance [m] of each standing foot from where it came down; 0 in the air."""
    off = np.zeros(p_feet.shape[:2])
    for leg in LEGS:
        place = p_feet[0, leg]
        for row, stands in enumerate(stance[:, leg].tolist(), start=1):
            if stands:
                off[row, leg] = np.linalg.norm(p_feet[row, leg] - place)
            else:
                place = p_feet[row, leg]
    return off


def _touchdown(plan: DynamicTrajectory, model: RobotModel) -> Float[np.ndarray, "n1 4"]:
    speeds = np.linalg.norm(feet_at(plan.q, plan.v, model)[1], axis=2)
    lands = np.zeros(speeds.shape, dtype=bool)
    lands[1:-1] = plan.stance[1:] & ~plan.stance[:-1]
    return np.where(lands, speeds, 0.0)


def _lost_turn(plan: DynamicTrajectory) -> float:
    """A turn by 360 deg looks like none; the integrated yaw and tilt rates tell them apart."""
    R, worst = pin.Quaternion(plan.q[0, 3:7]).toRotationMatrix(), 0.0
    for row, dt in enumerate(np.diff(plan.times)):
        R = R @ pin.exp3(plan.v[row + 1, 3:6] * dt)
        measured = pin.Quaternion(plan.q[row + 1, 3:7]).toRotationMatrix()
        worst = max(worst, float(np.linalg.norm(pin.log3(R.T @ measured))))
    return worst


_ROWS = (*(f"trunk {axis}" for axis in ("x", "y", "z", "roll", "pitch", "yaw")), *JOINT_NAMES)


def defects(plan: DynamicTrajectory, model: RobotModel) -> Float[np.ndarray, "n 18"]:
    """|M a + h - S' tau - J' f| of every knot [N, N m], with a from the velocities of its ends."""
    pin_model, data = model.pin_model, model.pin_model.createData()
    frames = [pin_model.getFrameId(name) for name in FOOT_NAMES]
    found = np.empty((len(plan.tau), 18))
    for row, dt in enumerate(np.diff(plan.times).tolist()):
        q, v = plan.q[row], plan.v[row]
        wanted = pin.rnea(pin_model, data, q, v, (plan.v[row + 1] - v) / dt)
        wanted[6:] -= plan.tau[row]
        pin.computeJointJacobians(pin_model, data, q)
        for leg, frame in enumerate(frames):
            J = pin.getFrameJacobian(pin_model, data, frame, _ALIGNED)[:3]
            wanted -= J.T @ plan.forces[row, leg]
        found[row] = np.abs(wanted)
    return found
