"""The built MuJoCo model is the URDF, number by number."""

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import DescriptionError
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import PAYLOAD_BODY, JointDynamics
from go2_wbc.plant.terrain import Boxes, Patch
from go2_wbc.robot.description import find_description, find_profile
from go2_wbc.robot.state import JointCommand
from tests.go2_wbc.plant.helpers import STAND
from tests.go2_wbc.plant.mujoco.agreement import (
    ideal_mujoco_model,
    mujoco_dynamics,
    pinocchio_dynamics,
    random_sample,
    relative_errors,
)

FOOT_RADIUS = find_profile().foot_radius

TOTAL_MASS = 16.085  # kg, the sum of the URDF's links
# Relative, in the norm of agreement.py. Both engines do a few hundred roundings of 1e-16 with a
# condition number of about 1e3; measured 1e-13 at most.
AGREEMENT = 1e-12


def test_mujoco_and_pinocchio_agree_on_200_random_states(robot: pin.Model) -> None:
    model, rng = ideal_mujoco_model(find_description()), np.random.default_rng(0)
    for _ in range(200):
        sample = random_sample(robot, rng)
        errors = relative_errors(mujoco_dynamics(model, sample), pinocchio_dynamics(robot, sample))
        assert len(errors) == 6
        assert all(error <= AGREEMENT for error in errors.values()), errors


@pytest.mark.parametrize(
    ("change", "seen_in"),
    [
        (lambda model: _scale(model.body_mass, 5, 1.0 + 1e-6), "mass_matrix"),
        (lambda model: _scale(model.body_inertia, 4, 1.0 + 1e-6), "composite_inertia"),
        (lambda model: _scale(model.body_ipos, 1, 1.0 + 1e-6), "com"),
        (lambda model: _scale(model.dof_damping, 7, np.inf), "forward_dynamics"),
        (lambda model: _scale(model.jnt_axis, 3, -1.0), "inverse_dynamics"),
    ],
)
def test_a_tiny_difference_between_the_models_is_noticed(
    change: Callable[[mujoco.MjModel], None], seen_in: str, robot: pin.Model
) -> None:
    model = ideal_mujoco_model(find_description())
    change(model)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    sample = random_sample(robot, np.random.default_rng(0))
    found, expected = mujoco_dynamics(model, sample), pinocchio_dynamics(robot, sample)
    assert relative_errors(found, expected)[seen_in] > 10 * AGREEMENT


def _scale(array: np.ndarray, index: int, factor: float) -> None:
    """Scales one entry; an infinite factor sets it to 1e-6 instead, for entries that are zero."""
    array[index] = 1e-6 if np.isinf(factor) else factor * array[index]


def test_the_built_robot_has_the_urdfs_masses_torques_and_feet() -> None:
    plant = MujocoPlant()
    assert plant.total_mass == pytest.approx(TOTAL_MASS, abs=1e-9)
    assert np.array_equal(plant.torque_limits, np.tile([23.7, 23.7, 45.43], 4))
    assert plant.model.nu == 12
    assert not plant.model.actuator_biastype.any()  # torque motors, no servo anywhere
    model = MujocoPlant().model
    for name in FOOT_NAMES:
        geom = model.geom(name)
        assert geom.type[0] == mujoco.mjtGeom.mjGEOM_SPHERE
        assert geom.size[0] == FOOT_RADIUS
        assert not geom.pos.any()


def test_what_is_asked_of_joints_and_solver_reaches_them() -> None:
    dynamics = JointDynamics((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9))
    model = MujocoPlant(joint_dynamics=dynamics).model
    for index, name in enumerate(JOINT_NAMES):
        part, dof = index % 3, model.joint(name).dofadr[0]
        found = (model.dof_armature[dof], model.dof_damping[dof], model.dof_frictionloss[dof])
        expected = (dynamics.armature[part], dynamics.damping[part], dynamics.friction_loss[part])
        assert found == pytest.approx(expected)
    option = MujocoPlant(timestep=0.001, control_period=0.002).model.opt
    assert option.timestep == 0.001
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.impratio == 10.0
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert option.jacobian == mujoco.mjtJacobian.mjJAC_DENSE


def touching_pairs(plant: MujocoPlant, angles: np.ndarray) -> set[frozenset[str]]:
    plant.place(np.concatenate([[0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0], angles]))
    model, data = plant.model, plant.data
    bodies = [[model.body(model.geom_bodyid[g]).name for g in pair] for pair in data.contact.geom]
    return {frozenset(pair) for pair in bodies}


def test_links_that_the_srdf_excludes_do_not_collide_and_without_it_they_do(tmp_path: Path) -> None:
    plant = MujocoPlant()
    assert touching_pairs(plant, STAND) == set()
    crossed = STAND.copy()
    crossed[[0, 3]] = -0.6, 0.6  # both front feet towards the middle
    pairs = touching_pairs(plant, crossed)
    assert any({name[:2] for name in pair} == {"FL", "FR"} for pair in pairs)
    # Found in the prototype: the standing foot forces then sum to half the weight.
    urdf = tmp_path / "go2.urdf"
    urdf.write_text(find_description().urdf_path.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "go2.srdf").write_text("<robot name='go2'/>", encoding="utf-8")
    pairs = touching_pairs(MujocoPlant(urdf=urdf), STAND)
    assert frozenset({"base", "FL_thigh"}) in pairs


def test_mass_scale_scales_the_robot_and_not_its_payload_a_solid_box() -> None:
    plain, loaded = MujocoPlant().model, MujocoPlant(payload=6.0).model
    payload = loaded.body(PAYLOAD_BODY)
    assert payload.mass[0] == 6.0
    assert not payload.pos.any()
    assert payload.inertia == pytest.approx([2.0 * (0.06**2 + 0.04**2), 2.0 * (0.1**2 + 0.04**2),
                                             2.0 * (0.1**2 + 0.06**2)])  # fmt: skip
    assert np.array_equal(loaded.body("base").mass, plain.body("base").mass)
    assert loaded.body_subtreemass[1] == pytest.approx(TOTAL_MASS + 6.0)
    plain, scaled = MujocoPlant().model, MujocoPlant(mass_scale=1.5, payload=2.0).model
    for name in ("base", "FL_thigh", "RR_foot"):
        assert scaled.body(name).mass == pytest.approx(1.5 * plain.body(name).mass)
        assert scaled.body(name).inertia == pytest.approx(1.5 * plain.body(name).inertia)
    assert scaled.body(PAYLOAD_BODY).mass[0] == 2.0


def test_boxes_are_on_the_floor_and_the_robot_starts_beside_them() -> None:
    terrain = Boxes(height=0.05, size=0.3, count=80, seed=3)
    plant = MujocoPlant(terrain=terrain)
    assert plant.model.ngeom == MujocoPlant().model.ngeom + len(terrain.layout())
    assert plant.read().tilt == pytest.approx(MujocoPlant().read().tilt, abs=0.01)


@pytest.mark.parametrize("own", [0.1, 1.3], ids=["slipperier", "rougher"])
def test_a_foot_on_a_patch_has_the_friction_of_the_patch(own: float) -> None:
    terrain = Patch(friction=own, length=2.0, start=0.01)
    plant = MujocoPlant(friction=0.7, terrain=terrain)
    data = plant.data
    frictions = {
        bool(data.contact[i].pos[0] > terrain.start): data.contact[i].friction[0]
        for i in range(data.ncon)
        if any(plant.model.geom(n).name.endswith("foot") for n in data.contact[i].geom)
    }
    assert frictions == {True: pytest.approx(own), False: pytest.approx(0.7)}


def test_the_visual_meshes_change_nothing_in_the_physics() -> None:
    seen, plain = MujocoPlant(visuals=True), MujocoPlant()
    assert seen.model.ngeom > plain.model.ngeom
    for plant in (seen, plain):
        for _ in range(50):
            plant.write(JointCommand.servo(STAND, np.zeros(12), 30.0, 2.0))
    assert np.allclose(seen.read().q, plain.read().q, atol=1e-9)
    assert seen.total_mass == pytest.approx(TOTAL_MASS, abs=1e-9)


def test_a_urdf_that_mujoco_cannot_read_is_refused_with_the_reason(tmp_path: Path) -> None:
    text = find_description().urdf_path.read_text(encoding="utf-8")
    urdf = tmp_path / "go2.urdf"
    urdf.write_text(text.replace('ixx="0.00048"', 'ixx="-1.0"'), encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"MuJoCo cannot (read|compile) .*go2\.urdf"):
        MujocoPlant(urdf=urdf)
