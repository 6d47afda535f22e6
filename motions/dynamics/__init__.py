"""Dynamic motions: phases with flight or few feet, solved as whole-body trajectory optimisation.

The solver is crocoddyl, an optional extra: ``pip install go2-wbc[dynamics]``. Only solving needs
it; phases can be written, and solved trajectories read, without it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from motions.dynamics.phases import FullState, Phase, PhaseProblem, Tolerance
    from motions.dynamics.trajectory import DynamicTrajectory, Miss

__all__ = [
    "DynamicTrajectory",
    "FullState",
    "Miss",
    "Phase",
    "PhaseProblem",
    "Tolerance",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "phases": ("FullState", "Phase", "PhaseProblem", "Tolerance"),
        "trajectory": ("DynamicTrajectory", "Miss"),
    },
)
