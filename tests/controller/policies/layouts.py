"""A sidecar with every term, and the orders of joints of well-known frameworks."""

import numpy as np

from controller.policies.sidecar import SIZES, CommandRanges, Sidecar, Term

ISAAC_LAB = np.arange(12).reshape(4, 3).T.ravel()
UNITREE = np.array([3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8])
SIDECAR = Sidecar(
    robot="go2",
    rate=50.0,
    order=np.arange(12),
    signs=np.ones(12),
    default=np.tile([0.0, 0.8, -1.6], 4),
    action_scale=np.full(12, 0.25),
    action_clip=100.0,
    kp=np.linspace(30.0, 41.0, 12),
    kd=np.linspace(1.0, 2.1, 12),
    commands=CommandRanges((-0.2, 1.0), (-0.2, 0.2), (-0.6, 0.6)),
    terms=tuple(
        Term(name, np.ones(size), 2.5, (0.0,)) if name == "clock" else Term(name, np.ones(size))
        for name, size in SIZES.items()
    ),
    history=1,
    by_terms=False,
    oldest_first=True,
    observation_clip=100.0,
)
"""All terms, in this project's order."""
