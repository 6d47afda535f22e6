"""What the MPC looks at: where the feet will be of a robot that a push has thrown."""

import numpy as np

from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.force_mpc import excess_velocity, look_ahead
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.trunk import Trunk
from go2_wbc.planning.walk import Planner, Walk
from tests.go2_wbc.planning.squared import MODEL, at, moving, resting

CONFIG = LocomotionConfig()
COMMAND = VelocityCommand(0.5)
FARTHEST = 0.65  # m, a foot from the CoM at 3.7 m/s: 0.60


def test_feet_of_a_thrown_robot_come_down_below_it() -> None:
    """With the wanted way they were 1.03 m from it; forces planned for these tipped it over."""
    planner, thrown = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG), resting()
    planner.start(thrown)
    for tick in range(30):
        thrown = at(moving(resting(), np.array([3.7, 0.0, 0.0])), 0.01 * tick)
        planner.update(thrown, COMMAND)
    look_ahead(thrown, planner._state, planner._walk, planner._command)
    seen = planner._state.horizon
    presses = seen.share >= CONFIG.mpc.least_share
    assert presses.any(axis=0).all()
    assert np.linalg.norm(seen.arms[presses][:, :2], axis=1).max() <= FARTHEST


def test_within_the_margin_the_wanted_way_counts() -> None:
    walk, wanted = Walk.of(MODEL, GAITS["trot"], CONFIG), np.array([0.3, 0.1])
    planner, margin = Planner(trunk=Trunk(velocity=np.array([*wanted, 0.0]))), CONFIG.stride_margin
    for beyond, left in (((0.6, -0.8), 0.0), ((0.0, 1.0 + 1.0 / margin), 1.0), ((0.0, 0.0), 0.0)):
        velocity = wanted + margin * np.array(beyond)
        found = excess_velocity(moving(resting(), np.array([*velocity, 0.0])), planner, walk)
        np.testing.assert_allclose(found, [0.0, left], atol=1e-12)


def test_the_attitude_of_a_thrown_robot_weighs_less() -> None:
    """Kept with all its weight, feet in the air were swung 0.2 m off to turn the trunk."""
    planner = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG)
    planner.start(resting())
    margin, unit, discounts = CONFIG.stride_margin, CONFIG.mpc.throw_speed, []
    for tick, aside in enumerate((0.0, 0.9 * margin, margin + unit, margin + 4.0 * unit), 1):
        thrown = at(moving(resting(), np.array([0.0, aside, 0.0])), 0.001 * tick)
        discounts.append(planner.update(thrown, COMMAND).orientation_discount)
    np.testing.assert_allclose(discounts, [0.0, 0.0, 1.0, 4.0], atol=1e-3)
