"""What the rows of the QP are to a user: limits with a name, a value and a unit."""

from __future__ import annotations

from dataclasses import dataclass
from math import log, sqrt

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.records import Array30
from go2_wbc.wbc.constraints import FrictionPyramid, JointLimits
from go2_wbc.wbc.problem import Problem
from go2_wbc.wbc.solvers import LIMITS
from go2_wbc.wbc.tasks import ForceRegularisation

FORCE_ROWS = 5  #: Of a foot that stands: four of friction, then its normal force
TORQUES, JOINTS = 4 * FORCE_ROWS, 4 * FORCE_ROWS + 12
"""Where these begin in a row of ``Multipliers``."""
JOINT_WORDS = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
FRICTION = 0.5  #: Friction coefficient that a floor usually has
_LEAST = 1e-3  # [N, N m] what counts as nothing


@dataclass(frozen=True, slots=True)
class Limit:
    """One side of a row, or what a foot's contact asks for."""

    name: str  #: in plain words
    value: float  #: what the decision makes of it
    limit: float  #: what it may be at most, or at least
    unit: str  #: of both
    unusual: float
    """How much tighter it is than that of a sound robot on its feet: the logarithm of how many
    times, and what a contact or a joint's end asks for by ``LIMITS``."""
    per_row: float = 1.0  #: by how much the row's bound moves for one unit of this limit


def places_of(problem: Problem) -> Int[np.ndarray, " rows"]:
    """Where each row of the bounds lies in a row of ``Multipliers``."""
    stance = np.flatnonzero(problem.stance)
    forces = (FORCE_ROWS * stance[:, None] + np.arange(FORCE_ROWS)).ravel()
    return np.concatenate([forces, np.arange(TORQUES, JOINTS + 12)])


def rows_of_limit(problem: Problem, row: int) -> slice:
    """The rows that are one limit with this one: a foot's friction has four."""
    if row >= len(problem.bounds.lower) - 24 or row % FORCE_ROWS == FORCE_ROWS - 1:
        return slice(row, row + 1)
    first = row - row % FORCE_ROWS
    return slice(first, first + FORCE_ROWS - 1)


def weight_of(problem: Problem) -> float:
    """Of the robot [N]."""
    return problem.source(ForceRegularisation).weight_of_robot


def contact_of(problem: Problem, place: int, z: Array30) -> Limit:
    """What a contact asks for: the acceleration that stops its foot. ``place``: among those."""
    rows = slice(6 + 3 * place, 9 + 3 * place)
    asked = float(np.linalg.norm(problem.equalities.b[rows]))
    value = float(np.linalg.norm(problem.equalities.A[rows] @ z))
    foot = LEGS[int(np.flatnonzero(problem.stance)[place])].name
    return Limit(f"contact of {foot}", value, asked, "m/s^2", asked / LIMITS["stance feet"])


def limit_of(problem: Problem, row: int, z: Array30, *, is_upper: bool) -> Limit:
    """What one side of a row is, at a decision."""
    place, bounds = int(places_of(problem)[row]), problem.bounds
    value = float(bounds.C[row] @ z)
    bound = float((bounds.upper if is_upper else bounds.lower)[row])
    if place >= JOINTS:
        return _joint_limit(problem, place - JOINTS, value, bound, is_upper=is_upper)
    if place >= TORQUES:
        return _torque_limit(problem, place - TORQUES, value, bound)
    leg, n = divmod(place, FORCE_ROWS)
    foot, weight = LEGS[leg].name, weight_of(problem)
    if n == FORCE_ROWS - 1:
        if is_upper:
            most = f"greatest normal force of {foot}"
            return Limit(most, value, bound, "N", _times(weight, bound))
        share = weight / int(problem.stance.sum())
        return Limit(f"least normal force of {foot}", value, bound, "N", _times(bound, share))
    C = bounds.C[row, 18 + 3 * leg : 21 + 3 * leg]
    mu = problem.source(FrictionPyramid).friction_for(problem.reference)
    name, most = f"friction of {foot} {_direction(C)}", max(-float(C[2] * z[20 + 3 * leg]), 0.0)
    return Limit(name, value + most, most, "N", _times(FRICTION, mu))


def _direction(C: Float[np.ndarray, "3"]) -> str:
    """Along which axis of the world a row of friction pushes, or at which angle."""
    angle = round(float(np.degrees(np.arctan2(C[1], C[0])))) % 360
    axis = {0: "along +x", 90: "along +y", 180: "along -x", 270: "along -y"}
    return axis.get(angle, f"at {angle} deg")


def _times(greater: float, less: float) -> float:
    """Logarithm of how many times greater it is."""
    return log(max(greater, _LEAST) / max(less, _LEAST))


def _torque_limit(problem: Problem, n: int, value: float, bound: float) -> Limit:
    offset = problem.snapshot.bias[6:]
    limits = problem.bounds.upper[-24:-12] + offset, -problem.bounds.lower[-24:-12] - offset
    usual = float(np.maximum(*limits)[n % 3 :: 3].max())
    limit, name = bound + float(offset[n]), f"torque limit of {JOINT_WORDS[n]}"
    return Limit(name, value + float(offset[n]), limit, "N m", _times(usual, abs(limit)))


def _joint_limit(problem: Problem, n: int, value: float, bound: float, *, is_upper: bool) -> Limit:
    """What stands behind a bound of a joint's acceleration; see ``JointLimits``."""
    limits, now, name = problem.source(JointLimits), problem.snapshot, JOINT_WORDS[n]
    side, h, braking = (1.0 if is_upper else -1.0), float(limits.horizon), float(limits.braking)
    ends = side * np.array(limits.q_upper if is_upper else limits.q_lower)
    speeds, speed = np.array(limits.speed), side * float(now.v[6 + n])
    end, most, half = float(ends[n]), float(speeds[n]), braking * h / 2
    radicand = half * half - 2 * half * speed + 2 * braking * (end - side * float(now.q[7 + n]))
    fast = sqrt(max(radicand, 0.0)) - half
    if side * bound <= -braking or (radicand <= 0.0 and fast < most):
        unusual = -side * bound / LIMITS["joint limits"]
        return Limit(f"braking of {name}", value, bound, "rad/s^2", unusual)
    if most <= fast:
        unusual = _times(float(speeds[n % 3 :: 3].max()), most)
        values = side * speed + h * value, side * most
        return Limit(f"speed limit of {name}", *values, "rad/s", unusual, 1.0 / h)
    per_row = braking / (sqrt(radicand) * h)
    unusual = float(ends[3 * LEGS[n // 3].mirror + n % 3]) - end
    values = side * end + (value - bound) / per_row, side * end
    return Limit(f"position limit of {name}", *values, "rad", unusual, per_row)
