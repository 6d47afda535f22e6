"""The same policy in other layouts: its network is wrapped, its sidecar says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from controller.policies.policy import Policy
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


def laid_out(policy: Policy, order: np.ndarray, signs: np.ndarray, factor: float = 1.0) -> Policy:
    """The same policy, that counts joints in another ``order``, and some of them the other way.

    All that it sees and does is ``factor`` times as great.
    """
    side = policy.sidecar
    assert side.history == 1
    assert (side.order == np.arange(12)).all()
    back, ends = np.argsort(order), np.cumsum([len(term.scale) for term in side.terms])[:-1]
    per_joint = [SIZES[term.name] == 12 for term in side.terms]

    def network(x: np.ndarray) -> np.ndarray:
        parts = np.split(x / factor, ends)
        own = [(signs * p)[back] if j else p for p, j in zip(parts, per_joint, strict=True)]
        return signs * policy.network(np.concatenate(own))[order] * factor

    terms = tuple(
        term if term.name == "last_action" else replace(term, scale=factor * term.scale)
        for term in side.terms
    )
    return Policy(
        f"{policy.name}, laid out",
        replace(
            side,
            order=order,
            signs=signs,
            default=signs * side.default[order],
            action_scale=side.action_scale[order] / factor,
            kp=side.kp[order],
            kd=side.kd[order],
            terms=terms,
        ),
        network,
    )
