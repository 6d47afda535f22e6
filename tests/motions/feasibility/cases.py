"""Movements to be judged."""

import numpy as np

from go2_wbc.robot.model import RobotModel
from motions.feasibility.forces import Case, Forces, places_of
from motions.plan.trajectory import Trajectory


def case_of(path: Trajectory, model: RobotModel, forces: Forces | None = None) -> Case:
    """``path`` of an unloaded robot in the usual world, with these forces or none."""
    sizes = ((4, 3), (12,), (2,), (2,), (6,))
    none = Forces(*(np.zeros((len(path.times), *size)) for size in sizes))
    return Case(path, forces or none, places_of(path, model), model, model)
