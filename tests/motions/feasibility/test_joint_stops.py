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
from motions import Timeline, compile_timeline, deg
from motions.feasibility.check import FeasibilityChecker
from motions.feasibility.joint_stops import joint_position, trunk_at_stops
from motions.plan.trajectory import Trajectory, trajectory_of
from tests.motions.feasibility.cases import case_of

NEAR = 5e-4
"""Distance [m] from the nearest place: constraints are linear around it."""
GAINS = WbcConfig().body_position
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
    found = trunk_at_stops(feet[None], stance[None], GAINS, model)[0]
    K = GAINS.arrays[0]
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


@pytest.mark.parametrize("kind", ["stands", "swings", "follows joints"])
def test_what_is_near_its_place_though_joints_are_at_their_stops_passes(
    kind: str, model: RobotModel, leaning: Trajectory
) -> None:
    """Of trots and steps whose legs were stretched all were done up to 24 mm."""
    limits, calf = FeasibilityLimits(), int(Leg.FL.joints.stop) - 1
    stance, swings = leaning.stance.copy(), leaning.swings.copy()
    stance[10:20, Leg.FL], swings[10:20, Leg.FL] = kind == "stands", kind == "swings"
    geometry, own = LegGeometry.of(model, Leg.FL), leaning.q[10:11, 7:][:, Leg.FL.joints].copy()
    own[0, 2] = model.q_upper[calf]
    left, verdicts, moved = foot_places(geometry, own)[0], [], []
    for beyond in np.arange(0.0, 0.8, 0.02):
        q = leaning.q.copy()
        q[10:20, 7 + calf] = model.q_upper[calf] + beyond
        path = replace(leaning, q=q, stance=stance, swings=swings)
        verdicts.append(joint_position(case_of(path, model)).is_broken)
        own[0, 2] = model.q_upper[calf] + beyond
        foot = foot_places(geometry, own)[0]
        ways = np.linalg.norm(
            [foot - left, foot - geometry.p_base_hip, left - geometry.p_base_hip], axis=1
        )
        # The foot is turned about the knee, or comes nearer to the hip.
        moved.append(ways[0] if kind == "follows joints" else ways[1] - ways[2])
    first = verdicts.index(True)
    assert verdicts == [False] * first + [True] * (len(verdicts) - first)
    if kind == "stands":  # other legs share it
        assert moved[first] < limits.stop + 0.01
    else:
        assert moved[first - 1] - 1e-3 < limits.stop < moved[first] + 1e-3


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


def test_a_trunk_off_its_plan_at_stops_is_as_low_as_it_is_then(model: RobotModel) -> None:
    """Pitched by 38 deg the nose met the ground in 8 of 8 runs, at a chance of 91 %; by 37 in 0."""
    checker = FeasibilityChecker(model)
    for pitch, names in ((37.0, []), (38.0, ["clearance"])):
        line = Timeline().body(pitch=deg(pitch), over=0.6).home(over=0.6)
        report = checker.check(compile_timeline(line, model))
        assert [finding.check for finding in report.failures] == names
