"""What the legs do along a solved motion: who stands, and what legs in the air follow.

A foot in the air follows its place, so that it lands there. Near the height of its hip's axis that
asks for any speed of the hip: the determinant of the leg's Jacobian, its manipulability (Yoshikawa,
Manipulability of robotic mechanisms, 1985), passes through 0, and what the leg cannot do turns the
trunk. There the leg follows its joints.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.legs import LEGS
from go2_wbc.recording import true_runs
from go2_wbc.robot.leg_kinematics import LegGeometry
from go2_wbc.robot.model import RobotModel
from motions.dynamics.dynamic_trajectory import DynamicTrajectory

LEAST_MANIPULABILITY = 4e-3
"""|det J| [m^3] below which a leg follows its joints: 15e-3 in standing, 6.5e-3 at least in walks
and jumps of the library."""


def tasks_of(
    solved: DynamicTrajectory, model: RobotModel
) -> tuple[Float[np.ndarray, " m"], Bool[np.ndarray, "m 4"], Bool[np.ndarray, "m 4"]]:
    """Instants [s] at which the legs' tasks change; feet that stand, and that follow their places.

    A leg follows its joints from where it first comes near a singularity to where it last is.
    """
    stance, swings = solved.stance, ~solved.stance
    q = solved.q[:-1, 7:]
    for leg in LEGS:
        near = np.abs(determinants(LegGeometry.of(model, leg), q[:, leg.joints]))
        near = near < LEAST_MANIPULABILITY
        for flight in true_runs(~stance[:, leg]):
            rows = flight.start + np.flatnonzero(near[flight])
            if len(rows):
                swings[rows[0] : rows[-1] + 1, leg] = False
    tasks = np.hstack([stance, swings])
    rows = np.concatenate([[0], np.flatnonzero(np.any(tasks[1:] != tasks[:-1], axis=1)) + 1])
    return solved.times[rows], stance[rows], swings[rows]


def determinants(
    geometry: LegGeometry, angles: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, " n"]:
    """det J [m^3] of a foot's centre by its leg's joints [rad], but for the sign of turns."""
    thigh, calf = angles[:, 1], angles[:, 2]
    down = geometry.thigh * np.cos(thigh) + geometry.calf * np.cos(thigh + calf)
    return geometry.thigh * geometry.calf * np.sin(calf) * down
