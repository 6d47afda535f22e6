"""What the MPC looks at: where the feet will be of a robot that a push has thrown."""

from __future__ import annotations

import numpy as np

from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.mpc import Horizon
from go2_wbc.planning.pose import LEVEL
from go2_wbc.planning.preview import beyond, look_ahead
from tests.go2_wbc.planning.squared import MODEL, at, moving, resting

CONFIG = LocomotionConfig()
COMMAND = VelocityCommand(0.5)
FARTHEST = 0.65  # m, a foot from the CoM at 3.7 m/s: 0.60


def horizon_at(*velocity: float) -> Horizon:
    """Of a trot that has just begun, whose CoM has ``velocity`` [m/s]."""
    planner, thrown = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG), resting()
    planner.start(thrown)
    for tick in range(30):
        thrown = at(moving(resting(), np.array(velocity)), 0.01 * tick)
        planner.update(thrown, COMMAND)
    course = planner._course(thrown, COMMAND, LEVEL, planner._clock.now())
    return look_ahead(thrown, course, CONFIG.mpc, MODEL)


def test_feet_of_a_thrown_robot_come_down_below_it() -> None:
    """With the wanted way they were 1.03 m from it; forces planned for these tipped it over."""
    horizon = horizon_at(3.7, 0.0, 0.0)
    presses = horizon.share >= CONFIG.mpc.least_share
    assert presses.any(axis=0).all()
    distance = np.linalg.norm(horizon.arms[presses][:, :2], axis=1)
    assert distance.max() <= FARTHEST


def test_within_the_margin_the_wanted_way_counts() -> None:
    margin = CONFIG.stride_margin
    np.testing.assert_array_equal(beyond(np.array([0.6, -0.8]) * margin, margin), 0.0)
    np.testing.assert_allclose(beyond(np.array([0.0, 1.4]), 0.4), [0.0, 1.0])
    np.testing.assert_array_equal(beyond(np.zeros(2), margin), 0.0)


def test_the_attitude_of_a_thrown_robot_weighs_less() -> None:
    """Kept with all its weight, feet in the air were swung 0.2 m off to turn the trunk."""
    planner = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG)
    planner.start(resting())
    margin, unit, discounts = CONFIG.stride_margin, CONFIG.mpc.throw_speed, []
    for tick, aside in enumerate((0.0, 0.9 * margin, margin + unit, margin + 4.0 * unit), 1):
        thrown = at(moving(resting(), np.array([0.0, aside, 0.0])), 0.001 * tick)
        discounts.append(planner.update(thrown, COMMAND).orientation_discount)
    np.testing.assert_allclose(discounts, [0.0, 0.0, 1.0, 4.0], atol=1e-3)
