"""What a plan asks for at every instant: of its curves, its contacts, and many samples at once."""

from dataclasses import fields
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from controller import GO2Controller
from go2_wbc.contacts import GAITS, TIE, ContactSchedule
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.reference import LegTask, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rpy_from_rotation
from motions import CompiledPlan, FeasibilityChecker, Timeline, compile_timeline, deg, load_motion
from motions.plan.compiled_plan import PlanSamples
from motions.postures import NORMAL_FORCE_MAX, sit_down
from tests.motions.plans import curves_at, library_plan
from tests.solver import needs_solver

ROUNDING = 1e-12  # m, rad; N of 400
STEP = 1e-5  # s; of the differences
EXACT: dict[str, Any] = {"rtol": 1e-5, "atol": 1e-5}
START = np.array([0.02, -0.01, 0.25, 0.15, -0.2, 0.4])


@pytest.mark.parametrize("name", ["high_five", "tap_dance", "sit_pretty"])
def test_samples_are_the_references(name: str) -> None:
    plan = compile_timeline(load_motion(name), RobotModel())
    times = np.array([-1.0, *np.arange(0.0, plan.duration, 0.017), plan.duration, 99.0])
    places = np.array([plan.at(float(t)).p_world_feet for t in times])
    found, expected = plan.samples(times), PlanSamples.one_by_one(plan, times, places)
    for field in fields(PlanSamples):
        one, other = getattr(found, field.name), getattr(expected, field.name)
        assert one.dtype == other.dtype
        difference = np.abs(one.astype(float) - other.astype(float))
        scale = 400.0 if field.name == "normal_force_max" else 1.0
        assert difference.max() <= scale * ROUNDING, field.name


def test_a_held_foot_is_as_high_as_it_is_in_the_middle_of_its_hold() -> None:
    plan = library_plan("high_five")
    (held,) = plan.held_feet
    middle = 0.5 * (held.start + held.end)
    assert held.height == pytest.approx(plan.at(middle).p_world_feet[held.leg, 2], abs=ROUNDING)
    assert held.height > 0.05


@pytest.mark.parametrize("name", ["high_five", "dance", "wave", "sit_pretty", "jump_up"])
def test_a_reference_says_what_curves_and_contacts_say(name: str) -> None:
    plan, rng = library_plan(name), np.random.default_rng(3)
    instants = rng.uniform(-0.3, plan.duration + 0.3, size=200)
    events = np.add.outer(plan.contacts.times, [-2e-9, -5e-10, 0.0, 5e-10, 2e-9]).ravel()
    for t in (*instants.tolist(), *events.tolist(), *plan.curves.x[:20].tolist(), plan.duration):
        asked, curves = plan.at(t), curves_at(plan, t)
        body, joints, feet = np.split(curves, [6, 18], axis=1)
        told = (asked.body.p_world, asked.body.v_world, asked.body.a_world)
        assert np.array(told) == pytest.approx(body[:, :3], abs=1e-9)
        R = Rotation.from_euler("xyz", body[0, 3:]).as_matrix()
        assert asked.body.R_world_base == pytest.approx(R, abs=1e-9)
        told = (asked.q_joints, asked.v_joints, asked.a_joints)
        assert np.array(told) == pytest.approx(joints, abs=1e-9)
        told = (asked.p_world_feet, asked.v_world_feet, asked.a_world_feet)
        assert np.array(told) == pytest.approx(feet.reshape(3, 4, 3), abs=1e-9)
        assert asked.body.point is TrackedPoint.COM
        event = np.flatnonzero(np.array(plan.contacts.times) <= t + TIE)
        row = event[-1] if len(event) else 0
        in_air = np.where(plan.swings[row], LegTask.SWING, LegTask.JOINTS)
        tasks = np.where(plan.contacts.modes[row], LegTask.STANCE, in_air)
        assert list(asked.legs) == tasks.tolist()


def test_a_foot_is_unloaded_evenly_before_it_lifts_and_loaded_after_it_lands() -> None:
    plan = library_plan("wave")
    (lift_off, landing) = (t for t in plan.contacts.times if t > 0.0)
    (leg,) = np.flatnonzero(~plan.contacts.at(0.5 * (lift_off + landing)).stance)
    for t in np.linspace(0.0, plan.duration, 500):
        share = np.clip(max(lift_off - t, t - landing) / plan.ramp, 0.0, 1.0)
        asked = plan.at(float(t))
        assert asked.normal_force_max[leg] == pytest.approx(NORMAL_FORCE_MAX * share, abs=1e-6)
        assert (np.delete(asked.normal_force_max, leg) == NORMAL_FORCE_MAX).all()
        assert not asked.normal_force_min.any()


def lively() -> MotionPlan:
    line = Timeline().body(x=0.02, z=-0.03, roll=deg(6), pitch=deg(-7), yaw=deg(10), over=0.8)
    return compile_timeline(line.foot("FR", z=0.05, over=0.8).home(over=1.0), RobotModel())


@pytest.mark.parametrize("make", [lively, lambda: sit_down(START)])
def test_velocities_and_accelerations_of_a_plan_are_derivatives(make) -> None:  # noqa: ANN001
    plan = make()
    for t in np.linspace(0.0, plan.duration, 23)[1:-1] + 0.0123:
        if t > plan.duration - 0.01:
            continue
        before, now, after = (plan.at(float(t + d)) for d in (-STEP, 0.0, STEP))
        b0, b, b1 = before.body, now.body, after.body
        two = 2.0 * STEP
        assert b.p_world.shape == (3,)
        np.testing.assert_allclose(b.v_world, (b1.p_world - b0.p_world) / two, **EXACT)
        np.testing.assert_allclose(b.a_world, (b1.v_world - b0.v_world) / two, **EXACT)
        turned = log_rotation(b1.R_world_base @ b0.R_world_base.T) / two
        np.testing.assert_allclose(b.w_world, turned, **EXACT)
        np.testing.assert_allclose(b.dw_world, (b1.w_world - b0.w_world) / two, **EXACT)
        np.testing.assert_allclose(now.v_joints, (after.q_joints - before.q_joints) / two, **EXACT)
        np.testing.assert_allclose(now.a_joints, (after.v_joints - before.v_joints) / two, **EXACT)


@pytest.mark.parametrize(
    "schedule",
    [
        GAITS["trot"].schedule(),
        ContactSchedule((0.5,), np.ones((1, 4), dtype=bool)),
        ContactSchedule((0.0, 1.0, 1.5), np.array([[1, 1, 1, 1], [0, 1, 1, 1], [1, 1, 0, 1]]) > 0),
    ],
    ids=["trot", "standing", "steps"],
)
def test_contacts_at_many_times_are_those_of_each(schedule: ContactSchedule) -> None:
    times = np.concatenate([np.random.default_rng(1).uniform(-1.0, 4.0, 200), [0.0, 1.0, 0.18]])
    many = schedule.at_times(times)
    for row, t in enumerate(times.tolist()):
        one = schedule.at(t)
        for name in ("stance", "elapsed", "remaining"):
            assert getattr(many, name)[row] == pytest.approx(getattr(one, name), abs=ROUNDING), name
        assert many.load_share(0.1)[row] == pytest.approx(one.load_share(0.1), abs=1e-9)


MODEL = RobotModel()
NEAR = 1e-3
"""How near [m, rad] the planned state is to the curves, which are cubics through its knots; where
accelerations jump, angles cut corners."""


@pytest.fixture(scope="module")
def rear() -> CompiledPlan:
    return compile_timeline(load_motion("rear_up"), MODEL)


def test_gains_are_there_while_two_feet_stand_and_only_then(rear: CompiledPlan) -> None:
    for t in np.arange(0.011, rear.duration, 0.02).tolist():
        stands = int(rear.at(t).stance.sum())
        assert (rear.feedback_at(t) is not None) == (1 <= stands <= 2), t
    jump = compile_timeline(load_motion("jump_up"), MODEL)
    flies = [t for t in np.arange(0.0, jump.duration, 0.01).tolist() if not jump.at(t).stance.any()]
    assert flies
    assert all(jump.feedback_at(t) is None for t in flies)


def test_the_planned_state_is_that_of_the_curves_that_are_played(rear: CompiledPlan) -> None:
    times = np.linspace(0.0, rear.duration, 200).tolist()
    states = [(t, found) for t in times if (found := rear.feedback_at(t)) is not None]
    assert len(states) > 20
    angles = list[np.ndarray]()
    for t, state in states:
        values = curves_at(rear, t)[0]
        assert MODEL.center_of_mass(state.q) == pytest.approx(values[:3], abs=NEAR)
        rpy = rpy_from_rotation(pin.Quaternion(state.q[3:7]).toRotationMatrix())
        angles.append(np.concatenate([rpy, state.q[7:]]) - values[3:18])
    assert np.median(np.abs(angles).max(axis=1)) < NEAR


@needs_solver
def test_a_robot_that_rears_for_long_stays_up_and_level() -> None:
    """With gains for place and attitude apart it fell over, as it came down, after 0.9 s."""
    checked = FeasibilityChecker(MODEL).evaluate(Timeline().rear(deg(-25), hold=0.9))
    assert checked.report.ok
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.play(checked), go2.last_outcome.reason
