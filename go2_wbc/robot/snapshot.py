"""Every quantity of one control tick, computed once: holding a Snapshot proves that it is fresh.

Contact points: a foot is a sphere that rolls. The material point at the contact is r below the
centre, so its velocity is v_c + w x (-r n), and a rolling foot obeys a_c = r (dw x n)
(differentiate v_c = r w x n). ``J_contacts`` is therefore J_c - r (J_w x n), and
``drift_contacts`` the matching velocity-dependent part, without the centripetal term that belongs
to the material point.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError
from go2_wbc.records import Array3, Array3x3, Array4x3, Array18, Array19, Record
from go2_wbc.robot.profile import RobotProfile, find_profile
from go2_wbc.robot.state import RobotState


class Snapshot(Record):
    """State and dynamics of one tick. Accelerations use Pinocchio's spatial base acceleration.

    Attributes:
        state: the measured state that everything here belongs to.
        profile: of the robot.
        q, v: its configuration and velocity.
        R_world_base: base orientation.
        mass_matrix: M(q) with rotor inertia.
        bias: h(q, v): Coriolis, centrifugal and gravity terms [N, N m].
        p_world_com, v_world_com: CoM position [m] and velocity [m/s].
        J_com: CoM Jacobian (world); drift_com: CoM acceleration [m/s^2] at zero joint acceleration.
        p_world_feet, v_world_feet: foot centres [m], [m/s].
        J_feet, drift_feet: Jacobians and drifts of the foot centres (world).
        J_contacts, drift_contacts: the same for the rolling contact points.
        v_world_contacts: velocity of the material contact points [m/s].
        payload: mass [kg] and weight [N] of what the trunk is taken to carry; it is in all the
            dynamics above.
        com_shift: by which it moves the CoM [m] in the world.
        foot_radius: of the spherical feet [m].
    """

    __slots__ = ("profile", "state")

    state: RobotState
    profile: RobotProfile
    q: Array19
    v: Array18
    R_world_base: Array3x3
    mass_matrix: Float[np.ndarray, "18 18"]
    bias: Array18
    p_world_com: Array3
    v_world_com: Array3
    J_com: Float[np.ndarray, "3 18"]
    drift_com: Array3
    p_world_feet: Array4x3
    v_world_feet: Array4x3
    J_feet: Float[np.ndarray, "4 3 18"]
    drift_feet: Array4x3
    J_contacts: Float[np.ndarray, "4 3 18"]
    drift_contacts: Array4x3
    v_world_contacts: Array4x3
    payload: Float[np.ndarray, "2"]
    com_shift: Array3
    foot_radius: float

    def __init__(
        self,
        state: RobotState,
        profile: RobotProfile | None = None,
        **parts: Float[np.ndarray, "..."] | float,
    ) -> None:
        """From the ``state`` and the other parts by name; what is left out is 0.

        Without a ``profile`` the robot is a Go2.

        Raises:
            CommandError: for an array of another shape than it should have.
        """
        try:
            super().__init__(q=state.q, v=state.v, **parts)
        except (ValueError, TypeError) as error:
            raise CommandError(f"snapshot: {error}") from error
        object.__setattr__(self, "state", state)
        object.__setattr__(self, "profile", profile or find_profile())

    @staticmethod
    def of_row(
        state: RobotState, row: Float[np.ndarray, " size"], profile: RobotProfile
    ) -> Snapshot:
        """The snapshot of ``state`` whose numbers lie in ``row``."""
        snapshot = Snapshot.of(row)
        object.__setattr__(snapshot, "state", state)
        object.__setattr__(snapshot, "profile", profile)
        return snapshot

    def replaced(
        self, state: RobotState | None = None, **parts: Float[np.ndarray, "..."] | float
    ) -> Snapshot:
        """A copy with another state, or other parts by name."""
        own = {
            name: getattr(self, name) for name in Snapshot.part_names() if name not in ("q", "v")
        }
        return Snapshot(state or self.state, self.profile, **(own | parts))

    def __reduce__(self) -> tuple[object, ...]:
        return Snapshot.of_row, (self.state, self.row, self.profile)
