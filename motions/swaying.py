"""The trunk's path while feet step in a gait: where it must be for the CoM to sway as it shall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.legs import LEGS
from go2_wbc.robot.model import RobotModel
from motions.placement import Wanted, attitudes, centres_of_mass, place
from motions.sway import Stepping, sway
from motions.tracks import LegTracks, Poses, Times

CENTRING_STEPS = 5
"""Steps that put the CoM in its place; see ``place``."""


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of a motion in which feet step.

    Attributes:
        times: (n,) its instants [s].
        stance: (n, 4) feet that stand.
        raised: (n, 4) legs in the air that do not step.
    """

    times: Times
    stance: Bool[np.ndarray, "n 4"]
    raised: Bool[np.ndarray, "n 4"]


def swayed(
    span: Span, body: Poses, tracks: LegTracks, model: RobotModel
) -> Float[np.ndarray, "n 2"]:
    """Places x, y [m] of the base with which the ground can hold the trunk that goes as ``body``."""
    joints = np.hstack([tracks.path(leg, span.times, body).q for leg in LEGS])
    com = centres_of_mass(body, joints, model)
    p_feet = tracks.footing.places(span.times)
    stepping = Stepping(
        times=span.times,
        p_com=com,
        stance=span.stance,
        p_feet=p_feet,
        gravity=model.gravity,
        bias=np.zeros((len(com), 2)),
    )
    com[:, :2] += sway(stepping)
    wanted = Wanted(
        p=com,
        is_com=np.ones(len(com), dtype=bool),
        R=attitudes(body[:, 3:]),
        q_joints=joints,
        raised=span.raised,
        p_feet=p_feet,
    )
    return place(wanted, CENTRING_STEPS, model).p_base[:, :2]
