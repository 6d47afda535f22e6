"""Which limits contradict each other where the QP has no solution, and by how much.

If no u keeps all rows G u <= h, then and only then there are weights y >= 0 with G'y = 0 and
h'y < 0 (Farkas' lemma; Boyd & Vandenberghe, *Convex Optimization*, 2004, sec. 5.8.3): the rows with
y > 0 contradict each other, the others have no part in it. They are the multipliers of the linear
program of phase 1 (sec. 11.4),

    minimise sum t_i / s_i    subject to    G u <= h + t,  t >= 0        (1)

with a scale s of each kind of limit. Of each limit with a part, another linear program tells by how
much it alone would have to give way for the rest to be kept:

    minimise t    subject to    G u <= h + t e_i    (2)

What cannot cure it alone is no explanation. Of what can, some limits are as they always are, such
as the torque of sound motors, and some are not: a foot that shall stand but flies, a motor that
gives little, a least force greater than the share of the weight. What would be cured if it were as
usual (``Limit.unusual``) comes first, and of several the most unusual.

The whole-body controller then does not give up: it follows the nearest answer (``solvers``), with
no least normal force, slack of the joint limits and feet that slide. What gave way in it is told
beside.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import expm1
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import LEGS
from go2_wbc.wbc.constraints import JointLimits
from go2_wbc.wbc.limit_rows import (
    FORCE_ROWS,
    JOINTS,
    TORQUES,
    contact_of,
    limit_of,
    places_of,
    rows_of_limit,
    weight_of,
)
from go2_wbc.wbc.problem import SIZE, Problem
from go2_wbc.wbc.solvers import LIMITS, relaxed_qp, solve_with_multipliers, unknowns

MOTOR_TORQUE = 23.7  #: Scale of torques [N m], what a motor of hip or thigh gives
_TINY = 1e-7  # of a multiplier of (1), times its scale
_TRIFLES = {"m/s^2": 0.01, "N": 0.1, "N m": 0.01, "rad/s^2": 0.1}  # of what gave way


@dataclass(frozen=True, slots=True)
class Demand:
    """A limit that alone would have to give way."""

    name: str  #: what it is, of which foot or joint
    needs: float  #: what would do [unit]
    has: float  #: what there is [unit]
    unit: str  #: of both

    def __str__(self) -> str:
        return f"{self.name}: needs {self.needs:.3g} {self.unit}, has {self.has:.3g}"


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Why no decision keeps all limits."""

    name: str  #: the limit that is to blame
    against: str  #: the limit that it contradicts most; "" if it leaves nothing by itself
    demand: Demand | None  #: what of it would do; None if no limit alone could give way
    others: tuple[Demand, ...]  #: what else could give way alone
    gave_way: tuple[str, ...]
    """What gave way in the nearest answer, which is followed; nothing if there is none."""

    @staticmethod
    def of(problem: Problem) -> Contradiction:
        """Of a problem that has no solution."""
        program = _Program(problem)
        parts = sorted(program.parts(), key=lambda part: -part[1])
        cures = [(group, cure) for group, _ in parts if (cure := program.cure(group)) is not None]
        cures.sort(key=lambda item: (item[0].back < item[1], -item[0].unusual))
        first = cures[0][0] if cures else parts[0][0]
        against = next((group.name for group, _ in parts if group is not first), "")
        demands = [group.demand(cure) for group, cure in cures]
        return Contradiction(
            first.name,
            against,
            demands[0] if demands else None,
            tuple(demands[1:]),
            tuple(_gave_way(problem)),
        )

    def __str__(self) -> str:
        against = f" contradicts the {self.against}" if self.against else ""
        if self.demand is None:
            return f"{self.name}{against}"
        d = self.demand
        return f"{self.name}{against}: needs {d.needs:.3g} {d.unit}, has {d.has:.3g}"

    def table(self) -> str:
        """A line for each limit that could give way alone, and what gave way."""
        lines = [str(self), *(f"or {other}" for other in self.others)]
        return "\n".join([*lines, *(f"gave way: {what}" for what in self.gave_way)])


@dataclass(frozen=True, slots=True, eq=False)
class _Group:
    """Rows G u <= h that are one limit.

    ``asks`` is whether it demands something rather than setting a bound to it, and ``has`` what it
    demands, or its bound [unit]; ``back`` is the way from there to what is usual.
    """

    name: str
    unit: str
    G: Float[np.ndarray, "k n"]
    h: Float[np.ndarray, " k"]
    has: float
    unusual: float  # see ``Limit``
    back: float
    scale: float
    asks: bool

    def demand(self, t: float) -> Demand:
        """What of it would do, t of (2) being given way."""
        if self.asks:
            return Demand(self.name, self.has, max(self.has - t, 0.0), self.unit)
        return Demand(self.name, self.has + t, self.has, self.unit)


class _Program:
    """The linear programs, in the accelerations and the forces of feet that stand."""

    def __init__(self, problem: Problem) -> None:
        unknown = unknowns(problem)
        E = problem.equalities.A[:, unknown]
        self.base = E[:6], problem.equalities.b[:6]
        self.groups = [*_contacts(problem, E[6:]), *_limits(problem, unknown)]
        self.n = int(unknown.sum())

    def parts(self) -> Iterator[tuple[_Group, float]]:
        """The groups that contradict each other, and their share: the multipliers of (1)."""
        sizes = [len(g.h) for g in self.groups]
        scale = np.repeat([g.scale for g in self.groups], sizes)
        weights = np.concatenate([np.zeros(self.n), 1.0 / scale])
        y = self._minimum(weights, -np.eye(len(scale))).ineqlin.marginals * scale
        for group, own in zip(self.groups, np.split(y, np.cumsum(sizes)[:-1]), strict=True):
            if (share := float(np.abs(own).max())) > _TINY:
                yield group, share

    def cure(self, group: _Group) -> float | None:
        """t of (2): by how much this group alone has to give way; None if that does not help."""
        gives = np.concatenate([np.full(len(g.h), -float(g is group)) for g in self.groups])
        found = self._minimum(np.eye(self.n + 1)[-1], gives[:, None])
        return float(found.x[-1]) if found.success else None

    def _minimum(
        self, cost: Float[np.ndarray, " columns"], slack: Float[np.ndarray, "rows slacks"]
    ) -> Any:  # noqa: ANN401 - SciPy's, which names no type
        """Of ``cost`` over u and slacks of at least 0 that widen the rows."""
        from scipy.optimize import linprog  # only for who asks why

        E, e = self.base
        E = np.concatenate([E, np.zeros((6, slack.shape[1]))], axis=1)
        G = np.concatenate([np.concatenate([g.G for g in self.groups]), slack], axis=1)
        h = np.concatenate([g.h for g in self.groups])
        bounds = [(None, None)] * self.n + [(0.0, None)] * slack.shape[1]
        return linprog(cost, G, h, E, e, bounds, method="highs")


def _contacts(problem: Problem, E: Float[np.ndarray, "k n"]) -> Iterator[_Group]:
    e, scale = problem.equalities.b[6:], LIMITS["stance feet"]
    for k in range(int(problem.stance.sum())):
        rows, limit = slice(3 * k, 3 * k + 3), contact_of(problem, k, np.zeros(SIZE))
        both = np.concatenate([E[rows], -E[rows]]), np.concatenate([e[rows], -e[rows]])
        asked = limit.limit
        yield _Group(limit.name, limit.unit, *both, asked, limit.unusual, asked, scale, asks=True)


def _limits(problem: Problem, unknown: Bool[np.ndarray, "30"]) -> Iterator[_Group]:
    G, lower, upper = problem.bounds.C[:, unknown], problem.bounds.lower, problem.bounds.upper
    weight, zero = weight_of(problem), np.zeros(SIZE)
    braking, strong = problem.source(JointLimits).braking, LIMITS["joint limits"]
    for row, place in enumerate(places_of(problem)):
        low, high = (limit_of(problem, row, zero, is_upper=side) for side in (False, True))
        both = np.stack([G[row], -G[row]]), np.array([upper[row], -lower[row]])
        if place >= JOINTS:
            room, name = float(both[1].min()), (low if lower[row] > -upper[row] else high).name
            values = abs(room), (braking - room) / strong, braking - room, strong
            yield _Group(name, "rad/s^2", *both, *values, asks=room < 0.0)
        elif place >= TORQUES:
            limit = min(low, high, key=lambda one: abs(one.limit))
            has = abs(limit.limit)
            values = has, limit.unusual, has * expm1(limit.unusual), MOTOR_TORQUE
            yield _Group(limit.name, limit.unit, *both, *values, asks=False)
        elif place % FORCE_ROWS == FORCE_ROWS - 1:
            for limit, k in ((high, 0), (low, 1)):
                if np.isfinite(limit.limit):
                    own = both[0][k : k + 1], both[1][k : k + 1]
                    back = abs(limit.limit * expm1((1 - 2 * k) * limit.unusual))
                    values = limit.limit, limit.unusual, back, weight
                    yield _Group(limit.name, "N", *own, *values, asks=bool(k))
        elif place % FORCE_ROWS == 0:
            rows, name = (
                rows_of_limit(problem, row),
                f"friction of {LEGS[place // FORCE_ROWS].name}",
            )
            values = 0.0, high.unusual, weight, weight
            yield _Group(name, "N", G[rows], upper[rows], *values, asks=False)


def _gave_way(problem: Problem) -> Iterator[str]:
    """What the nearest answer breaks, foot by foot and joint by joint."""
    try:
        x, _ = solve_with_multipliers(relaxed_qp(problem))
    except QpInfeasible:
        return
    z = np.zeros(SIZE)
    z[unknowns(problem)] = x[:-12]
    off = (problem.equalities.A @ z - problem.equalities.b)[6:].reshape(-1, 3)
    for leg, row in zip(np.flatnonzero(problem.stance), np.linalg.norm(off, axis=1), strict=True):
        if row > _TRIFLES["m/s^2"]:
            yield f"contact of {LEGS[leg].name} by {row:.3g} m/s^2"
    value, (_, lower, upper) = problem.bounds.C @ z, problem.bounds
    units = ["N"] * (len(value) - 24) + ["N m"] * 12 + ["rad/s^2"] * 12
    for row, excess in enumerate(np.maximum(lower - value, value - upper)):
        if excess > _TRIFLES[units[row]]:
            is_upper = bool(value[row] > upper[row])
            name = limit_of(problem, row, z, is_upper=is_upper).name
            yield f"{name} by {excess:.3g} {units[row]}"
