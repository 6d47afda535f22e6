"""A plan as the start of the search for another: the same phases, asked for a little more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.errors import TimelineError
from go2_wbc.robot.model import RobotModel
from motions.dynamics.dynamic_trajectory import DynamicTrajectory
from motions.dynamics.phases import PhaseProblem


@dataclass(frozen=True, slots=True)
class Solved:
    """A problem and its plan.

    Attributes:
        problem: what was asked.
        plan: what was found.
    """

    problem: PhaseProblem
    plan: DynamicTrajectory


@dataclass(frozen=True, slots=True)
class Start:
    """Where a search begins.

    Attributes:
        x: (n+1, 37) states, q and v.
        tau: (n, 12) torques [N m].
    """

    x: Float[np.ndarray, "n1 37"]
    tau: Float[np.ndarray, "n 12"]


def continued(
    solved: Solved, problem: PhaseProblem, times: Float[np.ndarray, " n1"], model: RobotModel
) -> Start:
    """The plan of ``solved`` at the knots ``times`` [s] of ``problem``.

    Each knot is where it was as a share of its phase, so phases may last longer or shorter.

    Raises:
        TimelineError: if the two problems differ in which feet stand in which phase.
    """
    asked, known = ([phase.stance for phase in one.phases] for one in (problem, solved.problem))
    if asked != known:
        raise TimelineError(
            f"a plan of {len(known)} phases is no start for these {len(asked)}: the same feet must "
            "stand, phase by phase"
        )
    plan = solved.plan
    at = np.interp(times, _ends(problem), _ends(solved.problem))
    rows = np.clip(np.searchsorted(plan.times, at + SAME, side="right") - 1, 0, len(plan.tau) - 1)
    shares = np.clip((at - plan.times[rows]) / np.diff(plan.times)[rows], 0.0, 1.0)
    q = [
        pin.interpolate(model.pin_model, plan.q[row], plan.q[row + 1], share)
        for row, share in zip(rows.tolist(), shares.tolist(), strict=True)
    ]
    v = plan.v[rows] + shares[:, None] * (plan.v[rows + 1] - plan.v[rows])
    return Start(np.hstack([np.array(q), v]), plan.tau[rows[:-1]])


SAME = 1e-9
"""Time [s] by which rounding may put a knot before its phase."""


def _ends(problem: PhaseProblem) -> Float[np.ndarray, " k"]:
    """When [s] the phases begin, and the last one ends."""
    return np.cumsum([0.0, *(phase.duration for phase in problem.phases)])
