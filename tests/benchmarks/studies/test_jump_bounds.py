"""The bounds of jumps: identities of a push, and what more torque, speed or friction does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from benchmarks.studies.jump_bounds import (
    best_take_off,
    distance_bound,
    foot_force,
    physics_rows,
    postures,
    take_off,
    turn_bound,
)
from go2_wbc.robot.model import RobotModel
from motions.dynamics.plan_limits import PlanLimits

MODEL, LIMITS = RobotModel(), PlanLimits()
MOTOR = MODEL.motor.scaled(LIMITS.torque_share)
OFFSET = -0.05  # m, of the feet ahead of the hips
ROUNDING = 1e-9


def test_standing_feet_stay_where_they_are_while_the_trunk_rises() -> None:
    for one in postures(MODEL, OFFSET, LIMITS)[::10]:
        np.testing.assert_allclose(one.J @ one.rates, [0.0, 0.0, -1.0], atol=ROUNDING)


@pytest.mark.parametrize("speed", [0.0, 1.0, 2.0])
def test_a_feet_force_is_the_greatest_that_the_motors_hold(speed: float) -> None:
    free = replace(LIMITS, force_max=1e4, friction=0.5)
    for one in postures(MODEL, OFFSET, free)[::10]:
        force = foot_force(one, speed, MOTOR, free)
        lower, upper = (side[:3] for side in MOTOR.limits(np.tile(speed * one.rates, 4)))
        along = linprog(
            [0.0, -1.0],
            A_ub=np.vstack([-one.J[[0, 2]].T, one.J[[0, 2]].T, [[1.0, -0.5], [-1.0, -0.5]]]),
            b_ub=np.concatenate([upper, -lower, np.zeros(2)]),
            bounds=[(None, None), (0.0, None)],
        )
        assert force == pytest.approx(-along.fun, abs=1e-6)


def test_a_constant_force_gives_the_speed_of_its_work() -> None:
    """v^2 / 2 = (4 F / m - g) s, where the cap and not the motors decides."""
    weak = replace(LIMITS, force_max=50.0)
    best = take_off(postures(MODEL, OFFSET, weak), MODEL, MOTOR, weak)
    work = (4.0 * 50.0 / MODEL.mass - MODEL.gravity) * best.stroke
    assert best.speed == pytest.approx(math.sqrt(2.0 * work))
    assert best.rise == pytest.approx(work / MODEL.gravity)


def test_less_than_the_weight_does_not_jump() -> None:
    weak = replace(LIMITS, force_max=0.2 * MODEL.mass * MODEL.gravity)
    assert best_take_off(MODEL, MOTOR, weak).speed == 0.0


def test_every_limit_that_gives_way_lets_it_jump_higher() -> None:
    ideal = RobotModel(motor="ideal").motor
    fast = replace(LIMITS, force_max=1e4, speed_share=1.0)
    heights = [
        best_take_off(MODEL, MOTOR.scaled(0.7), LIMITS).feet,
        best_take_off(MODEL, MOTOR, LIMITS).feet,
        best_take_off(MODEL, MODEL.motor, fast).feet,
        best_take_off(MODEL, ideal, fast).feet,
    ]
    assert heights == sorted(heights)
    assert heights[0] < heights[1] < heights[2]


def test_distance_and_turn_grow_with_friction_until_speed_decides() -> None:
    best = best_take_off(MODEL, MOTOR, LIMITS)
    assert turn_bound(MODEL, best, 0.4) == pytest.approx(0.5 * turn_bound(MODEL, best, 0.8))
    far = [distance_bound(MODEL, best, friction) for friction in (0.2, 0.4, 5.0)]
    assert far[0] < far[1] < far[2]
    assert far[2] == pytest.approx(best.speed**2 / MODEL.gravity, rel=0.01), "at 45 deg"


def test_the_table_says_what_it_is_of() -> None:
    rows = {row.what.strip(): row.value for row in physics_rows(MODEL)}
    best = best_take_off(MODEL, MOTOR, LIMITS)
    assert rows["height of the feet, legs drawn up"] == best.feet
    assert rows["time in the air"] == pytest.approx(2.0 * best.speed / MODEL.gravity)
