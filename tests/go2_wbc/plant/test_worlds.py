"""The simulated robot in a world is the one that Pinocchio computes with; commands come late."""

import mujoco
import numpy as np
import pytest

from go2_wbc import World
from go2_wbc.plant import MujocoPlant, plant_in_world
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand
from tests.engine_helpers import random_state

LOADED = World(
    friction=0.7, payload=4.0, payload_place=(0.08, -0.05, 0.1), mass_scale=1.1, joint_friction=1.5
)
CLOSE = 1e-9
"""kg, m, kg m^2: one model computed twice."""


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
