"""Checks without forces: what is looked at, and when."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline
from motions.feasibility.bodies import LinkHulls, SelfCollision
from motions.feasibility.kinematic import clearance, ends
from motions.plan.trajectory import Trajectory, trajectory_of
from tests.motions.feasibility.cases import case_of


@pytest.fixture(scope="module")
def hulls(model: RobotModel) -> LinkHulls:
    return LinkHulls(model, SelfCollision(model).geometry)


@pytest.fixture(scope="module")
def plan(model: RobotModel) -> MotionPlan:
    line = Timeline().foot("FR", z=0.06, over=0.8).home(over=0.8)
    return compile_timeline(line.foot("RL", z=0.06, over=0.8).home(over=0.8), model)


@pytest.fixture(scope="module")
def raising(plan: MotionPlan, model: RobotModel) -> Trajectory:
    return trajectory_of(plan, model)


def test_a_standing_foot_and_calves_of_solved_parts_may_come_near_the_ground(
    model: RobotModel, hulls: LinkHulls, raising: Trajectory
) -> None:
    series = clearance(case_of(raising, model), hulls)
    unchecked = np.isnan(series.margins)
    for leg in LEGS:
        foot = unchecked[:, series.subjects.index(f"{leg.name} foot")]
        assert foot.tolist() == raising.stance[:, leg].tolist()
    assert not unchecked[:, : len(hulls.links)].any()
    # Deep push-offs pass 1.1 to 1.9 mm above it, and were refused though nothing touched.
    limits, is_dynamic = FeasibilityLimits(), np.arange(len(raising.times)) < 10
    series = clearance(case_of(replace(raising, is_dynamic=is_dynamic), model), hulls)
    floor = series.limits[:, series.subjects.index("FL calf")]
    assert set(floor[:10]) == {limits.solved_calf_clearance}
    assert set(floor[10:]) == {limits.calf_clearance}


def test_a_calf_may_go_down_with_its_foot_which_stands_until_it_has_lifted_off(
    model: RobotModel, hulls: LinkHulls, raising: Trajectory
) -> None:
    """Far jumps sank by 7 mm in the last step of the push-off, and were refused though done."""
    solved = replace(raising, is_dynamic=np.ones(len(raising.times), dtype=bool))
    unchecked = np.isnan(clearance(case_of(solved, model), hulls).margins)
    stands = raising.stance
    lifts = stands[:-1] & ~stands[1:]
    assert lifts.any()
    np.testing.assert_array_equal(unchecked[1:, -4:], stands[1:] | lifts)
    # The foot stays above it, and the calf with it: all five refused for it were done.
    limits, stance, q = FeasibilityLimits(), raising.stance.copy(), raising.q.copy()
    stance[:10, Leg.FL] = False
    q[:10, 2] -= 0.005
    series = clearance(case_of(replace(raising, stance=stance, q=q), model), hulls)
    floor = series.limits[:10, series.subjects.index("FL calf")]
    np.testing.assert_allclose(floor, limits.calf_clearance - 0.005, atol=1e-4)
    standing = series.limits[:10, series.subjects.index("RR calf")]
    assert set(standing) == {limits.calf_clearance}


@pytest.mark.parametrize(("end", "row"), [("entry", 0), ("exit", -1)])
def test_the_ends_are_the_very_first_and_the_very_last_sample(
    plan: MotionPlan, model: RobotModel, raising: Trajectory, end: str, row: int
) -> None:
    q, rpy, v = raising.q.copy(), raising.rpy.copy(), raising.v.copy()
    q[row, 1] += 0.07
    rpy[row, 2] -= 0.2
    v[row, 9] = -0.9
    bent = replace(raising, q=q, rpy=rpy, v=v)
    series = ends(case_of(bent, model), plan)
    values = dict(zip(series.subjects, series.values[0].tolist(), strict=True))
    expected = {f"{end} place": 0.07, f"{end} attitude": 0.2, f"{end} speed": 0.9}
    other = {name: value for name, value in values.items() if name not in expected}
    assert {name: values[name] for name in expected} == pytest.approx(expected, abs=1e-5)
    assert max(other.values()) < 1e-5


@pytest.mark.parametrize(("end", "row"), [("entry", 0), ("exit", -1)])
def test_a_motion_that_begins_or_ends_with_a_foot_in_the_air_has_no_place(
    plan: MotionPlan, model: RobotModel, raising: Trajectory, end: str, row: int
) -> None:
    stance, q = raising.stance.copy(), raising.q.copy()
    stance[row, 2] = False
    q[row, 7 + 8] -= 0.2  # the calf, bent: the foot is raised
    series = ends(case_of(replace(raising, stance=stance, q=q), model), plan)
    broken = {finding.subject for finding in series.findings() if finding.margin < 0.0}
    assert broken == {f"{end} place"}


def test_a_foot_that_is_lifted_from_the_first_instant_on_still_stands_then(
    plan: MotionPlan, model: RobotModel, raising: Trajectory
) -> None:
    stance = raising.stance.copy()
    stance[0, 2] = False
    series = ends(case_of(replace(raising, stance=stance), model), plan)
    assert not series.is_broken
