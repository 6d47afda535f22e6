"""Why the QP decided as it did: the active limits, the price of each, what more of it would give.

With the tasks' cost J = sum w |A z - b|^2 / 2, unknowns u and z = Z u + z0, the QP of a tick is

    minimise u'Hu/2 + g'u    subject to    lower <= C u <= upper

and at its optimum (Karush, Kuhn & Tucker; Boyd & Vandenberghe, *Convex Optimization*, 2004, sec.
5.5.3) there is a multiplier y of each row with

    H u + g + C'y = 0,    y >= 0 at an upper limit, <= 0 at a lower one, 0 where none is active (1)

|y| is by how much the optimal cost falls per unit by which that limit is relaxed (sec. 5.6.3). The
optimum itself moves along du, dy while the same rows A stay active (Nocedal & Wright, *Numerical
Optimization*, 2006, sec. 16.1), for the i-th of them relaxed by one unit on its side s = +-1:

    [ H    C_A' ] [ du ]   [    0    ]
    [ C_A   0   ] [ dy ] = [ s_i e_i ]    (2)

So each residual r = A z - b changes by A Z du, and since sum w r'A Z du = -|y_i|, the multiplier is
the sum of the contributions of all task rows. The row that gains most is what more of the limit
"gives". (2) holds until another row becomes active or one of these inactive: ``reach``.

Limits are ranked by how much the cost falls without one, from another solve.

Whichever back end decided: these are multipliers of its QP as our active set solves it
(``algebra.active_set``). Where active rows are linearly dependent, multipliers are not unique, and
a set that satisfies (1) is reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.brief import counted, cut
from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import LEGS
from go2_wbc.records import Array30
from go2_wbc.reference import LegTask
from go2_wbc.wbc.backends import dense_qp
from go2_wbc.wbc.constraints import Multipliers
from go2_wbc.wbc.contact_prices import are_hasty
from go2_wbc.wbc.contradiction import Contradiction
from go2_wbc.wbc.limit_rows import (
    JOINT_WORDS,
    Limit,
    contact_of,
    limit_of,
    places_of,
    rows_of_limit,
)
from go2_wbc.wbc.problem import SIZE, Bounds, Problem, Rows
from go2_wbc.wbc.solvers import DenseQp, relaxed_qp, solve_with_multipliers, unknowns
from go2_wbc.wbc.tasks import (
    BodyOrientation,
    BodyPosition,
    ForceRegularisation,
    LegPosture,
    SwingFoot,
    Task,
)

ALIKE = 0.5  #: Share of the greatest cost from which on one counts as about as great; own choice
_TRACE = 1e-6  # weight of a contact that is lifted
_TINY = 1e-9  # a multiplier below this share of the greatest is rounding


@dataclass(frozen=True, slots=True)
class Gain:
    """What one unit more of a limit gives."""

    what: str  #: the row of a task that gains most of the cost
    amount: float  #: by how much its error falls for each unit of the limit
    error: float  #: of the row now
    unit: str  #: of amount and error


@dataclass(frozen=True, slots=True)
class BindingLimit:
    """A limit that the decision is at."""

    name: str  #: what it is, of which foot or joint
    side: str  #: "upper" or "lower"
    value: float  #: where the decision is [unit]
    limit: float  #: where it may be [unit]
    unit: str  #: of limit, multiplier and reach
    multiplier: float  #: by how much the cost falls for one unit more
    gives: Gain  #: what it falls by, in the unit of a task
    reach: float
    """For how much more of the limit that holds, before another one binds or this one does no
    longer."""
    cost: float  #: by how much the cost would fall without it

    @property
    def slack(self) -> float:
        """Distance from the limit, which is rounding."""
        return abs(self.limit - self.value)

    @property
    def wider(self) -> str:
        """Whether "more" or "less" of the limit leaves more room."""
        return "less" if self.side == "lower" and self.limit >= 0.0 else "more"

    @property
    def offer(self) -> str:
        """What one unit more gives, or what is left until other limits bind if that is less."""
        step, gain = min(1.0, self.reach) if self.reach > _TINY else 1.0, self.gives
        amount = f"{_short(step * gain.amount)} {gain.unit} of {gain.what}"
        return f"{_short(step)} {self.unit} {self.wider} gives {amount}"

    def __str__(self) -> str:
        return f"{self.name} at {_short(self.limit)} {self.unit}; {self.offer}"


def _short(number: float) -> str:
    """Two digits, or all before the point."""
    return f"{number:.0f}" if abs(number) >= 10.0 else f"{number:.2g}"


@dataclass(frozen=True, slots=True)
class Explanation:
    """Which limits bind in a tick, or which contradict each other.

    Attributes:
        cost: sum w |A z - b|^2 / 2 of the tasks.
        binding: the limits that bind, what costs most first.
        contradiction: why no decision keeps all limits; None if one does.
    """

    cost: float
    binding: tuple[BindingLimit, ...]
    contradiction: Contradiction | None = None

    @staticmethod
    def of(problem: Problem) -> Explanation:
        """Of the QP of a tick."""
        try:
            solved = _Solved.of(problem)
        except QpInfeasible:
            return Explanation(np.nan, (), Contradiction.of(problem))
        found = list(_binding(solved))
        return Explanation(solved.cost, tuple(limit for limit, _ in _ranked(found)))

    @property
    def first(self) -> str:
        """What is in the way most; "" if nothing is."""
        if self.contradiction is not None:
            return self.contradiction.name
        return self.binding[0].name if self.binding else ""

    def __str__(self) -> str:
        if self.contradiction is not None:
            return str(self.contradiction)
        if not self.binding:
            return "no limit binds"
        more = f"; {counted(len(self.binding) - 1, 'limit')} more" if self.binding[1:] else ""
        return f"{self.binding[0]}{more}"

    def __repr__(self) -> str:
        return cut(f"<Explanation: {self}>")

    def table(self) -> str:
        """One line for each limit: where it is, its multiplier, what it costs and would give."""
        if self.contradiction is not None:
            return self.contradiction.table()
        if not self.binding:
            return str(self)
        lines = [f"{'limit':<27}{'at':>6}{'multiplier':>18}{'cost':>9}"]
        for row in self.binding:
            at = f"{_short(row.limit):>6} {row.unit:<7}"
            lines.append(f"{row.name:<27}{at}{row.multiplier:>10.3g}{row.cost:>9.3g}  {row.offer}")
        return "\n".join([*lines, f"{'all tasks':<27}{self.cost:>33.3g}"])


def _ranked(found: list[tuple[BindingLimit, float]]) -> list[tuple[BindingLimit, float]]:
    """What costs most first; of what costs about as much as that, what is most unusual."""
    least = ALIKE * max((limit.cost for limit, _ in found), default=0.0)
    dear = [pair for pair in found if pair[0].cost >= least]
    rest = [pair for pair in found if pair[0].cost < least]
    return [*sorted(dear, key=lambda pair: -pair[1]), *sorted(rest, key=lambda pair: -pair[0].cost)]


def multipliers_of(problem: Problem, *, is_relaxed: bool = False) -> Multipliers:
    """The multiplier of every limit; of the relaxed problem where limits gave way.

    Contacts have none there, as a task takes their place.

    Raises:
        QpInfeasible: if there is no solution.
    """
    found = Multipliers()
    places = places_of(problem)
    if is_relaxed:
        found.row[places] = solve_with_multipliers(relaxed_qp(problem))[1]
        return found
    solved = _Solved.of(problem)
    found.row[places] = solved.y
    found.contacts[problem.stance] = solved.contacts
    return found


@dataclass(frozen=True, slots=True)
class _Solved:
    """The QP in accelerations and stance forces, with its equalities, and its optimum."""

    problem: Problem
    qp: DenseQp
    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " rows"]

    @staticmethod
    def of(problem: Problem) -> _Solved:
        Z = np.eye(SIZE)[:, unknowns(problem)]
        qp = dense_qp(problem, Z, np.zeros(SIZE), with_equalities=True)
        return _Solved(problem, qp, *solve_with_multipliers(qp))

    @property
    def z(self) -> Array30:
        z = np.zeros(SIZE)
        z[unknowns(self.problem)] = self.x
        return z

    @property
    def residuals(self) -> Float[np.ndarray, " rows"]:
        return self.problem.tasks.A @ self.z - self.problem.tasks.b

    @property
    def cost(self) -> float:
        return float(self.problem.weights @ self.residuals**2) / 2

    @property
    def contacts(self) -> Float[np.ndarray, " feet"]:
        """The multiplier of what each contact asks for, by (1) with the equalities' E'l."""
        qp, e = self.qp, self.problem.equalities.b[6:].reshape(-1, 3)
        slope = qp.H @ self.x + qp.g + qp.C.T @ self.y
        prices = np.linalg.lstsq(qp.equalities[0].T, -slope, rcond=None)[0][6:].reshape(-1, 3)
        along = (prices * e).sum(axis=1) / np.maximum(np.linalg.norm(e, axis=1), _TINY)
        return np.where(are_hasty(self.problem), along, 0.0)

    def active(self) -> Int[np.ndarray, " k"]:
        """The rows that bind."""
        return np.flatnonzero(np.abs(self.y) > _TINY * max(1.0, np.abs(self.y).max(initial=0.0)))


def _binding(solved: _Solved) -> Iterator[tuple[BindingLimit, float]]:
    """What binds, and how unusual it is."""
    problem, active = solved.problem, solved.active()
    feet = np.flatnonzero(are_hasty(problem)).tolist()
    contacts = [(k, contact_of(problem, k, solved.z)) for k in feet]
    if not (len(active) or contacts):
        return
    e = solved.qp.equalities[1]
    moves = np.zeros((len(active) + len(e), len(active) + len(contacts)))
    sides = np.sign(solved.y[active])
    moves[: len(active), : len(active)] = np.diag(sides)
    for column, (k, limit) in enumerate(contacts, len(active)):
        rows = slice(6 + 3 * k, 9 + 3 * k)
        moves[len(active) :, column][rows] = -e[rows] / limit.limit
    du, dy = sensitivity(solved.qp, active, moves)
    for column, row in enumerate(map(int, active)):
        is_upper = bool(solved.y[row] > 0)
        limit = limit_of(problem, row, solved.z, is_upper=is_upper)
        side = "upper" if is_upper else "lower"
        without = _without(solved, row, is_upper=is_upper)
        yield _told(solved, limit, side, without, du[:, column], dy[:, column]), limit.unusual
    for column, (k, limit) in enumerate(contacts, len(active)):
        without = _afloat(problem, k)
        yield _told(solved, limit, "lower", without, du[:, column], dy[:, column]), limit.unusual


def _told(
    solved: _Solved, limit: Limit, side: str, without: float, du: np.ndarray, dy: np.ndarray
) -> BindingLimit:
    """A limit, and what is lost and gained by it: ``without`` it the cost, du and dy of (2)."""
    problem, r = solved.problem, solved.residuals
    dr = limit.per_row * problem.tasks.A[:, unknowns(problem)] @ du
    gains = -problem.weights * r * dr
    if gains.sum() < 0.0:  # a contact that would better stop its foot faster
        gains, du, dy, side = -gains, -du, -dy, "upper"
    best = int(np.argmax(gains))
    what, unit = task_labels(problem)[best]
    gain = Gain(what, abs(float(dr[best])), abs(float(r[best])), unit)
    reach = _reach(solved, du, dy) / limit.per_row
    multiplier, cost = float(gains.sum()), max(solved.cost - without, 0.0)
    return BindingLimit(
        limit.name, side, limit.value, limit.limit, limit.unit, multiplier, gain, reach, cost
    )


def sensitivity(
    qp: DenseQp, active: Int[np.ndarray, " k"], moves: Float[np.ndarray, "q m"]
) -> tuple[Float[np.ndarray, "n m"], Float[np.ndarray, "k m"]]:
    """du and dy of (2).

    Args:
        active: which rows bind.
        moves: by how much their bounds move, and then the right sides of the equalities; a column
            for each question.
    """
    n, rows = len(qp.g), np.concatenate([qp.C[active], qp.equalities[0]])
    K = np.block([[qp.H, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    right = np.concatenate([np.zeros((n, moves.shape[1])), moves])
    moved = np.linalg.lstsq(K, right, rcond=None)[0]
    return moved[:n], moved[n : n + len(active)]


def _reach(solved: _Solved, du: Float[np.ndarray, " n"], dy: Float[np.ndarray, " k"]) -> float:
    qp, active = solved.qp, solved.active()
    value, rate, y = qp.C @ solved.x, qp.C @ du, solved.y[active]
    rate[active] = 0.0
    lets_go = -np.sign(y) * dy
    up, down, off = rate > _TINY, rate < -_TINY, lets_go > _TINY
    steps = (
        (qp.upper - value)[up] / rate[up],
        (qp.lower - value)[down] / rate[down],
        np.abs(y)[off] / lets_go[off],
    )
    return max(float(np.concatenate(steps).min(initial=np.inf)), 0.0)


def _without(solved: _Solved, row: int, *, is_upper: bool) -> float:
    """The least cost without a limit."""
    bounds = solved.problem.bounds
    lower, upper, rows = (
        bounds.lower.copy(),
        bounds.upper.copy(),
        rows_of_limit(solved.problem, row),
    )
    if is_upper:
        upper[rows] = np.inf
    else:
        lower[rows] = -np.inf
    return _Solved.of(replace(solved.problem, bounds=Bounds(bounds.C, lower, upper))).cost


def _afloat(problem: Problem, place: int) -> float:
    """The least cost if a foot that stands could bear its load without standing still."""
    rows, E, t = np.s_[6 + 3 * place : 9 + 3 * place], problem.equalities, problem.tasks
    # a trace of them stays, or the leg's accelerations would be free
    tasks = Rows(np.concatenate([t.A, E.A[rows]]), np.concatenate([t.b, E.b[rows]]))
    weights = np.concatenate([problem.weights, np.full(3, _TRACE)])
    rest = Rows(np.delete(E.A, rows, axis=0), np.delete(E.b, rows))
    return _Solved.of(replace(problem, tasks=tasks, weights=weights, equalities=rest)).cost


def task_labels(problem: Problem) -> list[tuple[str, str]]:
    """What each row of the tasks is of, and its unit."""
    legs = problem.reference.legs
    swing = [LEGS[k].name for k in range(4) if legs[k] is LegTask.SWING]
    stance = [LEGS[k].name for k in range(4) if legs[k] is LegTask.STANCE]
    raised = [k for k in range(4) if legs[k] is LegTask.JOINTS]
    words = (
        (BodyPosition, ["trunk x", "trunk y", "trunk height"]),
        (BodyOrientation, ["trunk roll", "trunk pitch", "trunk yaw"]),
        (SwingFoot, [f"{leg} foot {axis}" for leg in swing for axis in "xyz"]),
        (LegPosture, [JOINT_WORDS[3 * k + i] for k in raised for i in range(3)]),
        (ForceRegularisation, [f"{leg} force {axis}" for leg in stance for axis in "xyz"]),
    )
    labels = list[tuple[str, str]]()
    for source, count in zip(problem.sources, problem.counts, strict=True):
        if not isinstance(source, Task):
            break
        own = [f"{source.name} {k + 1}" if count > 1 else source.name for k in range(count)]
        known = next((names for kind, names in words if isinstance(source, kind)), own)
        labels += [(name, source.unit) for name in known]
    return labels
