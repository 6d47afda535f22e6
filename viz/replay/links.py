"""What files for other viewers hold of a recording: where links were, when something began."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.recording import Recording

WORLD, BASE = "world", "base"


class Link(NamedTuple):
    """A link that moves, by its name in the URDF.

    Attributes:
        name, parent: of it and of the link that it hangs on, ``world`` for the base.
        p: (n, 3) its place in the parent's frame [m].
        quaternion: (n, 4) its orientation there, x y z w.
    """

    name: str
    parent: str
    p: Float[np.ndarray, "n 3"]
    quaternion: Float[np.ndarray, "n 4"]


def links_of(model: pin.Model, q: Float[np.ndarray, "n 19"]) -> tuple[Link, ...]:
    """The base and the twelve links of the legs, parents first."""
    data, poses = model.createData(), np.empty((model.njoints, len(q), 7))
    for row, configuration in enumerate(q):
        pin.forwardKinematics(model, data, configuration)
        poses[:, row] = [pin.SE3ToXYZQUAT(T) for T in data.liMi]
    names = [WORLD, BASE, *(name.removesuffix("_joint") for name in list(model.names)[2:])]
    return tuple(
        Link(names[joint], names[model.parents[joint]], poses[joint, :, :3], poses[joint, :, 3:])
        for joint in range(1, model.njoints)
    )


def label_starts(recording: Recording) -> list[int]:
    """The rows from which on the robot did something else."""
    before = ("", *recording.labels)
    return [row for row, label in enumerate(recording.labels) if label != before[row]]
