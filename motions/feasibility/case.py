"""What is judged: a movement of a robot in a world, and the forces that it takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.brief import brief
from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions.feasibility.report import Series
from motions.plan.trajectory import Trajectory

JOINTS = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
FEET = tuple(leg.name for leg in LEGS)


@dataclass(frozen=True, slots=True)
class Forces:
    """What the ground and the motors must give.

    Attributes:
        contact: (n, 4, 3) forces on the feet in the frame of the motion [N].
        tau: (n, 12) joint torques [N m].
        missing: (n, 2) part of the force [N] and of the moment [N m] that the feet cannot give.
        zmp: (n, 2) zero-moment point on the ground [m].
        wrench: (n, 6) what the trunk needs, in its frame [N, N m].
        v_motors: (n, 12) joint speeds [rad/s] at which the torques are given; those of the path
            unless said.
    """

    contact: Float[np.ndarray, "n 4 3"]
    tau: Float[np.ndarray, "n 12"]
    missing: Float[np.ndarray, "n 2"]
    zmp: Float[np.ndarray, "n 2"]
    wrench: Float[np.ndarray, "n 6"]
    v_motors: Float[np.ndarray, "n 12"] | None = None

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class Case:
    """A movement that is judged.

    Attributes:
        path, forces: the movement, and what it takes.
        model: the robot that it was planned for.
        heavy: the robot that does it, with the load of the world.
        world, limits: with the worst of what is uncertain, and what must be kept.
    """

    path: Trajectory
    forces: Forces
    model: RobotModel
    heavy: RobotModel
    world: World = World()
    limits: FeasibilityLimits = FeasibilityLimits()

    def series(
        self,
        check: str,
        unit: str,
        subjects: tuple[str, ...],
        values: Float[np.ndarray, "n k"],
        limits: Float[np.ndarray, "*some"] | float,
        *,
        is_floor: bool = False,
        where: Bool[np.ndarray, "#n #k"] | bool = True,
        tight: float = 0.0,
    ) -> Series:
        """Of values at every sample of the path; see ``Series.against``."""
        what = (check, unit, subjects, self.path.times, values, limits)
        return Series.against(*what, is_floor=is_floor, where=where, tight=tight)
