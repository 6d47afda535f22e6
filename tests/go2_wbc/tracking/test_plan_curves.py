"""What a plan asks for at an instant: scipy's splines and rotations, and the load's ramp."""

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PPoly
from scipy.spatial.transform import Rotation

from go2_wbc.reference import LegTask, Target, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.tracking.plan_curves import PlanCurves, StanceLoad, sample, stand
from motions import compile_motion
from motions.plan.compiled_plan import CompiledPlan
from tests.compiled import assert_plain_is_compiled

ROUNDING = 1e-12
STEP = 1e-6  #: Time [s] of finite differences, which are 1e-6 of the rates wrong
DIFFERENCES: dict[str, Any] = {"rtol": 1e-5, "atol": 1e-5}
LOAD = StanceLoad(0.1, 3.0, 300.0)


def curves(seed: int) -> PlanCurves:
    """Smooth at no knot; two legs stand, one lands after 0.5 s, and one lifts off after 0.9 s."""
    rng = np.random.default_rng(seed)
    knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 0.4, 6))])
    tasks = np.array([[0, 0, 1, 0], [0, 0, 0, 0], [0, 2, 0, 0]], dtype=float)
    never, ever = -np.inf, np.inf
    since = np.array([[never] * 4, [never, never, 0.5, never], [never, 0.9, 0.5, never]])
    until = np.array([[ever, 0.9, 0.5, ever], [ever, 0.9, ever, ever], [ever] * 4])
    events = np.array([0.0, 0.5, 0.9])
    return PlanCurves(knots, rng.normal(size=(4, 6, 30)), events, tasks, since, until, LOAD)


def instants(asked: PlanCurves) -> list[float]:
    rng, end = np.random.default_rng(1), float(asked.knots[-1])
    return [*rng.uniform(0.0, end, 100).tolist(), *asked.knots[1:-1].tolist(), 0.0, end]


def test_curves_are_scipys_and_their_derivatives() -> None:
    asked = curves(0)
    spline = PPoly(asked.pieces, asked.knots)
    derivatives = spline, spline.derivative(), spline.derivative(2)
    for t in instants(asked):
        target, (value, rate, acceleration) = asked.at(t), (curve(t) for curve in derivatives)
        for name, part in (("world", slice(3)), ("world_feet", slice(18, 30))):
            for letter, truth in (("p", value), ("v", rate), ("a", acceleration)):
                found = getattr(target, f"{letter}_{name}").ravel()
                np.testing.assert_allclose(found, truth[part], atol=ROUNDING, rtol=ROUNDING)
        for letter, truth in (("q", value), ("v", rate), ("a", acceleration)):
            found = getattr(target, f"{letter}_joints")
            np.testing.assert_allclose(found, truth[6:18], atol=ROUNDING, rtol=ROUNDING)
        attitude = Rotation.from_euler("ZYX", value[5:2:-1]).as_matrix()
        np.testing.assert_allclose(target.R_world_base, attitude, atol=ROUNDING)
        assert target.is_com


def test_angular_velocity_and_acceleration_are_derivatives_of_the_attitude() -> None:
    asked = curves(2)
    for t in instants(asked)[:50]:
        before, now, after = (asked.at(t + d) for d in (-STEP, 0.0, STEP))
        turned = Rotation.from_matrix(after.R_world_base @ before.R_world_base.T).as_rotvec()
        np.testing.assert_allclose(now.w_world, turned / (2.0 * STEP), **DIFFERENCES)
        sped_up = (after.w_world - before.w_world) / (2.0 * STEP)
        np.testing.assert_allclose(now.dw_world, sped_up, **DIFFERENCES)


def test_the_ends_are_held() -> None:
    asked = curves(3)
    end = float(asked.knots[-1])
    for t, edge in ((-0.3, 0.0), (-1e-9, 0.0), (end + 1e-9, end), (end + 2.0, end)):
        held, last = asked.at(t), asked.at(edge)
        for name in ("p_world", "R_world_base", "q_joints", "p_world_feet"):
            np.testing.assert_array_equal(getattr(held, name), getattr(last, name))
        for name in ("v_world", "a_world", "w_world", "dw_world", "v_joints", "a_world_feet"):
            assert not getattr(held, name).any()
            assert getattr(last, name).any()


@pytest.mark.parametrize(
    ("t", "tasks"),
    [
        (-1.0, [0, 0, 1, 0]),
        (0.5 - 2e-9, [0, 0, 1, 0]),
        (0.5 - 5e-10, [0, 0, 0, 0]),
        (0.5, [0, 0, 0, 0]),
        (0.9 - 2e-9, [0, 0, 0, 0]),
        (0.9, [0, 2, 0, 0]),
        (7.0, [0, 2, 0, 0]),
    ],
)
def test_legs_change_what_they_do_at_events(t: float, tasks: list[int]) -> None:
    assert curves(4).at(t).legs.tolist() == tasks


def test_a_load_is_ramped_at_the_changes_of_a_foots_contact_or_comes_at_once() -> None:
    asked = curves(5)
    for t in np.arange(0.0, 1.2, 0.007):
        lifting = np.interp(t, [0.8, 0.9], [1.0, 0.0])
        landed = np.interp(t, [0.5, 0.6], [0.0, 1.0])
        share, target = np.array([1.0, lifting, landed, 1.0]), asked.at(float(t))
        np.testing.assert_allclose(target.normal_force_max, 300.0 * share, atol=1e-9)
        np.testing.assert_allclose(target.normal_force_min, 3.0 * share, atol=1e-9)
    jumps = replace(asked, load=StanceLoad(0.0, 3.0, 300.0))
    assert jumps.at(0.5 + 1e-6).normal_force_max[2] == 300.0
    assert jumps.at(0.9 - 1e-6).normal_force_max[1] == 300.0


_TABLES = ("knots", "pieces", "events", "tasks", "since", "until")


@pytest.mark.parametrize("name", ["high_five", "dance", "wave", "sit_pretty", "tap_dance"])
def test_a_plan_asks_for_its_curves_and_contacts(name: str) -> None:
    plan, rng = compile_motion(name, RobotModel()), np.random.default_rng(3)
    assert isinstance(plan, CompiledPlan)
    rates = plan.curves.derivative()
    events = np.add.outer(plan.contacts.times, [-2e-9, -5e-10, 0.0, 5e-10, 2e-9]).ravel()
    for t in (*rng.uniform(0.0, plan.duration, 200).tolist(), *events.tolist()):
        target, inside = Target.of(plan.row_at(t)), min(max(t, 0.0), plan.duration)
        np.testing.assert_allclose(target.p_world_feet.ravel(), plan.curves(inside)[18:], atol=1e-9)
        if t == inside and t < plan.duration:
            np.testing.assert_allclose(target.v_joints, rates(t)[6:18], atol=1e-9)
        phase = plan.contacts.at(t)
        np.testing.assert_array_equal(target.legs == LegTask.STANCE, phase.stance)
        share = phase.load_share(plan.ramp)
        np.testing.assert_allclose(target.normal_force_max, 400.0 * share, atol=1e-5)
        event = np.flatnonzero(np.array(plan.contacts.times) <= t + 1e-9)
        swings = plan.swings[event[-1] if len(event) else 0]
        np.testing.assert_array_equal(target.legs == LegTask.SWING, swings & ~phase.stance)


@pytest.mark.parametrize("point", TrackedPoint)
def test_a_trunk_over_four_feet(point: TrackedPoint) -> None:
    body = np.random.default_rng(4).normal(size=(3, 6))
    target = Target()
    stand(point is TrackedPoint.COM, body, 3.0, 300.0, target)
    assert target.is_com == (point is TrackedPoint.COM)
    np.testing.assert_array_equal([target.p_world, target.v_world, target.a_world], body[:, :3])
    attitude = Rotation.from_euler("ZYX", body[0, 5:2:-1]).as_matrix()
    np.testing.assert_allclose(target.R_world_base, attitude, atol=ROUNDING)
    assert (target.legs == LegTask.STANCE).all()
    assert (target.normal_force_min == 3.0).all()
    assert (target.normal_force_max == 300.0).all()
    assert not target.p_world_feet.any()


def test_a_plan_that_has_been_in_another_process_asks_for_the_same() -> None:
    asked = curves(6)
    again = pickle.loads(pickle.dumps(asked))
    np.testing.assert_array_equal(again.at(0.4).row, asked.at(0.4).row)


@pytest.mark.parametrize("t", [-0.1, 0.3, 0.52, 5.0])
def test_compiled_and_plain_are_the_same(t: float) -> None:
    asked, filled = curves(7), Target()
    tables = [getattr(asked, name) for name in _TABLES]
    assert_plain_is_compiled(sample, *tables, asked.load, t, filled)
    body = np.random.default_rng(8).normal(size=(3, 6))
    assert_plain_is_compiled(stand, True, body, 1.0, 2.0, filled)
