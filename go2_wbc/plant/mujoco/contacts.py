"""Measures the contacts between the simulated robot and everything else."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from go2_wbc.legs import LEGS
from go2_wbc.plant.mujoco.layout import FOREIGN, MujocoLayout


@dataclass(frozen=True, slots=True)
class FootContacts:
    """Where each foot touches, and how the touching material moves there.

    The velocity is that of the point of the foot that is at the contact now, not of the foot's
    centre: a round foot that rolls has a moving centre and a resting contact point.

    Attributes:
        p_world_contact: the deepest contact point of each foot [m]; nan without contact.
        v_world_contact: tangential velocity of the foot's material there [m/s]; 0 without contact.
    """

    p_world_contact: Float[np.ndarray, "4 3"]
    v_world_contact: Float[np.ndarray, "4 3"]


def foot_contacts(data: mujoco.MjData, layout: MujocoLayout) -> FootContacts:
    """Contact points of the feet and their material velocities.

    Valid after ``mj_step1``: places and velocities belong to the present state.
    """
    points, velocities = np.full((4, 3), np.nan), np.zeros((4, 3))
    contacts = data.contact
    legs, depths = _pair_codes(data, layout) - FOREIGN, contacts.dist
    order = np.flatnonzero((legs >= 0) & (legs < len(LEGS)) & (depths <= 0.0))
    for i in order[np.argsort(-depths[order])]:  # the deepest of each foot comes last and stays
        leg, point, normal = int(legs[i]), contacts.pos[i], contacts.frame[i, :3]
        velocity = _point_velocity(data, layout, int(layout.foot_bodies[leg]), point)
        points[leg] = point
        velocities[leg] = velocity - normal * normal.dot(velocity)
    return FootContacts(points, velocities)


def touches_itself(data: mujoco.MjData, layout: MujocoLayout) -> bool:
    """Whether two links of the robot touch that its SRDF does not let touch."""
    is_own = _pair_codes(data, layout) < FOREIGN
    return bool((is_own & (data.contact.dist <= 0.0)).any())


def _pair_codes(data: mujoco.MjData, layout: MujocoLayout) -> Int[np.ndarray, " n"]:
    """Sum of both geoms' codes: ``FOREIGN`` plus a bin if exactly one belongs to the robot."""
    return layout.geom_codes[data.contact.geom].sum(axis=1)


def _point_velocity(
    data: mujoco.MjData, layout: MujocoLayout, body: int, point: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3"]:
    """World velocity of the material of ``body`` at a world point; cvel is about the tree's CoM."""
    wx, wy, wz, vx, vy, vz = data.cvel[body].tolist()
    x, y, z = (point - data.subtree_com[layout.base]).tolist()
    return np.array([vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x])
