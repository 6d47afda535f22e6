"""The engine: whole-body control of the Unitree Go2.

Its public names, each imported when it is first used.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from go2_wbc.config import Config, load_config
    from go2_wbc.contacts import GAITS, ContactSchedule, Gait
    from go2_wbc.errors import Go2WbcError, MotionInfeasible, QpInfeasible
    from go2_wbc.legs import LEGS, Leg
    from go2_wbc.motion_plan import MotionPlan, Posture, Stance
    from go2_wbc.planning.command import VelocityCommand
    from go2_wbc.planning.locomotion import LocomotionPlanner
    from go2_wbc.plant import MujocoPlant, Plant
    from go2_wbc.recording import Recording
    from go2_wbc.reference import JointReference, Reference
    from go2_wbc.robot.model import RobotModel
    from go2_wbc.robot.state import JointCommand, RobotState, Snapshot
    from go2_wbc.wbc.config import WbcConfig
    from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
    from go2_wbc.wbc.explanation import Explanation
    from go2_wbc.wbc.tasks import Task
    from go2_wbc.world import World

__all__ = [
    "GAITS",
    "LEGS",
    "Config",
    "ContactSchedule",
    "Explanation",
    "Gait",
    "Go2WbcError",
    "JointCommand",
    "JointReference",
    "Leg",
    "LocomotionPlanner",
    "MotionInfeasible",
    "MotionPlan",
    "MujocoPlant",
    "Plant",
    "Posture",
    "QpInfeasible",
    "Recording",
    "Reference",
    "RobotModel",
    "RobotState",
    "Snapshot",
    "Stance",
    "Task",
    "VelocityCommand",
    "WbcConfig",
    "WbcSolution",
    "WholeBodyController",
    "World",
    "__version__",
    "load_config",
]

__version__: str

_public = lazy_exports(__name__)


def _require_not_hidden(*packages: str) -> None:
    """Raise ImportError if a file of the user's is imported in place of a package of ours."""
    for name in packages:
        spec = find_spec(name)
        if spec and spec.origin and Path(spec.origin).parents[1] != Path(__file__).parents[1]:
            raise ImportError(
                f"{spec.origin} hides the package {name!r} of go2-wbc: rename it, "
                f"for example to my_{name}"
            )


_require_not_hidden("controller", "motions", "viz")


def __getattr__(name: str) -> object:
    """A public name, or the version of the installed distribution."""
    if name == "__version__":
        from importlib.metadata import version

        return version("go2-wbc")
    return _public(name)
