"""The trunk's path while feet step in a gait: where it must be for the CoM to sway as it shall."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.legs import LEGS
from go2_wbc.robot.model import RobotModel
from motions.placement import Wanted, attitudes, centres_of_mass, configurations, place
from motions.sway import Stepping, SwayProblem
from motions.tracks import LegTracks, Poses, Times
from motions.trajectory import rates, zero_moment_points

CENTRING_STEPS = 5
"""Steps that put the CoM in its place; see ``place``."""
PASSES = 3
"""Times that the way is found; from the second on with what the pendulum leaves out, as the whole
robot's dynamics say of the last way (Kajita et al. 2003, sec. 5)."""


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
    """Places x, y [m] of the base, near those of ``body``, in which the ground can hold it."""
    joints = np.hstack([tracks.path(leg, span.times, body).q for leg in LEGS])
    com, rpy = centres_of_mass(body, joints, model), body[:, 3:]
    p_feet = tracks.footing.places(span.times)
    stepping = Stepping(
        times=span.times,
        p_com=com,
        stance=span.stance,
        p_feet=p_feet,
        gravity=model.gravity,
        bias=np.zeros((len(com), 2)),
    )
    wanted = Wanted(
        p=com,
        is_com=np.ones(len(com), dtype=bool),
        R=attitudes(rpy),
        q_joints=joints,
        raised=span.raised,
        p_feet=p_feet,
    )
    placed = place(wanted, CENTRING_STEPS, model)
    problem = SwayProblem(stepping)
    for _ in range(PASSES):
        way = problem.solve(stepping)
        wanted = replace(wanted, p=com + np.pad(way, ((0, 0), (0, 1))))
        placed = place(wanted, CENTRING_STEPS, model)
        true = _zmp(span.times, np.hstack([placed.p_base, rpy]), placed.q_joints, model)
        stepping = replace(stepping, bias=stepping.bias + true - stepping.zmp(way))
    return placed.p_base[:, :2]


def _zmp(
    times: Times, poses: Poses, joints: Float[np.ndarray, "n 12"], model: RobotModel
) -> Float[np.ndarray, "n 2"]:
    """The zero-moment point [m] of the whole robot, by inverse dynamics."""
    q = configurations(poses, joints)
    v, a = rates(times, q, poses[:, 3:])
    rows = zip(q, v, a, strict=True)
    wrench = np.array([model.inverse_dynamics(*row)[:6] for row in rows])
    return zero_moment_points(q, poses[:, 3:], wrench)
