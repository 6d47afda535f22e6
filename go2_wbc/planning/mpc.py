"""Convex model predictive control of the trunk: the forces of the feet over the next strides.

The robot is one rigid body (Di Carlo et al., Dynamic Locomotion in the MIT Cheetah 3 Through
Convex Model-Predictive Control, IROS 2018). With the turn phi, the CoM p, both in the world,

    p'' = sum f / m - g,    phi'' = I^-1 sum r x f    (without w x I w)

is linear in the forces f once the places of the feet are planned. Over ``MPC_NODES`` nodes the
forces are constant, and

    minimise    sum_j |x_j - x_j,ref|^2_Q / 2 + rho |f - f_0|^2 / 2
    subject to  |f_x|, |f_y| <= mu f_z,   0 <= f_z <= share f_max

where ``share`` is the part of a node that a foot stands. A force is the mean over its node, so f_0
is the share of the weight that a foot bears in the mean over the horizon.

This is the readable form, with the nodes' states stacked; ``kernels.mpc`` is the compiled one.
"""

from __future__ import annotations

from dataclasses import InitVar, dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.kernels.layout import MPC, MPC_NODES
from go2_wbc.validation import (
    require_not_negative,
    require_positive,
    require_share,
    warn_retired,
)


@dataclass(frozen=True, slots=True)
class MpcConfig:
    """Numbers of the MPC, from a search on this robot in simulation.

    Attributes:
        step: length [s] of a node.
        interval: time [s] from one solution to the next.
        angle_weights, position_weights: of the turn [1/rad^2] and the CoM's place [1/m^2].
        angular_weights, linear_weights: of their rates [s^2/rad^2], [s^2/m^2].
        force_weight: of a force [1/N^2]; above 0, or the forces are not unique.
        friction: mu of the friction pyramid.
        force_max: greatest normal force [N] of a foot, while it stands.
        least_share: part of a node below which a foot counts as in the air.
        prior_weight: by which the whole-body controller keeps to the forces.
        load_ramp: time [s] over which a foot may take up the force after touchdown and give it up
            before lift-off.
        throw_time: time constant [s] with which a robot that has been thrown is taken to slow down.
        throw_speed: speed [m/s] of such a robot, beyond ``LocomotionConfig.stride_margin``, at
            which the trunk's attitude weighs half as much in the whole-body QP. With all its weight
            and the feet far from below the CoM, the legs in the air are swung to turn the trunk:
            feet that should have come down were 0.16 m high, and the robot fell onto them.

    ``enabled`` is retired: the forces of every gait are planned ahead.
    """

    enabled: InitVar[bool] = True
    step: float = 0.03
    interval: float = 0.01
    angle_weights: tuple[float, float, float] = (20.0, 20.0, 20.0)
    position_weights: tuple[float, float, float] = (5.0, 5.0, 80.0)
    angular_weights: tuple[float, float, float] = (0.3, 0.3, 0.5)
    linear_weights: tuple[float, float, float] = (3.0, 3.0, 2.0)
    force_weight: float = 2e-5
    friction: float = 0.6
    force_max: float = 250.0
    least_share: float = 0.02
    prior_weight: float = 3e-3
    load_ramp: float = 0.01
    throw_time: float = 0.4
    throw_speed: float = 0.05

    def __post_init__(self, enabled: bool) -> None:
        """Raise ConfigError for a number that is out of range."""
        if not enabled:
            warn_retired("MpcConfig.enabled", "the forces of every gait are planned ahead")
        weights = "angle_weights", "position_weights", "angular_weights", "linear_weights"
        require_not_negative(self, *weights)
        require_positive(self, "step", "interval", "force_weight", "friction", "force_max")
        require_positive(self, "prior_weight", "load_ramp", "throw_time", "throw_speed")
        require_share(self, "least_share")

    def numbers(self, mass: float, gravity: float) -> Float[np.ndarray, " size"]:
        """These numbers as ``kernels.mpc`` reads them, for a robot [kg] under gravity [m/s^2]."""
        return MPC.pack(
            [
                self.step,
                mass,
                gravity,
                self.angle_weights + self.position_weights,
                self.angular_weights + self.linear_weights,
                self.force_weight,
                self.friction,
                self.force_max,
                self.least_share,
                self.interval,
                self.prior_weight,
                self.throw_time,
                self.throw_speed,
            ]
        )


@dataclass(frozen=True, slots=True)
class Horizon:
    """What the MPC looks at: the trunk now, where it shall go, and the feet that can press.

    Pose is the turn [rad] and the CoM [m], rate are w [rad/s] and v [m/s], both in this order.

    Attributes:
        state: pose and rate now.
        goals: pose and rate wanted at the end of each node.
        share: part of each node that each foot stands.
        arms: from the CoM to the feet's contact points [m].
        inertia: about the CoM, world axes [kg m^2].
    """

    state: Float[np.ndarray, "12"]
    goals: Float[np.ndarray, "nodes 12"]
    share: Float[np.ndarray, "nodes 4"]
    arms: Float[np.ndarray, "nodes 4 3"]
    inertia: Float[np.ndarray, "3 3"]


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
        forces = np.zeros((MPC_NODES, 4, 3))
        for n, foot in enumerate(self.feet):
            forces[foot] = x[3 * n : 3 * n + 3]
        return forces


def formulate(horizon: Horizon, config: MpcConfig, mass: float, gravity: float) -> ForceProgram:
    """The QP of ``horizon`` for a robot of ``mass`` [kg] under ``gravity`` [m/s^2]."""
    pressing = horizon.share >= config.least_share
    feet = tuple((k, leg) for k in range(MPC_NODES) for leg in range(4) if pressing[k, leg])
    free, response = _response(horizon, config, mass, gravity, feet)
    error = free - horizon.goals
    weights = np.concatenate(
        [
            config.angle_weights,
            config.position_weights,
            config.angular_weights,
            config.linear_weights,
        ]
    )
    S, Q = response.reshape(12 * MPC_NODES, -1), np.tile(weights, MPC_NODES)
    usual = mass * gravity * MPC_NODES / max(float(horizon.share.sum()), 1.0)
    prior = np.zeros(3 * len(feet))
    prior[2::3] = [usual * horizon.share[foot] for foot in feet]
    mu = config.friction
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
    horizon: Horizon,
    config: MpcConfig,
    mass: float,
    gravity: float,
    feet: tuple[tuple[int, int], ...],
) -> tuple[Float[np.ndarray, "nodes 12"], Float[np.ndarray, "nodes 12 n"]]:
    """State at the end of each node without any force, and how it answers to the unknowns."""
    dt, eye = config.step, np.eye(6)
    A = np.block([[eye, dt * eye], [np.zeros((6, 6)), eye]])
    B = np.concatenate([dt**2 / 2 * eye, dt * eye])
    inverse = np.linalg.inv(horizon.inertia)
    fall = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -gravity])
    x, S = horizon.state, np.zeros((12, 3 * len(feet)))
    free, response = np.empty((MPC_NODES, 12)), np.empty((MPC_NODES, *S.shape))
    for k in range(MPC_NODES):
        accelerations = np.zeros((6, 3 * len(feet)))
        for n, (node, leg) in enumerate(feet):
            if node == k:
                r = horizon.arms[k, leg]
                turn = inverse @ np.cross(r, np.eye(3)).T
                accelerations[:, 3 * n : 3 * n + 3] = np.concatenate([turn, np.eye(3) / mass])
        x, S = A @ x + B @ fall, A @ S + B @ accelerations
        free[k], response[k] = x, S
    return free, response
