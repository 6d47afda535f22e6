"""A world is checked, drawn from, and met by a simulated robot."""

from dataclasses import fields, replace

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.world import World

EXACT = 1e-9


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ({"friction": 0.0}, "World.friction must be between 0.0001 and 2, got 0.0"),
        ({"payload": -1.0}, "World.payload must be between 0 and 12"),
        ({"payload_place": (0.0, 0.0, 0.9)}, "World.payload_place must be between -0.5 and 0.5"),
        ({"mass_uncertainty": 0.6}, "World.mass_uncertainty must be between 0 and 0.5"),
        ({"delay": 1.0}, "World.delay must be between 0 and 0.05"),
        ({"sensors": "lidar"}, "unknown World.sensors 'lidar'; valid: ideal, imu, noisy"),
    ],
)
def test_a_world_out_of_range_is_refused(setting: dict, says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        World(**setting)


def test_a_drawn_world_lies_within_the_uncertainties_and_follows_its_seed() -> None:
    world = World(
        friction_uncertainty=0.2,
        mass_uncertainty=0.1,
        joint_friction=1.2,
        joint_friction_uncertainty=0.5,
    )
    drawn = [world.sample(np.random.default_rng(seed)) for seed in range(200)]
    assert drawn[3] == world.sample(np.random.default_rng(3))
    masses = [own.mass_scale for own in drawn]
    joints = [own.joint_friction for own in drawn]
    assert 0.9 <= min(masses) < 0.91
    assert 1.09 < max(masses) <= 1.1
    assert 0.6 <= min(joints) < 0.63
    assert 1.77 < max(joints) <= 1.8
    floors = [own.friction for own in drawn]
    assert 0.4 <= min(floors) < 0.41
    assert 0.59 < max(floors) <= 0.6
    assert world.worst.friction == pytest.approx(0.4)
    assert all(own.sample(np.random.default_rng(0)) == own for own in drawn)
    assert (world.worst.mass_scale, world.worst.joint_friction) == pytest.approx((1.1, 1.8))


@pytest.mark.parametrize(
    "setting",
    [
        {"friction": 2.0, "friction_uncertainty": 0.1},
        {"friction": 0.0001, "friction_uncertainty": 0.9},
        {"mass_scale": 3.0, "mass_uncertainty": 0.5},
        {"mass_scale": 0.25, "mass_uncertainty": 0.5},
        {"joint_friction": 10.0, "joint_friction_uncertainty": 1.0},
    ],
)
def test_what_is_uncertain_stays_in_its_range(setting: dict) -> None:
    world, name = World(**setting), next(iter(setting))
    drawn = [world.sample(np.random.default_rng(seed)) for seed in range(20)]
    values = [getattr(own, name) for own in (*drawn, world.worst)]
    assert setting[name] in values  # at the end of its range
    assert len(set(values)) > 1


def test_a_world_is_told_with_all_that_is_not_as_usual() -> None:
    assert str(World()) == "friction 0.5"
    world = World(
        friction=0.4,
        payload=2.0,
        payload_place=(0.1, 0.0, 0.06),
        joint_friction_uncertainty=0.5,
        delay=0.004,
        sensors="imu",
    )
    assert str(world) == (
        "friction 0.4, payload 2 kg at 0.1 0 0.06 m, joint friction 1 +-50 %, delay 0.004 s, "
        "sensors imu"
    )
    usual = World()
    other = {"friction": 0.6, "payload_place": (0.1, 0.0, 0.0), "sensors": "noisy", "delay": 0.01}
    for field in fields(World):
        if field.name != "payload_place":  # means nothing without a payload
            value = other.get(field.name, 1.25 if field.name == "mass_scale" else 0.375)
            assert str(replace(usual, **{field.name: value})) != str(usual), field.name
