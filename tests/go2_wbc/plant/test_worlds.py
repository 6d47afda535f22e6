"""The simulated robot in a world is the one that Pinocchio computes with; commands come late."""

from __future__ import annotations

from dataclasses import replace

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


def test_mass_matrix_and_gravity_are_those_of_the_loaded_robot_model() -> None:
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


def test_friction_and_joints_are_those_that_are_stated() -> None:
    plant, usual = plant_in_world(LOADED), MujocoPlant()
    assert plant.model.geom("FL_foot").friction[0] == LOADED.friction
    for name in ("dof_damping", "dof_frictionloss"):
        stated, before = (getattr(p.model, name)[6:] for p in (plant, usual))
        assert stated == pytest.approx(LOADED.joint_friction * before)


def test_a_delayed_command_acts_as_many_periods_later() -> None:
    late, prompt = (plant_in_world(World(delay=delay)) for delay in (0.006, 0.0))
    kick = replace(JointCommand.damping(3.0), tau=np.full(12, 2.0))
    still = JointCommand.damping(3.0)
    for plant in (late, prompt):
        plant.write(kick)
    for _ in range(2):
        late.write(still)
        prompt.write(still)
    assert prompt.read().tau.max() < 2.0
    late.write(still)
    assert late.read().tau.max() == pytest.approx(2.0, abs=0.5)


def test_a_restored_plant_goes_on_with_the_commands_that_were_under_way() -> None:
    plant = plant_in_world(World(delay=0.004))
    kick = replace(JointCommand.damping(3.0), tau=np.full(12, 2.0))
    plant.write(kick)
    saved, ends = plant.save(), []
    for _ in range(2):
        plant.restore(saved)
        for _ in range(5):
            plant.write(JointCommand.damping(3.0))
        ends.append(plant.read().q)
    assert (ends[0] == ends[1]).all()
