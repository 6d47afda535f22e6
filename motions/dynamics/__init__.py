"""Dynamic motions: phases with flight or few feet, solved as whole-body trajectory optimisation.

The solver is crocoddyl, an optional extra: ``pip install go2-wbc[dynamics]``. Only solving needs
it; phases can be written, and solved trajectories read, without it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from motions.dynamics.dynamic_trajectory import DynamicTrajectory, Miss, pieces
    from motions.dynamics.phases import FullState, Phase, PhaseProblem, Tolerance
    from motions.dynamics.plan_audit import PlanLimits, Reading, audit
    from motions.dynamics.plan_cache import solve_cached
    from motions.dynamics.solver import Solved, solve

__all__ = [
    "DynamicTrajectory",
    "FullState",
    "Miss",
    "Phase",
    "PhaseProblem",
    "PlanLimits",
    "Reading",
    "Solved",
    "Tolerance",
    "audit",
    "pieces",
    "solve",
    "solve_cached",
]

__getattr__ = lazy_exports(__name__)
