"""What is read off MuJoCo's memory is what MuJoCo's own functions say."""

from contextlib import closing

import mujoco
import numpy as np
import pytest

from go2_wbc.legs import JOINT_NAMES
from go2_wbc.plant.mujoco.forces import FOREIGN, LIMB_BIN, ROBOT_BINS, bin_forces, read_joints
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.plant.terrain import Boxes
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import random_state
from tests.go2_wbc.plant.contract import DAMPED

CONES = (mujoco.mjtCone.mjCONE_ELLIPTIC, mujoco.mjtCone.mjCONE_PYRAMIDAL)


def forces_of_mujoco(plant: MujocoPlant) -> np.ndarray:
    """Normal forces by bin, one contact after the other."""
    model, data, codes = plant.model, plant.data, plant._layout.geom_codes
    forces, wrench = np.zeros(ROBOT_BINS), np.zeros(6)
    for index in range(data.ncon):
        which = int(codes[data.contact[index].geom].sum()) - FOREIGN
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
            bin_forces(*rows, plant._layout.geom_codes, is_elliptic, forces)
            assert_plain_is_compiled(
                bin_forces, *rows, plant._layout.geom_codes, is_elliptic, forces
            )
            np.testing.assert_allclose(forces, forces_of_mujoco(plant), rtol=1e-12, atol=1e-9)
            touched += forces > 1.0
        assert (touched > 10).sum() >= 5, "most bins bear a load in this fall"


def test_joints_and_base_are_where_mujoco_says() -> None:
    rng = np.random.default_rng(3)
    with closing(MujocoPlant()) as plant:
        model, data, layout = plant.model, plant.data, plant._layout
        for _ in range(20):
            state = random_state(rng, tilt=0.5)
            plant.place(state.q + np.array([0.0, 0.0, 2.0] + [0.0] * 16), state.v)
            base = data.body(layout.base)
            joints = [data.joint(name) for name in JOINT_NAMES]
            twist = np.empty(6)
            kind = mujoco.mjtObj.mjOBJ_XBODY  # angular velocity first, along the body's axes
            mujoco.mj_objectVelocity(model, data, kind, layout.base, twist, 1)
            angles = [joint.qpos[0] for joint in joints]
            expected_q = np.concatenate([base.xpos, base.xquat[[1, 2, 3, 0]], angles])
            expected_v = np.concatenate([twist[3:], twist[:3], [joint.qvel[0] for joint in joints]])
            places = np.array([layout.joint_q, layout.joint_v, layout.motors], dtype=np.int64)
            base_rows = (layout.base_q.start, layout.base_v.start)
            given = (data.qpos, data.qvel, base.xmat.reshape(3, 3), *base_rows, places)
            q, v = np.empty(19), np.empty(18)
            read_joints(*given, q, v)
            np.testing.assert_allclose(q, expected_q, atol=1e-12)
            np.testing.assert_allclose(v, expected_v, atol=1e-12)
            np.testing.assert_allclose(v, state.v, atol=1e-12)
            assert_plain_is_compiled(read_joints, *given, q, v)


@pytest.mark.parametrize(
    ("is_elliptic", "force"), [(True, 10.0), (False, 10.0 + 11.0 + 12.0 + 13.0)]
)
def test_contacts_without_a_bin_or_a_force_are_passed_over(
    *, is_elliptic: bool, force: float
) -> None:
    codes = np.array([1, LIMB_BIN, FOREIGN, FOREIGN])
    geoms = np.array([[0, 1], [2, 3], [0, 2], [3, 0]], dtype=np.int32)  # both robot's, none, ...
    addresses = np.array([0, 0, -1, 10], dtype=np.int32)
    dimensions, forces = np.full(4, 3, dtype=np.int32), np.empty(ROBOT_BINS)
    given = (geoms, addresses, dimensions, np.arange(20.0), codes, is_elliptic)
    bin_forces(*given, forces)
    assert forces.tolist() == [0.0, force, 0.0, 0.0, 0.0, 0.0]
