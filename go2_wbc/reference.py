"""What to track now: the interface between everything that plans and the controller.

Gaits, motions, teleoperation and remote commands all produce a ``Reference``; the whole-body
controller starts from one. ``JointReference`` is its counterpart for joint servos, for the phases
in which the trunk lies on the ground and no contact model holds.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.linear import cross, dot, triple
from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.compilation import Foreign, kernel
from go2_wbc.errors import CommandError
from go2_wbc.lazy import moved_names
from go2_wbc.records import Array4, Array12, Record
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import Snapshot

LEAST_WEIGHT, MOST_WEIGHT = 1e-6, 1e2  #: Of the force regularisation: beyond them accuracy is lost
_set = object.__setattr__  # of a frozen value that is being made


class LegTask(IntEnum):
    """What a leg is asked to do."""

    STANCE = 0
    SWING = 1
    JOINTS = 2


STANCE, SWING, JOINTS = (int(task) for task in LegTask)
"""The same as numbers, for compiled code; and looking an enumeration's members up takes longer."""


class Target(Record):
    """The numbers of a ``Reference``, one after the other, as kernels read and fill them.

    All others as in ``Reference`` and its ``BodyTarget``.
    """

    is_com: bool  #: whether position means the CoM, else the origin of the base
    p_world: Float[np.ndarray, "3"]
    v_world: Float[np.ndarray, "3"]
    a_world: Float[np.ndarray, "3"]
    R_world_base: Float[np.ndarray, "3 3"]
    w_world: Float[np.ndarray, "3"]
    dw_world: Float[np.ndarray, "3"]
    legs: Float[np.ndarray, "4"]  #: ``LegTask`` of each leg
    normal_force_min: Float[np.ndarray, "4"]
    normal_force_max: Float[np.ndarray, "4"]
    p_world_feet: Float[np.ndarray, "4 3"]
    v_world_feet: Float[np.ndarray, "4 3"]
    a_world_feet: Float[np.ndarray, "4 3"]
    q_joints: Float[np.ndarray, "12"]
    v_joints: Float[np.ndarray, "12"]
    a_joints: Float[np.ndarray, "12"]
    f_world_feet: Float[np.ndarray, "4 3"]
    force_weight: float
    friction: float
    orientation_discount: float


@kernel
def sag_and_lean(target: Target, now: Snapshot) -> tuple[float, float]:
    """Depth [m] of the tracked point below where it shall be, and angle [rad] of the verticals."""
    measured = now.p_world_com[2] if target.is_com else now.q[2]
    cosine = 0.0
    for i in range(3):
        cosine += target.R_world_base[2, i] * now.R_world_base[2, i]
    return target.p_world[2] - measured, np.arccos(min(max(cosine, -1.0), 1.0))


ASTRAY, STILL = 0.02, 0.3
"""Distance [m] of a foot from where it shall be, and speed [m/s] below which it stays there."""
LEFT_BEHIND, SLACK = 0.3, 0.15
"""Speed [m/s] at which a held foot is left behind by where it shall be, or all of that's speed if
it is less, give or take: 0.4 in a trot, 0.1 where a paw comes to rest. One that came late against
its joints' friction, and one whose knee lay on a slope, were left by less but for 16 ms."""
PROPPED, BRISK = 40.0, 1.0
"""Force [N] below which a foot in swing is not held, if it is led by less than that speed [m/s]:
its calf lies on something, or is against it. Noses of steps took 12 to 32 of feet of plans, led at
.85 at most; feet held in a trot may take no more, but are led faster."""


@kernel
def hold_feet(target: Target, now: Snapshot, tau: Foreign[Array12], held: Array4) -> float:
    """Fill with what force [N] each foot is held that stays where it shall not, in the air.

    With e the way to where it shall be, and the torques ``tau`` that the motors give,
    e . J^-T (tau - h) / |e|; 0 for the others, and below ``PROPPED`` for feet in slow swing.
    Returns the greatest.
    """
    way, axes = np.empty(3), np.empty((3, 3))
    for leg in range(4):
        held[leg], square, speed, led, left, j = 0.0, 0.0, 0.0, 0.0, 0.0, 3 * leg
        if target.legs[leg] == STANCE:
            continue
        for i in range(3):
            way[i] = target.p_world_feet[leg, i] - now.p_world_feet[leg, i]
            v_des, turned, v_turned = target.v_world_feet[leg, i], 0.0, now.v_world_feet[leg, i]
            for k in range(3):
                axes[k, i] = now.J_feet[leg, i, 6 + j + k]
                turned += axes[k, i] * (target.q_joints[j + k] - now.q[7 + j + k])
                v_turned += axes[k, i] * (target.v_joints[j + k] - now.v[6 + j + k])
            if target.legs[leg] == JOINTS:
                way[i], v_des = turned, v_turned
            square += way[i] ** 2
            speed += now.v_world_feet[leg, i] ** 2
            led += v_des**2
            left += way[i] * (v_des - now.v_world_feet[leg, i])
        a, b, c, e = triple(axes[0]), triple(axes[1]), triple(axes[2]), triple(way)
        det = dot(a, cross(b, c))
        least = min(LEFT_BEHIND, np.sqrt(led)) - SLACK
        stays = speed < STILL**2 and left > least * np.sqrt(square)
        if square > ASTRAY**2 and stays and abs(det) > 1e-6:  # not stretched
            load = triple(tau[j : j + 3] - now.bias[6 + j : 9 + j])
            work = load[0] * dot(e, cross(b, c)) + load[1] * dot(e, cross(c, a))
            held[leg] = (work + load[2] * dot(e, cross(a, b))) / (det * np.sqrt(square))
            is_slow = target.legs[leg] == SWING and led < BRISK**2
            if is_slow and held[leg] < PROPPED:
                held[leg] = 0.0
    return float(np.max(held))


_LEG_TASKS = tuple(LegTask)
_BODY_PARTS = ("p_world", "v_world", "a_world", "R_world_base", "w_world", "dw_world")
_ARRAYS = (
    *("normal_force_min", "normal_force_max", "p_world_feet", "v_world_feet", "a_world_feet"),
    *("q_joints", "v_joints", "a_joints", "f_world_feet"),
)
_NUMBERS = ("force_weight", "friction", "orientation_discount")


class TrackedPoint(Enum):
    """Which point of the trunk ``BodyTarget.p_world`` speaks of."""

    COM = "com"
    BASE = "base"


_COM, _BASE = TrackedPoint


@dataclass(frozen=True, slots=True)
class BodyTarget:
    """Desired motion of the trunk, everything in the world frame."""

    point: TrackedPoint  #: whether position means the CoM or the origin of the base
    p_world: Float[np.ndarray, "3"]  #: position [m]
    v_world: Float[np.ndarray, "3"]  #: linear velocity [m/s]
    a_world: Float[np.ndarray, "3"]  #: and acceleration [m/s^2]
    R_world_base: Float[np.ndarray, "3 3"]  #: orientation
    w_world: Float[np.ndarray, "3"]  #: angular velocity [rad/s]
    dw_world: Float[np.ndarray, "3"]  #: and acceleration [rad/s^2]

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class Reference:
    """The input of the whole-body controller at one instant, besides the snapshot.

    Attributes:
        body: desired motion of the trunk.
        legs: task of each of the four legs.
        normal_force_min: least normal force [N] of each stance foot.
        normal_force_max: greatest normal force [N] of each stance foot (ramped at changes).
        p_world_feet: desired foot positions [m], used for legs in SWING.
        v_world_feet: their velocities [m/s].
        a_world_feet: their accelerations [m/s^2].
        q_joints: desired joint angles [rad], used for legs in JOINTS.
        v_joints: their velocities [rad/s].
        a_joints: their accelerations [rad/s^2].
        f_world_feet: desired contact forces [N] of the stance feet.
        force_weight: weight of the force regularisation towards these, 1e-6 to 100; with 0 the
            desired forces are an equal share of the robot's weight, with the controller's own
            weight.
        friction: greatest coefficient that the stance feet may use; 0 for the controller's own,
            which is never exceeded.
        orientation_discount: the weight of the trunk's attitude is divided by 1 plus this, 0 or
            more.
        stance: feet in stance, from ``legs``.
    """

    body: BodyTarget
    legs: tuple[LegTask, ...]
    normal_force_min: Float[np.ndarray, "4"]
    normal_force_max: Float[np.ndarray, "4"]
    p_world_feet: Float[np.ndarray, "4 3"]
    v_world_feet: Float[np.ndarray, "4 3"]
    a_world_feet: Float[np.ndarray, "4 3"]
    q_joints: Float[np.ndarray, "12"]
    v_joints: Float[np.ndarray, "12"]
    a_joints: Float[np.ndarray, "12"]
    f_world_feet: Float[np.ndarray, "4 3"] = field(default_factory=partial(np.zeros, (4, 3)))
    force_weight: float = 0.0
    friction: float = 0.0
    orientation_discount: float = 0.0
    stance: Bool[np.ndarray, "4"] = field(init=False)
    _row: Float[np.ndarray, " size"] | None = field(init=False, repr=False, default=None)

    __repr__ = brief

    def __post_init__(self) -> None:
        stance = np.array([task is LegTask.STANCE for task in self.legs])
        _set(self, "stance", stance)

    @staticmethod
    def of_row(row: Float[np.ndarray, " size"]) -> Reference:
        """The reference whose numbers ``row`` holds (see ``Target``).

        Each array is made at its first use: a tick needs few of them outside the kernels.
        """
        reference = object.__new__(Reference)
        _set(reference, "_row", row)
        return reference

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> object:
            """What nobody has asked ``of_row`` for yet."""
            if name not in Reference.__slots__ or name == "_row":
                raise AttributeError(f"a Reference has no attribute {name!r}")
            value = self._unpacked(name)
            _set(self, name, value)
            return value

    def _unpacked(self, name: str) -> object:
        target = Target.of(self.row)
        if name == "body":
            point = _COM if target.is_com else _BASE
            return BodyTarget(point, *(getattr(target, part) for part in _BODY_PARTS))
        if name == "stance":
            return target.legs == STANCE
        if name == "legs":
            return tuple(_LEG_TASKS[int(task)] for task in target.legs.tolist())
        value = getattr(target, name)
        return float(value) if name in _NUMBERS else value

    @property
    def row(self) -> Float[np.ndarray, " size"]:
        """Everything that is asked for, one number after the other, for the kernels.

        Raises:
            CommandError: for an array of another shape than it should have, or other legs.
        """
        row = self._row
        if row is None:
            body = self.body
            if len(self.legs) != 4 or not all(isinstance(task, LegTask) for task in self.legs):
                raise CommandError(
                    f"reference: legs must be four of {list(LegTask)}, got {self.legs!r}"
                )
            try:
                target = Target(
                    is_com=body.point is TrackedPoint.COM,
                    legs=self.legs,
                    **{name: getattr(body, name) for name in _BODY_PARTS},
                    **{name: getattr(self, name) for name in _ARRAYS + _NUMBERS},
                )
            except (TypeError, ValueError) as error:
                raise CommandError(f"reference: {error}") from error
            row = target.row
            weight = float(target.force_weight)
            if np.isfinite(weight) and weight != 0.0 and not LEAST_WEIGHT <= weight <= MOST_WEIGHT:
                raise CommandError(
                    f"reference: force_weight must be 0 or {LEAST_WEIGHT:g} to {MOST_WEIGHT:g}, "
                    f"got {weight:g}"
                )
            for name in ("friction", "orientation_discount"):
                value = getattr(self, name)
                if np.isfinite(value) and value < 0.0:
                    raise CommandError(f"reference: {name} must be 0 or more, got {value:g}")
            _set(self, "_row", row)
        return row

    @typed(late=True)
    def placed(self, anchor: Anchor) -> Reference:
        """This reference, given in the frame of a motion, in the world."""
        R, body = yaw_rotation(anchor.yaw), self.body
        turned = {name: R @ getattr(body, name) for name in _BODY_PARTS}
        turned["p_world"] = anchor.p_world + turned["p_world"]
        feet = {name: getattr(self, name) @ R.T for name in _ARRAYS if name.endswith("_feet")}
        feet["p_world_feet"] = anchor.p_world + feet["p_world_feet"]
        return replace(self, body=replace(body, **turned), **feet)


@dataclass(frozen=True, slots=True)
class Anchor:
    """Where a motion takes place: its frame has z up, x ahead, and its origin on the ground."""

    p_world: Float[np.ndarray, "3"]  #: the origin, the middle of the feet on the ground [m]
    yaw: float  #: heading of the feet [rad]

    @property
    def pose(self) -> tuple[float, float, float]:
        """x, y [m] and yaw [rad]."""
        x, y, _ = self.p_world.tolist()
        return x, y, self.yaw

    @staticmethod
    def of_feet(p_world_feet: Float[np.ndarray, "4 3"], foot_radius: float) -> Anchor:
        """The anchor below four standing feet, given their centres [m] and radius [m]."""
        middle = p_world_feet.mean(axis=0)
        middle[2] -= foot_radius
        ahead = p_world_feet[:2].mean(axis=0) - p_world_feet[2:].mean(axis=0)
        return Anchor(middle, float(np.arctan2(ahead[1], ahead[0])))


@dataclass(frozen=True, slots=True)
class JointReference:
    """Joint targets for a servo: no contact model, no balance.

    Attributes:
        q_joints: desired joint angles [rad].
        v_joints: desired joint velocities [rad/s].
        kp: stiffness [N m/rad].
        kd: damping [N m s/rad].
    """

    q_joints: Float[np.ndarray, "12"]
    v_joints: Float[np.ndarray, "12"]
    kp: float
    kd: float

    __repr__ = brief

    @property
    def stance(self) -> Bool[np.ndarray, "4"]:
        """No foot is planned to carry the robot."""
        return np.zeros(4, dtype=bool)


_OF_PLANS = ("Footsteps", "MotionPlan", "PlanFeedback", "Posture", "Stance")
__getattr__ = moved_names(__name__, dict.fromkeys(_OF_PLANS, "go2_wbc.motion_plan"))
