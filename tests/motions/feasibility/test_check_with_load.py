"""The world reaches the equations of the check, and the report says which one it holds for."""

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions import FeasibilityChecker, Timeline, check
from motions.feasibility.forces import CREEP, DRY, VISCOUS, forces_of, resisted

SWAY = Timeline().body(y=0.03, over=0.5).home(over=0.5)


def test_the_feet_carry_the_payload_too(model: RobotModel) -> None:
    world = World(payload=3.0, mass_scale=1.05)
    checked = FeasibilityChecker(model, world=world).evaluate(SWAY)
    weight = (1.05 * model.mass + 3.0) * model.gravity
    assert checked.forces.contact[0, :, 2].sum() == pytest.approx(weight, abs=0.05)


def test_a_payload_in_front_moves_the_centre_of_mass_over_the_feet(model: RobotModel) -> None:
    line = Timeline().foot("FR", z=0.06, over=0.6).hold(0.2).home(over=0.6)
    margins = [
        FeasibilityChecker(model, world=world).check(line).margins["support"].value
        for world in (World(), World(payload=4.0, payload_place=(0.2, 0.0, 0.0)))
    ]
    # The CoM comes forward by 4 / 20.1 of 0.2 m, less what it lies ahead of the payload's place.
    assert 0.01 < margins[0] - margins[1] < 0.05


def test_what_is_uncertain_counts_at_its_worst(model: RobotModel) -> None:
    worlds = (World(), World(mass_uncertainty=0.2), World(mass_scale=1.2))
    torques = [
        FeasibilityChecker(model, world=world).check(SWAY).margins["torque"].value
        for world in worlds
    ]
    assert torques[0] < torques[1] == pytest.approx(torques[2], rel=1e-9)


def test_what_is_uncertain_of_the_floor_counts_at_its_worst(model: RobotModel) -> None:
    world = World(friction=0.5, friction_uncertainty=0.2)
    margin = FeasibilityChecker(model, world=world).check(SWAY).margins["friction"]
    assert margin.limit == pytest.approx(0.4)


def test_joint_friction_asks_more_of_the_motors(model: RobotModel) -> None:
    path = FeasibilityChecker(model).evaluate(SWAY).path
    forces = forces_of(path, model)
    more = resisted(forces, path, World(joint_friction=2.0)).tau - forces.tau
    v = path.v[:, 6:]
    quick = np.abs(v) > 0.3
    assert quick.any()
    assert more[quick] == pytest.approx(
        2.0 * (DRY * np.tanh(v / CREEP) + VISCOUS * v)[quick], abs=2e-3
    )
    assert np.abs(more[v == 0.0]).max(initial=0.0) == 0.0


def test_a_slippery_floor_is_refused_and_named() -> None:
    usual, slippery = check("wiggle"), check("wiggle", friction=0.05)
    assert usual.ok
    assert "holds for" not in usual.table()
    assert "slip" in {finding.check for finding in slippery.failures}
    assert "That holds for friction 0.05." in slippery.table()
    loaded = check(SWAY, payload=3.0, world=World(friction=0.6))
    assert loaded.world == World(friction=0.6, payload=3.0)
    assert loaded.as_dict()["world"]["payload"] == 3.0


def test_the_table_is_narrow_in_every_world_and_says_what_no_limit_counts_with() -> None:
    world = World(
        friction_uncertainty=0.1,
        payload=2.0,
        payload_place=(0.1, 0.0, 0.06),
        mass_uncertainty=0.05,
        joint_friction_uncertainty=0.5,
        sensors="imu",
    )
    text = check(SWAY, world=world).table()
    assert max(map(len, text.splitlines())) <= 80
    assert str(world) in text.replace("\n", " ")
    assert "simulated only" in text
    assert "simulated only" not in check(SWAY, payload=2.0).table()


def test_a_world_out_of_range_is_told() -> None:
    with pytest.raises(ConfigError, match=r"World\.friction must be between 0\.0001 and 2, got 9"):
        check(SWAY, friction=9.0)


def test_a_load_that_brings_the_com_inside_does_not_help_a_controller_that_feels_it() -> None:
    # The robot shifts the CoM back to where it is without the load, and fell (MuJoCo, 5 of 5).
    line = Timeline(balance=False).foot("FR", z=0.05, over=0.8).home(over=1.0)
    without = FeasibilityChecker().check(line).margins["support"]
    assert without.margin < 0.0
    world = World(payload=4.0, payload_place=(-0.08, 0.04, 0.05))
    assert FeasibilityChecker(world=world).check(line).margins["support"].value <= without.value
