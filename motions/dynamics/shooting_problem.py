"""The optimal control problem of a dynamic motion, in crocoddyl.

Full rigid-body dynamics with point contacts at the feet's centres, integrated by semi-implicit
Euler from knot to knot. A foot that touches down has its speed taken within one knot by the
contact's damping (50 /s at knots of 20 ms), so no impulse model is needed; the cost of its speed
there makes it small. Torques are bounded as such, everything else by quadratic barriers, except for
the motors' line, which depends on speed: ``allowed`` takes the speeds of the last solution.

It is solved by a ladder of starts, then rounds for the motors' line, in a time budget.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import product

import crocoddyl
import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from go2_wbc.errors import PlanNotFound
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS, Leg
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternion_from_rpy
from go2_wbc.robot.state import RobotState
from motions.dynamics.knots import Goal, Knots, Solution
from motions.dynamics.phases import FullState, Progress
from motions.dynamics.plan_audit import PlanLimits, Weights

FACETS = 8
"""Of the friction cone; four outside it let 0.61 pass for 0.5, eight inside it keep 0.50."""
CONTACT_GAINS = np.array([250.0, 50.0])
"""Of a contact's position and velocity error [1/s^2], [1/s]. The second takes a foot's speed within
one knot; the first takes a tenth of what it has drifted, without which feet sink by 5 mm and half
as many iterations again are needed (own experiments)."""
_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
_INFINITE = np.inf


class ShootingProblem:
    """A problem at its knots as crocoddyl's shooting problem.

    Attributes:
        problem: crocoddyl's.
        motor: what the motors give, at the share that plans may use.
        motor_at_end: the same at the speeds at the end of a step.
        tau_hold: (12,) torques [N m] that hold the robot standing: first controls everywhere.
    """

    def __init__(
        self, knots: Knots, model: RobotModel, limits: PlanLimits, weights: Weights
    ) -> None:
        self._knots, self._model, self._limits, self._weights = knots, model, limits, weights
        self.motor = model.motor.scaled(limits.torque_share)
        self.motor_at_end = model.motor.scaled(limits.end_share)
        self._state = crocoddyl.StateMultibody(model.pin_model)
        self._actuation = crocoddyl.ActuationModelFloatingBase(self._state)
        self._feet = [model.pin_model.getFrameId(name) for name in FOOT_NAMES]
        self._knees = [model.pin_model.getFrameId(name) for name in JOINT_NAMES[2::3]]
        self.tau_hold = standing_torques(model, knots.initial)
        goals = {goal.knot: goal for goal in knots.goals}
        steps = np.diff(knots.times).tolist()
        self._models = [self._running(k, dt, goals.get(k)) for k, dt in enumerate(steps)]
        terminal = self._terminal(goals[len(steps)])
        x0 = np.concatenate([knots.initial.q, knots.initial.v])
        self.problem = crocoddyl.ShootingProblem(x0, self._models, terminal)
        self.bound(*self.allowed(np.zeros((len(steps) + 1, 12))))

    def allowed(
        self, rates: Float[np.ndarray, "n1 12"]
    ) -> tuple[Float[np.ndarray, "n 12"], Float[np.ndarray, "n 12"]]:
        """Least and greatest torque [N m] of every step at joint speeds ``rates`` [rad/s] of knots.

        A torque holds through its step, while the speed goes from that of its knot to the next.
        """
        before, after = rates[:-1], rates[1:]
        ranges = [self.motor.limits(v) for v in (before, 0.5 * (before + after))]
        ranges.append(self.motor_at_end.limits(after))
        lower, upper = zip(*ranges, strict=True)
        return np.max(lower, axis=0), np.min(upper, axis=0)

    def used(self, tau: Float[np.ndarray, "n 12"], rates: Float[np.ndarray, "n1 12"]) -> float:
        """The greatest share of what is allowed that torques ``tau`` [N m] of the steps use."""
        before, after = rates[:-1], rates[1:]
        shares = [self.motor.share(tau, v).max() for v in (before, 0.5 * (before + after))]
        return float(max(*shares, self.motor_at_end.share(tau, after).max()))

    def bound(self, lower: Float[np.ndarray, "n 12"], upper: Float[np.ndarray, "n 12"]) -> None:
        """Bound the torques [N m] of every step."""
        for row, model in enumerate(self._models):
            model.u_lb, model.u_ub = lower[row], upper[row]

    def _running(
        self, knot: int, dt: float, goal: Goal | None
    ) -> crocoddyl.IntegratedActionModelEuler:
        stance = self._knots.stance[knot]
        contacts = crocoddyl.ContactModelMultiple(self._state, 12)
        costs = crocoddyl.CostModelSum(self._state, 12)
        for leg in LEGS:
            if stance[leg]:
                self._add_contact(contacts, costs, leg, self._knots.p_stance[knot, leg])
        self._add_effort(costs, knot)
        self._add_limits(costs)
        self._add_heights(costs, knot, stance)
        if goal is not None:
            self._add_goal(costs, goal, dt)
        return self._integrated(contacts, costs, dt)

    def _terminal(self, goal: Goal) -> crocoddyl.IntegratedActionModelEuler:
        contacts = crocoddyl.ContactModelMultiple(self._state, 12)
        costs = crocoddyl.CostModelSum(self._state, 12)
        self._add_goal(costs, goal, 1.0)
        final = self._knots.final
        residual = crocoddyl.ResidualModelState(self._state, np.concatenate([final.q, final.v]), 12)
        self._add(costs, "end", residual, self._weights.end)
        return self._integrated(contacts, costs, 0.0)

    def _integrated(
        self, contacts: crocoddyl.ContactModelMultiple, costs: crocoddyl.CostModelSum, dt: float
    ) -> crocoddyl.IntegratedActionModelEuler:
        dynamics = crocoddyl.DifferentialActionModelContactFwdDynamics(
            self._state, self._actuation, contacts, costs, 0.0, True
        )
        return crocoddyl.IntegratedActionModelEuler(dynamics, dt)

    def _add_contact(
        self,
        contacts: crocoddyl.ContactModelMultiple,
        costs: crocoddyl.CostModelSum,
        leg: Leg,
        p_foot: Float[np.ndarray, "3"],
    ) -> None:
        frame, name = self._feet[leg], FOOT_NAMES[leg]
        contact = crocoddyl.ContactModel3D(self._state, frame, p_foot, _ALIGNED, 12, CONTACT_GAINS)
        contacts.addContact(name, contact)
        limits = self._limits
        cone = crocoddyl.FrictionCone(
            np.eye(3), limits.friction, FACETS, True, 0.0, limits.force_max
        )
        residual = crocoddyl.ResidualModelContactFrictionCone(self._state, frame, cone, 12)
        barrier = _barrier(cone.lb, cone.ub)
        self._add(costs, f"{name}_cone", residual, self._weights.friction, barrier)

    def _add_effort(self, costs: crocoddyl.CostModelSum, knot: int) -> None:
        """Torques near standing, and near the first guess."""
        knots, weights = self._knots, self._weights
        self._add(
            costs, "torque", crocoddyl.ResidualModelControl(self._state, self.tau_hold),
            weights.torque,
        )  # fmt: skip
        scale = np.repeat([weights.track, weights.posture, weights.speed], [6, 12, 18])
        posture = crocoddyl.ResidualModelState(
            self._state, np.concatenate([knots.q[knot], knots.v[knot, :6], np.zeros(12)]), 12
        )
        activation = crocoddyl.ActivationModelWeightedQuad(scale)
        self._add(costs, "posture", posture, 1.0, activation)

    def _add_limits(self, costs: crocoddyl.CostModelSum) -> None:
        model, limits, weights = self._model, self._limits, self._weights
        free = np.full(6, _INFINITE)
        lower, upper = model.q_lower + limits.joint_margin, model.q_upper - limits.joint_margin
        speed = limits.speed_share * model.speed_limits
        barrier = _barrier(
            np.concatenate([-free, lower, -free, -speed]),
            np.concatenate([free, upper, free, speed]),
            np.repeat([0.0, weights.joint_range, 0.0, weights.joint_speed], [6, 12, 6, 12]),
        )
        residual = crocoddyl.ResidualModelState(self._state, self._state.zero(), 12)
        self._add(costs, "limits", residual, 1.0, barrier)

    def _add_heights(
        self, costs: crocoddyl.CostModelSum, knot: int, stance: Bool[np.ndarray, "4"]
    ) -> None:
        weights, ground = self._weights, self._model.foot_radius
        for leg in LEGS:
            self._add_height(costs, self._knees[leg], self._limits.knee_height, weights.ground)
            if stance[leg]:
                continue
            least = float(self._knots.clearance[knot, leg])
            weight = weights.ground if least == ground else weights.clearance
            self._add_height(costs, self._feet[leg], least, weight)

    def _add_height(
        self, costs: crocoddyl.CostModelSum, frame: int, least: float, weight: float
    ) -> None:
        residual = crocoddyl.ResidualModelFrameTranslation(self._state, frame, np.zeros(3), 12)
        barrier = _barrier(np.array([-_INFINITE, -_INFINITE, least]), np.full(3, _INFINITE))
        self._add(costs, f"height_{frame}", residual, weight, barrier)

    def _add_goal(self, costs: crocoddyl.CostModelSum, goal: Goal, dt: float) -> None:
        """What is asked at one knot, so its cost does not depend on how long the knot lasts."""
        weights = self._weights
        for leg in LEGS:
            frame = self._feet[leg]
            if goal.asked[leg]:
                residual = crocoddyl.ResidualModelFrameTranslation(
                    self._state, frame, goal.p_feet[leg], 12
                )
                self._add(costs, f"place_{frame}", residual, weights.foot_place / dt)
            if goal.lands[leg]:
                residual = crocoddyl.ResidualModelFrameVelocity(
                    self._state, frame, pin.Motion.Zero(), _ALIGNED, 12
                )
                activation = crocoddyl.ActivationModelWeightedQuad(np.repeat([1.0, 0.0], 3))
                self._add(costs, f"speed_{frame}", residual, weights.foot_speed / dt, activation)
        if goal.pose is not None:
            x = np.concatenate([self._knots.initial.q, np.zeros(18)])
            x[:3], x[3:7] = goal.pose[:3], quaternion_from_rpy(*goal.pose[3:].tolist())
            activation = crocoddyl.ActivationModelWeightedQuad(np.repeat([1.0, 0.0], [6, 30]))
            residual = crocoddyl.ResidualModelState(self._state, x, 12)
            self._add(costs, "trunk", residual, weights.trunk / dt, activation)

    def _add(
        self,
        costs: crocoddyl.CostModelSum,
        name: str,
        residual: crocoddyl.ResidualModelAbstract,
        weight: float,
        activation: crocoddyl.ActivationModelAbstract | None = None,
    ) -> None:
        if activation is None:
            cost = crocoddyl.CostModelResidual(self._state, residual)
        else:
            cost = crocoddyl.CostModelResidual(self._state, activation, residual)
        costs.addCost(name, cost, weight)


def standing_torques(model: RobotModel, state: FullState) -> Float[np.ndarray, "12"]:
    """Joint torques [N m] that hold the robot on its four feet, with the least foot forces."""
    zeros = np.zeros(4)
    measured = RobotState(0.0, state.q, state.v, np.zeros(12), zeros, zeros.astype(bool))
    snapshot = model.pinocchio_snapshot(measured)
    J = snapshot.J_feet.reshape(-1, 18)
    forces = np.linalg.lstsq(J[:, :6].T, snapshot.bias[:6], rcond=None)[0]
    return snapshot.bias[6:] - J[:, 6:].T @ forces


def _barrier(
    lower: Float[np.ndarray, " n"],
    upper: Float[np.ndarray, " n"],
    weights: Float[np.ndarray, " n"] | None = None,
) -> crocoddyl.ActivationModelAbstract:
    """Quadratic beyond the bounds, nothing between them."""
    bounds = crocoddyl.ActivationBounds(lower, upper)
    if weights is None:
        return crocoddyl.ActivationModelQuadraticBarrier(bounds)
    return crocoddyl.ActivationModelWeightedQuadraticBarrier(bounds, weights)


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
    """

    def __init__(
        self,
        budget: float,
        progress: Progress | None,
        binds: Callable[[crocoddyl.SolverBoxFDDP], Sequence[str]],
    ) -> None:
        """Start; the budget is processor time [s]; ``binds`` says what is still in the way."""
        super().__init__()
        self.iterations = 0  #: done so far
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
