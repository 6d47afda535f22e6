"""What is read off MuJoCo's memory in every tick, as kernels.

MuJoCo's conventions (quaternion w x y z, linear velocity in the world) end here.
"""

from __future__ import annotations

from go2_wbc.kernels.compilation import kernel

FOREIGN = 16
"""As ``plant.mujoco.layout.FOREIGN``: the code of a geom that is not the robot's."""


@kernel("void(f8[::1], f8[::1], f8[:,::1], i8, i8, i8[:,::1], f8[::1], f8[::1])")
def measure(qpos, qvel, R, base_q, base_v, places, q, v):
    """Fill q (19,) and v (18,) of a ``RobotState``.

    ``R``: the base's orientation; ``base_q``, ``base_v``: where the free joint's numbers begin;
    ``places`` (3, 12): where each joint's angle and velocity are.
    """
    for i in range(3):
        q[i] = qpos[base_q + i]
        q[3 + i] = qpos[base_q + 4 + i]
        v[i] = 0.0
        for k in range(3):
            v[i] += R[k, i] * qvel[base_v + k]
        v[3 + i] = qvel[base_v + 3 + i]
    q[6] = qpos[base_q + 3]
    for n in range(12):
        q[7 + n], v[6 + n] = qpos[places[0, n]], qvel[places[1, n]]


_PAIRS = "Array(i4, 2, 'A')"
_COUNTS = "Array(i4, 1, 'A')"


@kernel(f"void({_PAIRS}, {_COUNTS}, {_COUNTS}, Array(f8, 1, 'A'), i8[::1], b1, f8[::1])")
def ground_forces(geoms, addresses, dimensions, efc_force, codes, is_elliptic, forces):
    """Fill the normal forces [N] of contacts between robot and world, summed per bin.

    A contact's rows of ``efc_force`` begin at its address: with elliptic cones, or without
    friction, by the normal force; with pyramids by forces along 2 (dimension - 1) edges, of which
    the normal force is the sum (MuJoCo's documentation, chapter Computation, "Contact").
    """
    forces[:] = 0.0
    for contact in range(geoms.shape[0]):
        which = codes[geoms[contact, 0]] + codes[geoms[contact, 1]] - FOREIGN
        address = addresses[contact]
        if not 0 <= which < forces.shape[0] or address < 0:
            continue
        rows = 1 if is_elliptic else max(2 * (dimensions[contact] - 1), 1)
        for row in range(address, address + rows):
            forces[which] += efc_force[row]
