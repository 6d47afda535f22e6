"""Solving a program: a ladder of starts, then rounds for the motors' line; in a time budget."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import product

import crocoddyl
import numpy as np
from jaxtyping import Float

from go2_wbc.errors import PlanNotFound
from go2_wbc.legs import FOOT_NAMES, LEGS
from motions.dynamics.knots import Knots, Solution
from motions.dynamics.phases import Progress
from motions.dynamics.shooting_problem import ShootingProblem

ITERATIONS = 120  #: Of one start; what converges does so in fewer (own experiments)
REGULARISATIONS = (1e-2, 1e-1, 1e-3)
"""First regularisations, in the order in which they are tried (own experiments)."""
SOFT_STOP, STOP = 1e-2, 1e-3
"""Expected improvement of the cost below which a softened and a full program are done."""
LINE_ROUNDS = 4  #: Rounds in which torque bounds and speeds are made to agree
AGREED = 1.05
"""Torque over what the plan may use at its speeds with which it is done: 0.89 of what the motors
give in the middle of a step, all of it at its end (``PlanLimits``). Exact agreement takes many
rounds."""
FIRST_ANSWER = 0.45  #: Processor time [s] of a search after which it says what binds so far
_JOINT_RATES = slice(19 + 6, None)
_log = logging.getLogger(__name__)

_Rows = list[Float[np.ndarray, " n"]]


class _Expired(Exception):
    """The time is up."""


class Clock(crocoddyl.CallbackAbstract):
    """Counts the iterations of solvers, tells, and stops them when time is up.

    It knows no solver: solvers hold their callbacks where Python's garbage collector does not look,
    so that a way back would keep both for ever.

    Attributes:
        iterations: done so far.
    """

    def __init__(
        self,
        budget: float,
        progress: Progress | None,
        binds: Callable[[crocoddyl.SolverBoxFDDP], Sequence[str]],
    ) -> None:
        """Start; the budget is processor time [s]; ``binds`` says what is still in the way."""
        super().__init__()
        self.iterations = 0
        self._deadline = time.thread_time() + budget
        self._first = time.thread_time() + FIRST_ANSWER
        self._progress, self._binds = progress, binds

    def __call__(self, solver: crocoddyl.SolverBoxFDDP) -> None:
        """Called after every iteration."""
        self.iterations += 1
        if self._progress is not None:
            self._progress(self.iterations, float(solver.cost))
        if time.thread_time() > self._first:
            self._first = math.inf
            _log.info("no plan yet; what binds: %s", "; ".join(self._binds(solver)) or "nothing")
        if time.thread_time() > self._deadline:
            raise _Expired


class Search:
    """Solves one program."""

    def __init__(
        self,
        soft: ShootingProblem,
        full: ShootingProblem,
        knots: Knots,
        *,
        objections: Callable[[Solution], list[str]],
        turns: Callable[[Solution], bool],
        budget: float,
        progress: Progress | None,
        start: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        """Prepare; the budget, processor time [s], runs from here; ``start`` is tried first.

        ``objections`` says what is against a solution. One without any may be taken although the
        solver has not converged: it obeys the dynamics, and what more it could gain is only cost.
        ``turns`` says whether a solution turns as often as it was asked to: the costs cannot tell,
        so that one that has converged may not.
        """
        self._objections, self._turns = objections, turns
        self._full, self._knots, self._budget = full, knots, budget
        self._start = start
        self._clock = Clock(budget, progress, lambda now: objections(_found(now, full, knots, 0)))
        self._soft_solver, self._solver = self._solver_of(soft), self._solver_of(full)

    def _solver_of(self, program: ShootingProblem) -> crocoddyl.SolverBoxFDDP:
        solver = crocoddyl.SolverBoxFDDP(program.problem)
        solver.setCallbacks([self._clock])
        return solver

    def run(self) -> Solution:
        """A solution.

        Raises:
            PlanNotFound: if no start converges, or time is up.
        """
        try:
            self._climb()
            self._agree()
        except _Expired:
            raise PlanNotFound(
                f"no dynamic plan within {self._budget:g} s of processor time "
                f"({self._clock.iterations} iterations); ask for less, or give a larger budget"
            ) from None
        return self._best()

    def best(self) -> Solution | None:
        """Where the search is, if that obeys the dynamics."""
        solver = self._solver
        is_whole = bool(len(solver.xs)) and solver.isFeasible and np.isfinite(solver.cost)
        return self._best() if is_whole else None

    def _best(self) -> Solution:
        return _found(self._solver, self._full, self._knots, self._clock.iterations)

    def _climb(self) -> None:
        """Starts, from the one that most often works to the last resort."""
        for xs, us, regularisation in self._starts():
            converges = self._solve(self._solver, xs, us, regularisation, STOP)
            best = self.best()
            if best is None:
                continue
            if self._turns(best) if converges else not self._objections(best):
                return
        raise PlanNotFound(
            "no dynamic plan: none of the starts converges to a motion that turns as asked "
            f"({self._clock.iterations} iterations); the phases ask for more than the robot can do"
        )

    def _starts(self) -> Iterator[tuple[_Rows, _Rows, float]]:
        """States, torques and regularisation of every start of the full program."""
        knots, soft = self._knots, self._soft_solver
        if self._start is not None:
            xs, us = map(list, self._start)
            yield xs, us, REGULARISATIONS[0]
            self._solve(soft, xs, us, REGULARISATIONS[0], SOFT_STOP)
            yield list(soft.xs), list(soft.us), REGULARISATIONS[0]
        guess = list(np.hstack([knots.q, knots.v]))
        still = [guess[0]] * len(guess)
        us = [self._full.tau_hold] * (len(guess) - 1)
        starts = product(zip(("a guess", "rest"), (guess, still), strict=True), REGULARISATIONS)
        for (what, xs), regularisation in starts:
            _log.info("trying to begin from %s, regularisation %g", what, regularisation)
            self._solve(soft, xs, us, regularisation, SOFT_STOP)
            yield list(soft.xs), list(soft.us), regularisation

    def _agree(self) -> None:
        """Bound the torques by the greatest speeds of the solutions until they agree."""
        program = self._full
        lower, upper = program.allowed(np.zeros((len(self._knots.times), 12)))
        for _ in range(LINE_ROUNDS):
            x, us = np.array(self._solver.xs), np.array(self._solver.us)
            rates = x[:, _JOINT_RATES]
            if program.used(us, rates) <= AGREED:
                return
            least, most = program.allowed(rates)
            lower, upper = np.maximum(lower, least), np.minimum(upper, most)
            program.bound(lower, upper)
            us = np.clip(us, lower, upper)
            self._solve(self._solver, list(x), list(us), REGULARISATIONS[0], STOP)

    def _solve(
        self,
        solver: crocoddyl.SolverBoxFDDP,
        xs: list[np.ndarray],
        us: list[np.ndarray],
        regularisation: float,
        stop: float,
    ) -> bool:
        solver.th_stop = stop
        converged = solver.solve(xs, us, ITERATIONS, False, regularisation)
        return bool(converged and solver.isFeasible and np.isfinite(solver.cost))


def _found(
    solver: crocoddyl.SolverBoxFDDP, program: ShootingProblem, knots: Knots, iterations: int
) -> Solution:
    """Where ``solver`` is, with the forces that go with it."""
    problem = program.problem
    problem.calc(solver.xs, solver.us)
    forces = np.zeros((len(knots.stance), 4, 3))
    for row, data in enumerate(problem.runningDatas):
        contacts = data.differential.multibody.contacts.contacts.todict()
        for leg in LEGS:
            if knots.stance[row, leg]:
                forces[row, leg] = contacts[FOOT_NAMES[leg]].f.linear
    return Solution(
        np.array(solver.xs), np.array(solver.us), forces, np.array(solver.K),
        iterations, float(solver.cost),
    )  # fmt: skip
