"""The simulated robot in a world is the one that Pinocchio computes with; commands come late."""

import mujoco
import numpy as np
import pytest

from benchmarks.robots import menagerie_go2
from go2_wbc import World
from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant, plant_in_world
from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.plant.terrain import Patch
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand
from tests.engine_helpers import random_state

LOADED = World(
    friction=0.7, payload=4.0, payload_place=(0.08, -0.05, 0.1), mass_scale=1.1, joint_friction=1.5
)
CLOSE = 1e-9  #: kg, m, kg m^2: one model computed twice
DAMPED = 0.01
"""N m: of the joints that have come to rest under the damping that is on its way at the start."""


def test_masses_friction_and_joints_are_those_that_are_stated() -> None:
    plant = plant_in_world(LOADED)
    model = RobotModel(world=LOADED)
    assert plant.total_mass == pytest.approx(model.mass, abs=CLOSE)
    rng = np.random.default_rng(3)
    for _ in range(5):
        q = random_state(rng).q
        plant.place(q)
        com = plant.data.subtree_com[plant.model.body("base").id]
        assert com == pytest.approx(model.center_of_mass(q), abs=CLOSE)
        M = np.empty((plant.model.nv, plant.model.nv))
        mujoco.mj_fullM(plant.model, plant.data, M)
        joints = model.snapshot(plant.read()).mass_matrix[6:, 6:]
        assert M[6:, 6:] == pytest.approx(joints, abs=CLOSE)
    plant, usual = plant_in_world(LOADED), MujocoPlant()
    assert plant.model.geom("FL_foot").friction[0] == LOADED.friction
    for name in ("dof_damping", "dof_frictionloss"):
        stated, before = (getattr(p.model, name)[6:] for p in (plant, usual))
        assert stated == pytest.approx(LOADED.joint_friction * before)


def test_a_delayed_command_acts_later_and_a_saved_plant_keeps_what_waits() -> None:
    plant = plant_in_world(World(delay=0.006))
    command = JointCommand.torque(np.full(12, 1.5))
    acted = []
    for _ in range(2):
        plant.write(command)
        acted.append(plant.read().tau.copy())
    saved = plant.save()
    for _ in range(2):
        plant.write(command)
        acted.append(plant.read().tau.copy())
    assert not np.allclose(acted[1], 1.5)
    assert np.allclose(acted[3], 1.5)
    plant.restore(saved)
    plant.write(command)
    assert np.array_equal(plant.read().tau, acted[2])


@pytest.mark.parametrize("late", range(10))
def test_a_delay_is_kept_to_the_physics_step(late: int) -> None:
    plant = MujocoPlant(control_period=0.008, timestep=0.002, delay=0.002 * late, motor="ideal")
    felt = []
    for period in range(5):
        plant.write(JointCommand.torque(np.full(12, 1.0 + period)))
        felt.append(plant.read().tau[0])
    asked = np.repeat(np.arange(1.0, 6.0), 4)
    acted = np.concatenate([np.zeros(late), asked])[:20]
    assert felt == pytest.approx(acted.reshape(5, 4).mean(axis=1), abs=DAMPED)


def test_a_plant_put_into_another_world_is_the_one_that_is_built_there() -> None:
    world = World(friction=0.6, mass_scale=1.07, joint_friction=1.4, delay=0.004)
    oil = Patch(start=0.1)
    varied = MujocoPlant(terrain=oil)
    built = MujocoPlant(
        terrain=oil,
        friction=world.friction,
        mass_scale=world.mass_scale,
        joint_dynamics=JointDynamics().scaled(world.joint_friction),
        delay=world.delay,
    )
    saved = varied.save()
    varied.vary(World(friction=1.5, mass_scale=0.8))
    varied.restore(saved)
    varied.vary(world)
    for name in (
        *("geom_friction", "body_mass", "body_inertia", "body_subtreemass", "dof_damping"),
        *("dof_frictionloss", "dof_invweight0", "body_invweight0", "dof_M0"),
    ):
        own, other = getattr(varied.model, name), getattr(built.model, name)
        assert own == pytest.approx(other, rel=1e-12), name
    q = built.read().q
    for plant in (varied, built):
        for _ in range(3):  # what was on its way
            plant.write(JointCommand.torque(np.zeros(12)))
        plant.place(q)
    for _ in range(20):
        for plant in (varied, built):
            plant.write(JointCommand.servo(np.tile([0.0, 0.8, -1.6], 4), np.zeros(12), 30.0, 1.0))
    assert varied.read().q == pytest.approx(built.read().q, abs=1e-12)
    with pytest.raises(ConfigError, match="payload"):
        varied.vary(World(payload=1.0))


def test_another_authors_file_is_put_into_another_world_by_the_friction_of_its_feet() -> None:
    # Its feet have a priority of their own: the friction of all that has none did not matter.
    file, world = menagerie_go2(), World(friction=0.3, mass_scale=0.95)
    varied, built = MujocoPlant(file), MujocoPlant(file, friction=0.3, mass_scale=0.95)
    varied.vary(world)
    q = built.read().q
    for plant in (varied, built):
        plant.place(q, np.array([1.0, 0.5, *np.zeros(16)]))
        for _ in range(50):
            plant.write(JointCommand.servo(np.tile([0.0, 0.8, -1.6], 4), np.zeros(12), 30.0, 1.0))
    assert varied.read().q == pytest.approx(built.read().q, abs=1e-12)
    assert np.linalg.norm(varied.read().q[:2] - q[:2]) > 0.05


def test_a_save_brings_back_the_delay_that_it_had() -> None:
    plant = plant_in_world(World(delay=0.006))
    saved = plant.save()
    plant.vary(World(delay=0.0))
    plant.restore(saved)
    for _ in range(3):
        plant.write(JointCommand.torque(np.full(12, 1.5)))
    assert not np.allclose(plant.read().tau, 1.5)
    plant.write(JointCommand.torque(np.full(12, 1.5)))
    assert np.allclose(plant.read().tau, 1.5)
