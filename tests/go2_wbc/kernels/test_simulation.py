"""What the kernels read off MuJoCo's memory is what MuJoCo's own functions say."""

from __future__ import annotations

from contextlib import closing

import mujoco
import numpy as np
import pytest

from go2_wbc.kernels.simulation import FOREIGN, ground_forces
from go2_wbc.plant.mujoco import layout
from go2_wbc.plant.mujoco.layout import ROBOT_BINS
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.plant.terrain import Boxes
from tests.go2_wbc.plant.contract import DAMPED

CONES = (mujoco.mjtCone.mjCONE_ELLIPTIC, mujoco.mjtCone.mjCONE_PYRAMIDAL)


def forces_of_mujoco(plant: MujocoPlant) -> np.ndarray:
    """Normal forces by bin, one contact after the other."""
    model, data, codes = plant.model, plant.data, plant._layout.geom_codes
    forces, wrench = np.zeros(ROBOT_BINS), np.zeros(6)
    for index in range(data.ncon):
        which = int(codes[data.contact[index].geom].sum()) - layout.FOREIGN
        if 0 <= which < ROBOT_BINS:
            mujoco.mj_contactForce(model, data, index, wrench)
            forces[which] += wrench[0]
    return forces


@pytest.mark.parametrize("cone", CONES, ids=["elliptic", "pyramidal"])
@pytest.mark.parametrize("dimension", [1, 3, 4])
def test_forces_are_those_of_mujoco(cone: mujoco.mjtCone, dimension: int) -> None:
    rng = np.random.default_rng(2)
    with closing(MujocoPlant(terrain=Boxes(height=0.06, seed=3), initial_joint_noise=0.2)) as plant:
        model, data = plant.model, plant.data
        model.opt.cone = cone
        model.geom_condim[:] = dimension
        mujoco.mj_forward(model, data)  # the next step has the new constraints
        forces, touched = np.empty(ROBOT_BINS), np.zeros(ROBOT_BINS)
        for _ in range(300):
            plant.push(rng.normal(scale=40.0, size=3), 0.002)
            plant.write(DAMPED)
            mujoco.mj_forward(model, data)
            contact = data.contact
            rows = (contact.geom, contact.efc_address, contact.dim, data.efc_force)
            is_elliptic = cone == mujoco.mjtCone.mjCONE_ELLIPTIC
            ground_forces(*rows, plant._layout.geom_codes, is_elliptic, forces)
            np.testing.assert_allclose(forces, forces_of_mujoco(plant), rtol=1e-12, atol=1e-9)
            touched += forces > 1.0
        assert (touched > 10).sum() >= 5, "most bins bear a load in this fall"
    assert FOREIGN == layout.FOREIGN
