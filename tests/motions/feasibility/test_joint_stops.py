"""Joints beyond their stops: where the trunk is then, and when it is near enough."""

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float
from scipy.optimize import minimize

from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.config import WbcConfig
from motions import Timeline, compile_timeline
from motions.feasibility.joint_stops import joint_position, trunk_at_stops
from motions.plan.trajectory import Trajectory, trajectory_of
from tests.motions.feasibility.cases import case_of

NEAR = 5e-4
"""Distance [m] from the nearest place: constraints are linear around it."""
WITHIN = 1e-3  #: Angle [rad] beyond a range that is left


@pytest.fixture(scope="module")
def leaning(model: RobotModel) -> Trajectory:
    plan = compile_timeline(Timeline().body(z=-0.01, over=0.5).hold(0.3).home(over=0.5), model)
    return trajectory_of(plan, model)


def joints_of(p_base_feet: Float[np.ndarray, "4 3"], model: RobotModel) -> Float[np.ndarray, "12"]:
    legs = [leg_angles(LegGeometry.of(model, leg), p_base_feet[leg, None]) for leg in LEGS]
    return np.concatenate([one.q[0] for one in legs])


def room(q: Float[np.ndarray, "12"], model: RobotModel) -> Float[np.ndarray, "24"]:
    return np.concatenate([model.q_upper - q, q - model.q_lower])


SHIFTS = ((0, 0, 0.13), (0, 0.21, -0.02), (0.1, -0.15, 0.02), (0, 0, 0.01))


@pytest.mark.parametrize("shift", SHIFTS)
def test_the_trunk_is_the_nearest_at_which_all_standing_legs_keep_their_ranges(
    shift: tuple[float, float, float], model: RobotModel, leaning: Trajectory
) -> None:
    """Another solver finds the same place."""
    stance = np.array([True, True, False, True])
    places = [foot_places(LegGeometry.of(model, g), leaning.q[:1, 7:][:, g.joints]) for g in LEGS]
    feet = np.array(places)[:, 0] - shift
    stands = np.tile(np.repeat(stance, 3), 2)
    found = trunk_at_stops(feet[None], stance[None], model)[0]
    K = WbcConfig().body_position.arrays[0]
    best = minimize(
        lambda p: 1e3 * p @ (K * p),
        -np.array(shift),
        method="SLSQP",
        constraints={
            "type": "ineq",
            "fun": lambda p: room(joints_of(feet - p, model), model)[stands],
        },
    )
    assert best.success
    np.testing.assert_allclose(found, best.x, atol=NEAR)
    assert room(joints_of(feet - found, model), model)[stands].min() > -WITHIN
    is_within = room(joints_of(feet, model), model)[stands].min() >= 0.0
    assert (np.linalg.norm(found) == 0.0) == is_within == (shift == SHIFTS[-1])


def test_a_trunk_or_foot_that_is_near_its_place_though_joints_are_at_their_stops_passes(
    model: RobotModel, leaning: Trajectory
) -> None:
    """Of trots whose legs were stretched by more, those up to 25 mm off were done."""
    limits, calf = FeasibilityLimits(), int(Leg.FL.joints.stop) - 1
    for stands, most in ((True, limits.off), (False, limits.stop)):
        stance, verdicts = leaning.stance.copy(), []
        stance[10:20, Leg.FL] = stands
        for beyond in np.arange(0.0, 0.8, 0.02):
            q = leaning.q.copy()
            q[10:20, 7 + calf] = model.q_upper[calf] + beyond
            series = joint_position(case_of(replace(leaning, q=q, stance=stance), model))
            verdicts.append(series.is_broken)
        first = verdicts.index(True)
        assert verdicts == [False] * first + [True] * (len(verdicts) - first)
        own = slice(7 + Leg.FL.joints.start, 7 + Leg.FL.joints.stop)
        last = leaning.q[10].copy()
        last[7 + calf] = model.q_upper[calf]
        asked = last.copy()
        asked[7 + calf] += 0.02 * (first - 0.5)
        at, to = (
            foot_places(LegGeometry.of(model, Leg.FL), x[None, own])[0] for x in (last, asked)
        )
        moved = np.linalg.norm(to - at)
        assert moved > most if stands else abs(moved - most) < 0.003


def test_hips_of_two_standing_legs_stay_clear_of_their_stops(
    model: RobotModel, leaning: Trajectory
) -> None:
    """A trunk that rolls over two feet has nothing else that holds it: such trots fell."""
    hip, limits, stance = int(Leg.FL.joints.start), FeasibilityLimits(), leaning.stance.copy()
    stance[10:20, [Leg.FR, Leg.RL]] = False
    for feet, room, is_broken in (
        (stance, 0.9 * limits.pair_hip, True),
        (stance, 1.1 * limits.pair_hip, False),
        (leaning.stance, -0.01, False),
    ):
        q = leaning.q.copy()
        q[10:20, 7 + hip] = model.q_upper[hip] - room
        series = joint_position(case_of(replace(leaning, q=q, stance=feet), model))
        assert series.is_broken == is_broken, room
