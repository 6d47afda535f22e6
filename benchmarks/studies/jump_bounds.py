"""What physics lets a robot jump, computed without the planner: legs, motors' line, friction.

**Take-off.** Four legs push a level trunk straight up, each foot on its place, at a distance ahead
of its hip. At every height of the hips the joints' angles, and with them the Jacobian J of a foot
from its leg's joints and the height c of the CoM above the feet, follow from geometry; so do the
joints' rates from the trunk's speed u: J q' = -u e_z. A force f of the ground takes the torques
-J' f. The greatest upward force of a foot is

    F = max f_z   with  |J' f| within the motors' line at q',  |f_x| <= mu f_z,  f_z <= f_max   (1)

and the speed v = u dc/dz of the CoM grows by

    d(v^2 / 2) / dc = 4 F / m - g                                                             (2)

until the motors give less than the weight at that speed, a joint would be faster than it may, or
the legs are out of range. Only the legs' own inertia is left out, which costs torque and speed: the
result is a bound.

**Distance**, with the take-off speed v at the best angle and friction mu, in a push of t seconds:

    max over v_z of 2 v_x v_z / g,   v_x^2 + v_z^2 <= v^2,   v_x <= mu (v_z + g t)             (3)

**Turn.** The feet's friction gives a yaw impulse of at most mu r times the vertical one, r being
the feet's distance from the middle; with the least moment of inertia I about the vertical the trunk
turns in a flight of T = 2 v / g by

    psi <= mu r m (v + g t) T / I                                                             (4)

What comes of it is in ``docs/explanation/dynamics.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.errors import ConfigError
from go2_wbc.legs import LEGS
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import IDEAL, MotorModel
from motions.dynamics.phase_builders import PUSH
from motions.dynamics.plan_limits import PlanLimits

STEPS = 120
"""Heights of the hips at which a push is evaluated: half of them changes the speed by 0.3 %."""
DIRECTIONS = 41
"""Directions of the take-off that are tried in (3)."""
SINGULAR, ROUNDING = 1e-9, 1e-9
"""Determinant of two limits of a force that do not cross; share by which a corner may miss one."""
OFFSETS = np.linspace(-0.12, 0.12, 13)
"""Places of the feet ahead of their hips [m] that are tried."""
NO_CAP = 1e4
"""Force of a foot [N] that no leg reaches."""
LOWEST, HIGHEST = 0.08, 0.42
"""Heights of the hips above the feet [m] between which a leg may be in range."""


@dataclass(frozen=True, slots=True)
class Posture:
    """A level trunk over four feet, as far as a push up needs it.

    Attributes:
        c: height [m] of the CoM above the feet's centres.
        share: speed of the CoM as a share of the trunk's.
        J: (3, 3) Jacobian of a foot from the joints of its leg, the trunk at rest.
        rates: (3,) joint rates [1/m] for a trunk that rises by 1 m/s.
    """

    c: float
    share: float
    J: Float[np.ndarray, "3 3"]
    rates: Float[np.ndarray, "3"]


@dataclass(frozen=True, slots=True)
class TakeOff:
    """The best push up.

    Attributes:
        speed: of the CoM [m/s] when the feet leave the ground.
        stroke: from the lowest place of the CoM to that [m].
        rise: of the CoM [m] in flight.
        feet: greatest height of the feet [m], legs drawn up.
        binds: what ends the push.
    """

    speed: float
    stroke: float
    rise: float
    feet: float
    binds: str


@dataclass(frozen=True, slots=True)
class PhysicsRow:
    """A number of the table: what it is, and its unit."""

    what: str
    value: float
    unit: str


def physics_rows(model: RobotModel) -> tuple[PhysicsRow, ...]:
    """The bounds, with the limits that plans keep, and with more than these."""
    limits = PlanLimits()
    planned = model.motor.scaled(limits.torque_share)
    free = replace(limits, force_max=NO_CAP, speed_share=1.0)
    ideal = MotorModel.named(IDEAL, model.description)
    best = best_take_off(model, planned, limits)
    whole = best_take_off(model, model.motor, free)
    strong = best_take_off(model, ideal, free)
    flight = 2.0 * best.speed / model.gravity
    return (
        PhysicsRow("take-off speed of the CoM, limits of the plans", best.speed, "m/s"),
        PhysicsRow(f"  after a stroke of; ended by {best.binds}", best.stroke, "m"),
        PhysicsRow("  the CoM's rise in flight", best.rise, "m"),
        PhysicsRow("  height of the feet, legs drawn up", best.feet, "m"),
        PhysicsRow("  the same with all torque and speed", whole.feet, "m"),
        PhysicsRow("  the same with the peak torque at every speed", strong.feet, "m"),
        PhysicsRow("  the CoM's way ahead", distance_bound(model, best, limits.friction), "m"),
        PhysicsRow("  turn in flight by friction", turn_bound(model, best, limits.friction), "deg"),
        PhysicsRow("  time in the air", flight, "s"),
        PhysicsRow("  pitch rate of a backflip in that time", 2.0 * math.pi / flight, "rad/s"),
    )


def best_take_off(model: RobotModel, motor: MotorModel, limits: PlanLimits) -> TakeOff:
    """The take-off with the greatest height of the feet, over the places of the feet.

    Args:
        model: the robot.
        motor: what its motors give.
        limits: friction, greatest force, joint range and speed, height of the knees.

    Raises:
        ConfigError: if the limits leave the legs no range.
    """
    pushes = [push for x in OFFSETS if (push := postures(model, x, limits))]
    if not pushes:
        raise ConfigError("the limits leave the legs no range in which they could push")
    found = [take_off(push, model, motor, limits) for push in pushes]
    return max(found, key=lambda one: one.feet)


def distance_bound(model: RobotModel, take_off: TakeOff, friction: float) -> float:
    """Greatest way ahead [m] of the CoM in flight, by (3)."""
    g, v = model.gravity, take_off.speed
    up = v * np.linspace(0.0, 1.0, DIRECTIONS)
    ahead = np.minimum(np.sqrt(v * v - up * up), friction * (up + g * PUSH))
    return float((2.0 * ahead * up / g).max())


def turn_bound(model: RobotModel, take_off: TakeOff, friction: float) -> float:
    """Greatest turn [deg] about the vertical in flight, by (4)."""
    g = model.gravity
    radius = float(np.linalg.norm(model.p_base_feet_nominal[0, :2]))
    impulse = friction * radius * model.mass * (take_off.speed + g * PUSH)
    turn = impulse * 2.0 * take_off.speed / (g * least_yaw_inertia(model))
    return math.degrees(turn)


def least_yaw_inertia(model: RobotModel) -> float:
    """Moment of inertia [kg m^2] about the vertical through the CoM, feet drawn up to the hips."""
    q = _configuration(model, 0.0, LOWEST + 0.02)
    data = model.pin_model.createData()
    pin.ccrba(model.pin_model, data, q, np.zeros(18))
    return float(data.Ig.inertia[2, 2])


def take_off(
    push: list[Posture], model: RobotModel, motor: MotorModel, limits: PlanLimits
) -> TakeOff:
    """The take-off of a push through these postures, from the lowest up, by (2)."""
    fastest = limits.speed_share * model.speed_limits[:3]
    energy, binds = 0.0, "the legs' range"
    left = lowest = push[0].c
    for one, after in pairwise(push):
        u = math.sqrt(2.0 * energy) / one.share
        lift = 4.0 * foot_force(one, u, motor, limits) / model.mass - model.gravity
        gained = energy + lift * (after.c - one.c)
        if gained <= energy:
            binds = "the motors' torque"
            break
        if (math.sqrt(2.0 * gained) / after.share * np.abs(after.rates) > fastest).any():
            binds = "the joints' speed"
            break
        energy, left = gained, after.c
    rise = energy / model.gravity
    return TakeOff(math.sqrt(2.0 * energy), left - lowest, rise, left + rise - lowest, binds)


def foot_force(posture: Posture, u: float, motor: MotorModel, limits: PlanLimits) -> float:
    """F of (1) [N] at the trunk's speed ``u`` [m/s]: the best corner of the forces it allows."""
    lower, upper = (side[:3] for side in motor.limits(np.tile(u * posture.rates, 4)))
    takes = -posture.J[[0, 2]].T
    mu = limits.friction
    A = np.vstack([takes, -takes, [[1.0, -mu], [-1.0, -mu], [0.0, 1.0]]])
    b = np.concatenate([upper, -lower, [0.0, 0.0, limits.force_max]])
    first, second = np.triu_indices(len(b), 1)
    pairs = np.stack([A[first], A[second]], axis=1)
    meets = np.abs(np.linalg.det(pairs)) > SINGULAR
    right = np.stack([b[first], b[second]], axis=1)[meets]
    corners = np.linalg.solve(pairs[meets], right[:, :, None])[:, :, 0]
    allowed = corners[(corners @ A.T <= b + ROUNDING * (1.0 + np.abs(b))).all(axis=1)]
    return float(allowed[:, 1].max(initial=0.0))


def postures(model: RobotModel, x: float, limits: PlanLimits) -> list[Posture]:
    """Those within the legs' range, from the lowest up, the feet ``x`` [m] ahead of the hips."""
    heights = np.linspace(LOWEST, HIGHEST, STEPS)
    found = []
    for z, dz in zip(heights, np.gradient(heights), strict=True):
        q = _configuration(model, x, float(z))
        if not _is_in_range(model, q, float(z), x, limits):
            continue
        data = model.pin_model.createData()
        frame = model.pin_model.getFrameId(LEGS[0].foot)
        pin.computeJointJacobians(model.pin_model, data, q)
        J = pin.getFrameJacobian(
            model.pin_model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )[:3, 6:9]
        rates = np.linalg.solve(J, [0.0, 0.0, -1.0])
        above = [_com_height(model, _configuration(model, x, float(z + s * dz))) for s in (-1, 1)]
        share = (above[1] - above[0]) / (2.0 * dz)
        found.append(Posture(_com_height(model, q), float(share), J, rates))
    return found


def _com_height(model: RobotModel, q: Float[np.ndarray, "19"]) -> float:
    com, feet = model.forward_kinematics(q)
    return float(com[2] - feet[:, 2].mean())


def _is_in_range(
    model: RobotModel, q: Float[np.ndarray, "19"], z: float, x: float, limits: PlanLimits
) -> bool:
    margin, joints = limits.joint_margin, q[7:10]
    inside = (joints >= model.q_lower[:3] + margin) & (joints <= model.q_upper[:3] - margin)
    geometry = LegGeometry.of(model, LEGS[0])
    knee = z - geometry.thigh * math.cos(joints[1]) + model.foot_radius
    reaches = math.hypot(x, z) < geometry.thigh + geometry.calf
    return bool(inside.all()) and reaches and knee >= limits.knee_height


def _configuration(model: RobotModel, x: float, z: float) -> Float[np.ndarray, "19"]:
    """A level trunk, the feet ``x`` [m] ahead of the hips and ``z`` below."""
    joints = np.empty(12)
    for leg in LEGS:
        geometry = LegGeometry.of(model, leg)
        place = geometry.p_base_hip + np.array([x, geometry.width, -z])
        joints[leg.joints] = leg_angles(geometry, place[None]).q[0]
    return np.concatenate([np.zeros(6), [1.0], joints])
