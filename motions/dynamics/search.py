"""Solving a program: a ladder of starts, then rounds for the motors' line; in a time budget."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import crocoddyl
import numpy as np
from jaxtyping import Float

from go2_wbc.errors import PlanNotFound
from go2_wbc.legs import FOOT_NAMES, LEGS
from motions.dynamics.knots import Knots
from motions.dynamics.program import Program

ITERATIONS = 100
"""Of one start; what converges does so in fewer (own experiments)."""
REGULARISATIONS = (1e-1, 1e-3, 1e-9)
"""First regularisations to try: a strong one for a rough guess; the last is the solver's own."""
SOFT = 1e-2
"""Share of the cost of forces outside the cone with which a start begins: the full cost is so steep
that from a rough guess it takes five times the iterations, if it converges at all."""
SOFT_STOP, STOP = 1e-2, 1e-3
"""Expected improvement of the cost below which a soft and a full solution are done."""
LINE_ROUNDS = 4
"""Rounds in which torque bounds and speeds are made to agree."""

Progress = Callable[[int, float], None]


@dataclass(frozen=True, slots=True)
class Found:
    """A solution at its knots: states, torques, forces, gains, and what it took."""

    x: Float[np.ndarray, "n1 37"]
    tau: Float[np.ndarray, "n 12"]
    forces: Float[np.ndarray, "n 4 3"]
    gains: Float[np.ndarray, "n 12 36"]
    iterations: int
    cost: float


class _Expired(Exception):
    """The time is up."""


class Search:
    """Solves one program.

    Attributes:
        iterations: done so far, over all starts.
    """

    def __init__(
        self, program: Program, knots: Knots, *, budget: float, progress: Progress | None
    ) -> None:
        """Prepare; the budget [s] runs from here."""
        self.iterations = 0
        self._program, self._knots, self._budget = program, knots, budget
        self._deadline = time.monotonic() + budget
        self._progress = progress
        self._solver = crocoddyl.SolverBoxFDDP(program.problem)
        self._watch = _watch(self)
        self._solver.setCallbacks([self._watch])

    def run(self) -> Found:
        """A solution.

        Raises:
            PlanNotFound: if no start converges, or time is up.
        """
        try:
            self._climb()
            self._agree()
        except _Expired:
            raise PlanNotFound(
                f"no dynamic plan within {self._budget:g} s ({self.iterations} iterations); "
                "ask for less, or give a larger budget"
            ) from None
        return self._found()

    def step(self) -> None:
        """Count an iteration, tell, and stop when time is up."""
        self.iterations += 1
        if self._progress is not None:
            self._progress(self.iterations, float(self._solver.cost))
        if time.monotonic() > self._deadline:
            raise _Expired

    def _climb(self) -> None:
        """Starts, from the one that most often works to the last resort."""
        knots = self._knots
        guess = list(np.hstack([knots.q, knots.v]))
        still = [guess[0]] * len(guess)
        us = [self._program.tau_hold] * (len(guess) - 1)
        for xs, regularisation in product((guess, still), REGULARISATIONS):
            self._program.soften(SOFT)
            self._solve(xs, us, regularisation, SOFT_STOP)
            self._program.soften(1.0)
            if self._solve(list(self._solver.xs), list(self._solver.us), regularisation, STOP):
                return
        raise PlanNotFound(
            f"no dynamic plan: none of the starts converges ({self.iterations} iterations); the "
            "phases ask for more than the robot can do"
        )

    def _agree(self) -> None:
        """Bound the torques by the speeds of the solution until both agree."""
        for _ in range(LINE_ROUNDS):
            x, us = np.array(self._solver.xs), np.array(self._solver.us)
            self._program.bound(x[:-1, 19 + 6 :])
            bounds = [(m.u_lb, m.u_ub) for m in self._program.problem.runningModels]
            over = max(
                float(np.maximum(lower - u, u - upper).max())
                for u, (lower, upper) in zip(us, bounds, strict=True)
            )
            if over < AGREED:
                return
            clipped = [np.clip(u, *bound) for u, bound in zip(us, bounds, strict=True)]
            self._solve(list(x), clipped, REGULARISATIONS[0], STOP)

    def _solve(
        self, xs: list[np.ndarray], us: list[np.ndarray], regularisation: float, stop: float
    ) -> bool:
        solver = self._solver
        solver.th_stop = stop
        converged = solver.solve(xs, us, ITERATIONS, False, regularisation)
        return bool(converged and solver.isFeasible and np.isfinite(solver.cost))

    def _found(self) -> Found:
        solver, problem = self._solver, self._program.problem
        problem.calc(solver.xs, solver.us)
        forces = np.zeros((len(self._knots.stance), 4, 3))
        for row, data in enumerate(problem.runningDatas):
            contacts = data.differential.multibody.contacts.contacts.todict()
            for leg in LEGS:
                if self._knots.stance[row, leg]:
                    forces[row, leg] = contacts[FOOT_NAMES[leg]].f.linear
        return Found(
            np.array(solver.xs), np.array(solver.us), forces, np.array(solver.K),
            self.iterations, float(solver.cost),
        )  # fmt: skip


AGREED = 0.5
"""Torque [N m] over the bounds of its own speed that counts as none."""


def _watch(search: Search) -> crocoddyl.CallbackAbstract:
    class Watch(crocoddyl.CallbackAbstract):
        def __call__(self, solver: object) -> None:
            search.step()

    return Watch()
