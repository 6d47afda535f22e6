"""Feedback of a solved plan while two feet or one stand.

On two feet the force that moves the CoM also turns the trunk: about the line between them no
moment can be had. Following place and attitude each by its own gains then loses one of them, and
the robot falls over in the end. The plan's own gains, of the Riccati equation along it, weigh all
errors against each other as they will grow (Mastalli et al. 2022).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from go2_wbc.motion_plan import PlanFeedback
from go2_wbc.reference import Anchor, Reference
from go2_wbc.robot.rotations import log_rotation, rotation_from_quaternion, yaw_rotation
from go2_wbc.robot.state import Snapshot

MOST_FEET = 2
"""Standing feet up to which the feedback is the plan's; more can give any moment."""


def fed_back(
    reference: Reference, feedback: PlanFeedback, anchor: Anchor, snapshot: Snapshot
) -> Reference:
    """``reference`` with the accelerations of the trunk that the plan's gains ask for.

    They take the place of the controller's own feedback of the trunk, whose errors are none then;
    legs in the air stay on their way.

    Args:
        reference: of a solved plan, which tracks the CoM, in the world.
        feedback: in the motion's frame.
        anchor: where the motion takes place.
    """
    if not 1 <= reference.stance.sum() <= MOST_FEET:
        return reference
    tau = -feedback.gains @ state_error(feedback, anchor, snapshot)
    a = acceleration_of(tau, reference, snapshot)
    body, R = reference.body, snapshot.R_world_base
    target = replace(
        body,
        p_world=snapshot.p_world_com,
        v_world=snapshot.v_world_com,
        a_world=body.a_world + snapshot.J_com @ a,
        R_world_base=R,
        w_world=R @ snapshot.state.v[3:6],
        dw_world=body.dw_world + R @ a[3:6],
    )
    return replace(reference, body=target)


def state_error(
    feedback: PlanFeedback, anchor: Anchor, snapshot: Snapshot
) -> Float[np.ndarray, "36"]:
    """Measured less planned configuration and velocity, to first order as Pinocchio's."""
    turn, q, state = yaw_rotation(anchor.yaw), feedback.q, snapshot.state
    R = turn @ rotation_from_quaternion(q[3:7])
    p = anchor.p_world + turn @ q[:3]
    return np.concatenate(
        [
            R.T @ (state.q[:3] - p),
            log_rotation(R.T @ snapshot.R_world_base),
            state.q[7:] - q[7:],
            state.v - feedback.v,
        ]
    )


def acceleration_of(
    tau: Float[np.ndarray, "12"], reference: Reference, snapshot: Snapshot
) -> Float[np.ndarray, "18"]:
    """What joint torques ``tau`` [N m] add to the accelerations while the stance feet stay.

    M a - J' f = S' tau, J a = 0.
    """
    J = snapshot.J_contacts[reference.stance].reshape(-1, 18)
    count = len(J)
    system = np.block([[snapshot.mass_matrix, -J.T], [J, -_COMPLIANCE * np.eye(count)]])
    wanted = np.concatenate([np.zeros(6), tau, np.zeros(count)])
    return np.linalg.solve(system, wanted)[:18]


_COMPLIANCE = 1e-9
"""Of the contacts [m/s^2/N]: a leg that is stretched out leaves the system regular."""
