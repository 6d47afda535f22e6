"""How heavy the robot is, felt while it stands on four feet, before it flies or balances.

On four feet the feedback holds a body that is heavier than its model, a little too low. In flight
and on two feet there is no time for that: with 9 % more mass a rear-up was up to 7 deg off its plan
on the average, and with 9 % less one in eight touched the ground with a leg; with what is felt here
they are off by 4 deg at most, as with the model's mass, and every one is done.
"""

from __future__ import annotations

from typing import final

import numpy as np

from go2_wbc.legs import LEGS
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.state import Snapshot
from motions.dynamics.phases import GRAVITY

LEAST, MOST = 0.8, 1.4
"""Bounds of the ratio: of the lightest robot, and of one that carries 6 kg."""
DOUBT = 0.02
"""Time [s] for which the model's weight counts as if it had been felt: a first tick is noisy."""
_JOINTS = [[6 + joint for joint in range(leg.joints.start, leg.joints.stop)] for leg in LEGS]


@final
class FeltWeight:
    """The robot's weight over that of its model.

    Standing on four feet, the mean force of the ground is the mass times gravity and the mean
    acceleration, whose plan is known. The force is that which balances the joints' torques.
    What was felt before the first foot leaves the ground stays.

    Attributes:
        ratio: of the weights.
    """

    def __init__(self, friction: JointFriction) -> None:
        """Begin with the model's; ``friction`` is what the joints take of the motors' torques."""
        self.ratio = 1.0
        self._friction = friction
        self._felt = self._planned = DOUBT * GRAVITY
        self._is_over = False

    def add_to(self, target: Target, snapshot: Snapshot, dt: float) -> None:
        """Feel for ``dt`` seconds, and let a plan's target ask for more or less.

        The model's mass times the new acceleration and gravity is the felt mass times the planned
        ones: so much force does the plan take.
        """
        a_world = target.a_world
        if not self._is_over:
            self._is_over = bool((target.legs != STANCE).any())
        if not self._is_over:
            mass = float(snapshot.mass_matrix[0, 0])
            self._felt += dt * vertical_force(snapshot, self._friction) / mass
            self._planned += dt * (GRAVITY + float(a_world[2]))
            self.ratio = min(max(self._felt / self._planned, LEAST), MOST)
        a_world *= self.ratio
        a_world[2] += (self.ratio - 1.0) * GRAVITY


def vertical_force(snapshot: Snapshot, friction: JointFriction) -> float:
    """Force [N] of the ground on all feet that balances the torques of the joints.

    The inertia of the legs is left out: it is small where all feet stand.
    """
    J = np.stack([snapshot.J_contacts[leg][:, _JOINTS[leg]] for leg in LEGS])
    tau = snapshot.state.tau - friction.torque(snapshot.state.joint_velocities, np.zeros(12))
    load = (snapshot.bias[6:] - tau).reshape(4, 3, 1)
    return float(np.linalg.solve(J.transpose(0, 2, 1), load)[:, 2].sum())
