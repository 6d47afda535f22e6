"""The MPC of the trunk with the nodes' states stacked, everything a matrix."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.planning.mpc import NODES, STEP, Horizon, MpcConfig


@dataclass(frozen=True, slots=True)
class ForceProgram:
    """The QP in the forces of the feet that press: x'Hx/2 + g'x, lower <= C x <= upper.

    Attributes:
        feet: node and leg of every three unknowns.
        H, g, C, lower, upper: the QP.
    """

    feet: tuple[tuple[int, int], ...]
    H: Float[np.ndarray, "n n"]
    g: Float[np.ndarray, " n"]
    C: Float[np.ndarray, "m n"]
    lower: Float[np.ndarray, " m"]
    upper: Float[np.ndarray, " m"]

    def forces(self, x: Float[np.ndarray, " n"]) -> Float[np.ndarray, "nodes 4 3"]:
        """The forces [N] of all feet over each node, from the unknowns."""
        forces = np.zeros((NODES, 4, 3))
        for n, foot in enumerate(self.feet):
            forces[foot] = x[3 * n : 3 * n + 3]
        return forces


def formulate(horizon: Horizon, config: MpcConfig) -> ForceProgram:
    """The QP of ``horizon``."""
    pressing = horizon.share >= config.least_share
    feet = tuple((k, leg) for k in range(NODES) for leg in range(4) if pressing[k, leg])
    free, response = _response(horizon, feet)
    error = free - horizon.goals
    weights = np.concatenate(
        [
            config.angle_weights,
            config.position_weights,
            config.angular_weights,
            config.linear_weights,
        ]
    )
    S, Q = response.reshape(12 * NODES, -1), np.tile(weights, NODES)
    usual = horizon.mass * horizon.gravity * NODES / max(float(horizon.share.sum()), 1.0)
    prior = np.zeros(3 * len(feet))
    prior[2::3] = [usual * horizon.share[foot] for foot in feet]
    mu = horizon.friction
    pyramid = np.array([[1, 0, -mu], [-1, 0, -mu], [0, 1, -mu], [0, -1, -mu], [0, 0, 1]])
    most = [config.force_max * horizon.share[foot] for foot in feet]
    return ForceProgram(
        feet=feet,
        H=S.T @ (Q[:, None] * S) + config.force_weight * np.eye(3 * len(feet)),
        g=S.T @ (Q * error.ravel()) - config.force_weight * prior,
        C=np.kron(np.eye(len(feet)), pyramid),
        lower=np.tile([-np.inf, -np.inf, -np.inf, -np.inf, 0.0], len(feet)),
        upper=np.concatenate([[0.0, 0.0, 0.0, 0.0, force] for force in most]),
    )


def _response(
    horizon: Horizon, feet: tuple[tuple[int, int], ...]
) -> tuple[Float[np.ndarray, "nodes 12"], Float[np.ndarray, "nodes 12 n"]]:
    """State at the end of each node without any force, and how it answers to the unknowns."""
    dt, eye = STEP, np.eye(6)
    A = np.block([[eye, dt * eye], [np.zeros((6, 6)), eye]])
    B = np.concatenate([dt**2 / 2 * eye, dt * eye])
    inverse = np.linalg.inv(horizon.inertia)
    fall = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -horizon.gravity])
    x, S = horizon.state, np.zeros((12, 3 * len(feet)))
    free, response = np.empty((NODES, 12)), np.empty((NODES, *S.shape))
    for k in range(NODES):
        accelerations = np.zeros((6, 3 * len(feet)))
        for n, (node, leg) in enumerate(feet):
            if node == k:
                r = horizon.arms[k, leg]
                turn = inverse @ np.cross(r, np.eye(3)).T
                accelerations[:, 3 * n : 3 * n + 3] = np.concatenate(
                    [turn, np.eye(3) / horizon.mass]
                )
        x, S = A @ x + B @ fall, A @ S + B @ accelerations
        free[k], response[k] = x, S
    return free, response
