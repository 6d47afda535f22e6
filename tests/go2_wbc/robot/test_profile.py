"""What makes a robot this one is data, and every model of it is made of the same."""

import pickle
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from controller.arguments import config as read_config
from go2_wbc.config import Config, load_config
from go2_wbc.errors import ConfigError, ModelMismatch
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics, build_spec
from go2_wbc.robot.description import RobotProfile, find_description, find_profile, profile_names
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker
from tests.engine_helpers import random_state

OTHERS = [name for name in profile_names() if name != "go2"]
ROUNDING = 1e-9  # [SI]; a Go1's base of 1 mg is a point in MuJoCo, and so is 1e-6 of its inertia
EVERY = pytest.mark.parametrize("name", profile_names())


def model_of(name: str) -> RobotModel:
    return RobotModel(find_description(robot=name))


def written(folder: Path, name: str) -> Path:
    """An MJCF of a robot."""
    description = find_description(robot=name)
    spec = build_spec(description, JointDynamics.of(description.profile), friction=0.8)
    file = folder / f"{name}.xml"
    file.write_text(spec.to_xml(), encoding="utf-8")
    return file


def test_robots_of_three_kinds_and_one_value_each_ship_and_others_are_refused(
    tmp_path: Path,
) -> None:
    assert profile_names() == ("a1", "go1", "go2")
    file = tmp_path / "mine.toml"
    file.write_text('robot = "b9"\n', encoding="utf-8")
    for make in (lambda: find_profile("b9"), lambda: load_config(file)):
        with pytest.raises(ConfigError, match="unknown robot 'b9'; valid: a1, go1, go2"):
            make()


@EVERY
def test_a_robots_profile_snapshot_and_simulation_are_those_of_its_model(name: str) -> None:
    profile = find_profile(name)
    assert isinstance(profile, RobotProfile)
    assert hash(profile) == hash(find_profile(name))
    assert pickle.loads(pickle.dumps(profile)) == profile
    model, rng = model_of(name), np.random.default_rng(7)
    for _ in range(20):
        state = random_state(rng)
        ours, theirs = model.snapshot(state), model.pinocchio_snapshot(state)
        np.testing.assert_allclose(ours.row, theirs.row, atol=ROUNDING)
        assert ours.profile is theirs.profile is model.profile
    model, plant = model_of(name), MujocoPlant(robot=name)
    assert plant.robot == name
    assert plant.total_mass == pytest.approx(model.mass, rel=1e-6)
    p_feet = model.snapshot(plant.truth()).p_world_feet
    np.testing.assert_allclose(plant.p_world_feet, p_feet, atol=1e-6)
    assert {plant.model.geom(f"{leg}_foot").size[0] for leg in ("FL", "RR")} == {model.foot_radius}
    np.testing.assert_array_equal(plant.torque_limits, model.torque_limits)


@pytest.mark.parametrize("name", OTHERS)
def test_the_geometry_of_a_profile_is_that_of_its_urdf(name: str) -> None:
    description, profile = find_description(robot=name), find_profile(name)
    urdf = ET.parse(description.urdf_path).getroot()
    foot = urdf.find("link[@name='FL_foot']/collision/geometry/sphere")
    imu = urdf.find("joint[@name='imu_joint']/origin")
    trunk = urdf.find("link[@name='trunk']/collision/geometry/box")
    assert foot is not None and imu is not None and trunk is not None  # noqa: PT018
    assert profile.foot_radius == float(foot.attrib["radius"])
    assert profile.imu_place == tuple(map(float, imu.attrib["xyz"].split()))
    half = 0.5 * np.array([float(size) for size in trunk.attrib["size"].split()])
    np.testing.assert_allclose(np.abs(profile.underside_points), np.tile(half, (4, 1)), atol=1e-9)


@EVERY
def test_every_robot_can_raise_its_paw_and_bow(name: str) -> None:
    checker = FeasibilityChecker(model_of(name))
    assert checker.check("high_five").ok
    assert checker.check("bow").ok


def test_a_file_that_names_a_robot_begins_with_its_numbers(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('robot = "a1"\n[safety]\nqp_patience = 3\n', encoding="utf-8")
    config = load_config(file)
    assert config.locomotion == Config.of_robot("a1").locomotion != Config().locomotion
    assert (config.robot, config.safety.qp_patience) == ("a1", 3)


def test_robot_plant_and_configuration_must_be_of_one_robot() -> None:
    plant = MujocoPlant(robot="a1")
    assert read_config(None, None, plant) == Config.of_robot("a1")
    with pytest.raises(ConfigError, match="robot says 'go1', plant says 'a1', config says 'go1'"):
        read_config(None, "go1", plant)
    with pytest.raises(ConfigError, match="plant says 'a1', config says 'go2'"):
        read_config(Config(), None, plant)


@pytest.mark.parametrize("name", OTHERS)
def test_the_file_of_another_robot_is_named(tmp_path: Path, name: str) -> None:
    file = written(tmp_path, name)
    with pytest.raises(ModelMismatch, match=rf"as a Go2:(?s:.)*give robot='{name}'"):
        MujocoPlant(file)
    assert MujocoPlant(file, robot=name).robot == name
