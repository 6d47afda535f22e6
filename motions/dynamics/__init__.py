"""Dynamic motions: phases with flight or few feet, solved as whole-body trajectory optimisation.

The solver is crocoddyl, an optional extra: ``pip install go2-wbc[dynamics]``. Only solving needs
it; phases can be written, and solved trajectories read, without it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from motions.dynamics.cache import solve_cached
    from motions.dynamics.continuation import Solved
    from motions.dynamics.curves import pieces
    from motions.dynamics.limits import PlanLimits
    from motions.dynamics.phases import FullState, Phase, PhaseProblem, Tolerance
    from motions.dynamics.solver import solve
    from motions.dynamics.trajectory import DynamicTrajectory, Miss
    from motions.dynamics.verdict import Reading, audit

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

__getattr__ = lazy_exports(
    __name__,
    {
        "cache": ("solve_cached",),
        "limits": ("PlanLimits",),
        "phases": ("FullState", "Phase", "PhaseProblem", "Tolerance"),
        "continuation": ("Solved",),
        "curves": ("pieces",),
        "solver": ("solve",),
        "trajectory": ("DynamicTrajectory", "Miss"),
        "verdict": ("Reading", "audit"),
    },
)
