"""Measures the contacts between the simulated robot and everything else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.brief import brief
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

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class Contacts:
    """All contacts of one instant as MuJoCo holds them, copied: quick to take, evaluated later.

    Taken after ``mj_step1``: places and velocities belong to that state.

    Attributes:
        codes: sum of both geoms' codes: ``FOREIGN`` plus a bin if exactly one is the robot's.
        distances: of the surfaces [m]; they touch from 0 on.
        points: of contact in the world [m].
        normals: of each contact.
        p_world_com: the robot's centre of mass [m].
        twists: velocities of the feet's bodies about it, angular first, along world axes.
    """

    codes: Int[np.ndarray, " n"]
    distances: Float[np.ndarray, " n"]
    points: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    p_world_com: Float[np.ndarray, "3"]
    twists: Float[np.ndarray, "4 6"]

    __repr__ = brief

    @staticmethod
    def of(data: mujoco.MjData, layout: MujocoLayout) -> Contacts:
        """The present ones."""
        contacts = data.contact
        return Contacts(
            layout.geom_codes[contacts.geom].sum(axis=1),
            contacts.dist.copy(),
            contacts.pos.copy(),
            contacts.frame[:, :3].copy(),
            data.subtree_com[layout.base].copy(),
            data.cvel[layout.foot_bodies],
        )


def foot_contacts(
    instants: Sequence[Contacts],
) -> tuple[Float[np.ndarray, "t 4 3"], Float[np.ndarray, "t 4 3"]]:
    """Points and velocities as in ``FootContacts``, at each of the instants."""
    points, velocities = np.full((len(instants), 4, 3), np.nan), np.zeros((len(instants), 4, 3))
    when, codes, distances = _gathered(instants)
    legs = codes - FOREIGN
    rows = np.flatnonzero((legs >= 0) & (legs < len(LEGS)) & (distances <= 0.0))
    rows = rows[np.argsort(-distances[rows], kind="stable")]  # a foot's deepest is written last
    place = (when[rows], legs[rows])
    point = np.concatenate([contacts.points for contacts in instants])[rows]
    normal = np.concatenate([contacts.normals for contacts in instants])[rows]
    com = np.array([contacts.p_world_com for contacts in instants])
    twist = np.array([contacts.twists for contacts in instants])[place]
    velocity = twist[:, 3:] + np.cross(twist[:, :3], point - com[place[0]])
    along_normal = (normal * velocity).sum(axis=1, keepdims=True)
    points[place], velocities[place] = point, velocity - along_normal * normal
    return points, velocities


def touches_itself(instants: Sequence[Contacts]) -> Bool[np.ndarray, " t"]:
    """Whether two links of the robot touch that its SRDF does not let touch, at each instant."""
    when, codes, distances = _gathered(instants)
    touches = np.zeros(len(instants), dtype=bool)
    touches[when[(codes < FOREIGN) & (distances <= 0.0)]] = True
    return touches


def _gathered(
    instants: Sequence[Contacts],
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Of all contacts of all instants: the instant, the code and the distance."""
    when = np.repeat(np.arange(len(instants)), [len(contacts.codes) for contacts in instants])
    codes = np.concatenate([contacts.codes for contacts in instants])
    return when, codes, np.concatenate([contacts.distances for contacts in instants])
