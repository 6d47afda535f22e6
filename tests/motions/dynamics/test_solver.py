"""Plans obey the equations of motion and every limit, computed here without the planner's code."""

import math
import sys
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import MissingDependency, PlanNotFound, TimelineError
from go2_wbc.legs import FOOT_NAMES, LEGS
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, PhaseProblem, Solved, Tolerance, audit, solve
from motions.dynamics import phases as phase_builders
from motions.dynamics.plan_audit import PlanLimits
from motions.dynamics.solver import continued
from motions.postures import standing_feet
from tests.motions.dynamics.conftest import PROBLEMS

DEFECT = 1e-6  # N, N m: rounding of sums of forces of 1e3 N
SLACK = 1.02  # the barriers are quadratic: forces pass them by a few newtons
AGREED = 1.05  # of what a plan may use: how exactly torques and speeds must agree
ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def test_every_knot_obeys_the_equations_of_motion(
    plan: DynamicTrajectory, model: RobotModel
) -> None:
    data = model.pin_model.createData()
    for row, dt in enumerate(np.diff(plan.times)):
        q, v = plan.q[row], plan.v[row]
        M = pin.crba(model.pin_model, data, q)
        M = np.triu(M) + np.triu(M, 1).T
        rest = M @ (plan.v[row + 1] - v) / dt + pin.nonLinearEffects(model.pin_model, data, q, v)
        rest[6:] -= plan.tau[row]
        pin.computeJointJacobians(model.pin_model, data, q)
        for foot, force in zip(FOOT_NAMES, plan.forces[row], strict=True):
            frame = model.pin_model.getFrameId(foot)
            rest -= pin.getFrameJacobian(model.pin_model, data, frame, ALIGNED)[:3].T @ force
        assert np.abs(rest).max() < DEFECT
        reached = pin.integrate(model.pin_model, q, dt * plan.v[row + 1])
        assert plan.q[row + 1] == pytest.approx(reached, abs=1e-9)


def test_only_standing_feet_push_and_the_trunk_turns_by_its_rates(plan: DynamicTrajectory) -> None:
    limits = PlanLimits()
    assert not plan.forces[~plan.stance].any()
    normal, tangential = plan.forces[..., 2], np.linalg.norm(plan.forces[..., :2], axis=-1)
    assert normal.min() > -1.0
    assert normal.max() < limits.force_max * SLACK
    assert (tangential <= SLACK * limits.friction * normal + 1.0).all()
    turned = pin.Quaternion(plan.q[0, 3:7]).toRotationMatrix()
    for dt, v in zip(np.diff(plan.times), plan.v[1:], strict=True):
        turned = turned @ pin.exp3(dt * v[3:6])
    end = pin.Quaternion(plan.q[-1, 3:7]).toRotationMatrix()
    assert turned == pytest.approx(end, abs=1e-6)


def test_torques_stay_below_the_motors_line_until_the_end_of_a_step(
    plan: DynamicTrajectory, model: RobotModel
) -> None:
    for v in (plan.v[:-1, 6:], plan.v[1:, 6:]):
        lower, upper = model.motor.limits(v)
        assert (plan.tau >= lower).all()
        assert (plan.tau <= upper).all()
    assert (np.abs(plan.tau) <= 0.85 * model.torque_limits + 1e-9).all()
    assert (np.abs(plan.v[:, 6:]) <= model.speed_limits).all()
    assert (plan.q[:, 7:] >= model.q_lower).all()
    assert (plan.q[:, 7:] <= model.q_upper).all()
    # A torque holds through its step; bounded by the speed in its middle it asked 2.05 there.
    plan = solve(PhaseProblem(phase_builders.jump(yaw=math.radians(90.0), height=0.12)), model)
    limits = PlanLimits()
    middle = 0.5 * (plan.v[:-1, 6:] + plan.v[1:, 6:])
    assert 0.9 < model.motor.share(plan.tau, plan.v[1:, 6:]).max() <= AGREED * limits.end_share
    assert model.motor.share(plan.tau, middle).max() <= AGREED * limits.torque_share


def test_feet_stand_still_or_are_above_the_ground(
    plan: DynamicTrajectory, model: RobotModel
) -> None:
    for leg in LEGS:
        for row, stands in enumerate(plan.stance[:, leg]):
            before, after = plan.p_feet[row, leg], plan.p_feet[row + 1, leg]
            if stands:
                assert np.linalg.norm(after - before) < 0.006  # in the knot of its touchdown
            else:
                assert after[2] > model.foot_radius - 0.005


def test_a_plan_ends_at_rest_where_it_was_asked_to(
    plan: DynamicTrajectory, name: str, model: RobotModel
) -> None:
    ends = Anchor.of_feet(plan.p_feet[-1], model.foot_radius)
    wanted = Anchor.of_feet(standing_feet(model) + PROBLEMS[name].shift, model.foot_radius)
    assert ends.p_world == pytest.approx(wanted.p_world, abs=0.01)
    assert ends.yaw == pytest.approx(wanted.yaw, abs=math.radians(1.0))
    assert np.abs(plan.v[-1]).max() < 0.3
    assert plan.position_deviation < 0.05
    assert plan.angle_deviation < math.radians(8.0)


def test_a_jump_leaves_the_ground_and_rearing_frees_the_front_feet(
    plans: dict[str, DynamicTrajectory],
) -> None:
    height = plans["jump"].p_feet[:, :, 2].min(axis=1).max() - plans["jump"].p_feet[0, 0, 2]
    assert height == pytest.approx(0.15, abs=0.02)
    assert not plans["jump"].stance.any(axis=1).all()
    rear = plans["rear"]
    pitch = [pin.rpy.matrixToRpy(pin.Quaternion(q[3:7]).matrix())[1] for q in rear.q]
    assert min(pitch) < math.radians(-24.0)
    off = ~rear.stance[:, :2].any(axis=1)
    assert np.diff(rear.times)[off].sum() >= 0.5


def test_the_same_question_has_the_same_answer(
    plans: dict[str, DynamicTrajectory], model: RobotModel
) -> None:
    assert solve(PROBLEMS["lift"], model).to_bytes() == plans["lift"].to_bytes()


def test_a_budget_is_kept_progress_told_and_a_near_miss_no_plan(
    plans: dict[str, DynamicTrajectory], model: RobotModel
) -> None:
    told: list[int] = []
    with pytest.raises(PlanNotFound, match=r"within 0\.05 s of processor time"):
        solve(PROBLEMS["jump"], model, budget=0.05, progress=lambda count, _: told.append(count))
    assert told == list(range(1, len(told) + 1))
    problem = PhaseProblem(phase_builders.lift(), tolerance=Tolerance(position=1e-6))
    with pytest.raises(PlanNotFound, match=r"nearest one is off") as caught:
        solve(problem, model)
    assert any("trunk at" in reason or "foot at" in reason for reason in caught.value.reasons)


def test_without_crocoddyl_the_extra_is_named(
    monkeypatch: pytest.MonkeyPatch, model: RobotModel
) -> None:
    monkeypatch.setitem(sys.modules, "crocoddyl", None)
    with pytest.raises(MissingDependency, match=r"pip install .go2-wbc\[dynamics\]"):
        solve(PROBLEMS["lift"], model)


EXACT = 1e-9
FARTHER = PhaseProblem(phase_builders.jump(x=-0.33, yaw=0.55))


@pytest.fixture
def jump(plans: dict[str, DynamicTrajectory]) -> Solved:
    return Solved(PROBLEMS["jump"], plans["jump"])


def test_a_plan_starts_itself_at_its_own_knots_and_longer_ones_but_no_other_feet(
    jump: Solved, model: RobotModel
) -> None:
    x, tau = continued(jump, jump.problem, jump.plan.times, model)
    np.testing.assert_allclose(x[:, :19], jump.plan.q, atol=EXACT)
    np.testing.assert_allclose(x[:, 19:], jump.plan.v, atol=EXACT)
    np.testing.assert_array_equal(tau, jump.plan.tau)
    push, factor = jump.problem.phases[1], 1.5
    phases = list(jump.problem.phases)
    phases[1] = replace(push, duration=factor * push.duration)
    begin, end = phases[0].duration, phases[0].duration + push.duration
    times = np.array([begin, begin + factor * push.duration])
    x, _ = continued(jump, PhaseProblem(tuple(phases)), times, model)
    rows = np.searchsorted(jump.plan.times, np.array([begin, end]) - EXACT)
    np.testing.assert_allclose(x[:, :19], jump.plan.q[rows], atol=1e-6)
    with pytest.raises(TimelineError, match=r"of 6 phases is no start for these 6: the same feet"):
        solve(PROBLEMS["rear"], model, start=jump)


def test_a_start_next_to_it_finds_a_plan_in_fewer_iterations(
    jump: Solved, model: RobotModel
) -> None:
    cold, warm = solve(FARTHER, model), solve(FARTHER, model, start=jump)
    assert warm.iterations < cold.iterations
    assert all(reading.is_kept for reading in audit(warm, model))
    np.testing.assert_allclose(warm.p_feet[-1], cold.p_feet[-1], atol=0.01)
