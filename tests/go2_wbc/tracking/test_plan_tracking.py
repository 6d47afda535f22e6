"""A plan is followed where the robot stands, and how far the robot is off it is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.planning.correction import ANGLE_WINDOW, POSITION_WINDOW, RATE, tracked_position
from go2_wbc.records import packed
from go2_wbc.reference import Anchor, BodyTarget, LegTask, Reference, Target, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.payload import NO_PAYLOAD, Payload
from go2_wbc.robot.rotations import quaternion_from_rpy, rotation_from_rpy
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.tracking.landing import Landing
from go2_wbc.tracking.plan_curves import StanceLoad
from go2_wbc.tracking.plan_tracking import Deviation, PlanTracker, Tracking, follow
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import holding_reference, random_state, standing_q, state_of
from tests.stepping_plans import hop_plan

MODEL = RobotModel()
TICK = 0.002
ROUNDING = 1e-10
ANCHOR = Anchor(np.array([0.31, -0.17, 0.043]), 1.3)


def random_plan(rng: np.random.Generator, near: np.ndarray | None = None) -> Reference:
    """Every number another one; the attitude anything, or close to ``near``."""
    R = rotation_from_rpy(*rng.uniform(-3.0, 3.0, size=3))
    if near is not None:
        R = near @ pin.exp3(rng.normal(scale=0.2, size=3))
    p, v, a, w, dw = rng.normal(scale=0.3, size=(5, 3))
    point = TrackedPoint.COM if rng.random() < 0.5 else TrackedPoint.BASE
    legs = tuple(LegTask(int(task)) for task in rng.integers(3, size=4))
    loads, feet = rng.uniform(size=(2, 4)), rng.normal(size=(3, 4, 3))
    joints, forces = rng.normal(size=(3, 12)), rng.normal(size=(4, 3))
    return Reference(
        BodyTarget(point, p, v, a, R, w, dw),
        legs,
        *loads,
        *feet,
        *joints,
        f_world_feet=forces,
        force_weight=0.01,
    )


def near(plan: Reference, rng: np.random.Generator, payload: Payload = NO_PAYLOAD) -> Snapshot:
    """A robot near where ``plan`` has its trunk, if it is played at ``ANCHOR``."""
    state, placed = random_state(rng, tilt=0.3), plan.placed(ANCHOR)
    q = state.q.copy()
    q[:3] = placed.body.p_world + rng.normal(scale=0.03, size=3)
    return MODEL.snapshot(replace(state, q=q), payload)


def target_of(plan: Reference) -> Target:
    return Target.of(plan.row.copy())


def test_without_correction_a_plan_is_placed_at_its_anchor_and_stays_what_it_is() -> None:
    rng, tracker = np.random.default_rng(2), PlanTracker(ANCHOR)
    for _ in range(50):
        plan = random_plan(rng)
        row, given = plan.row.copy(), target_of(plan)
        tracked = tracker.track(given, near(plan, rng), 0.0, 0.0)
        np.testing.assert_allclose(tracked.row, plan.placed(ANCHOR).row, atol=ROUNDING)
        np.testing.assert_array_equal(given.row, row)
    assert tracker.anchor.yaw == ANCHOR.yaw
    np.testing.assert_array_equal(tracker.anchor.p_world, ANCHOR.p_world)


def test_a_deviation_is_the_average_over_the_ticks() -> None:
    rng, tracker = np.random.default_rng(3), PlanTracker(ANCHOR)
    places, attitudes, joints = list[float](), list[float](), list[float]()
    assert tracker.deviation == Deviation(0.0, 0.0, 0.0)
    for _ in range(200):
        plan = random_plan(rng)
        snapshot, body = near(plan, rng), plan.placed(ANCHOR).body
        tracker.track(target_of(plan), snapshot, 0.0, TICK)
        off = body.p_world - tracked_position(snapshot, body.point)
        places.append(float(np.linalg.norm(off)))
        turn = Rotation.from_matrix(body.R_world_base @ snapshot.R_world_base.T)
        attitudes.append(float(turn.magnitude()))
        off = np.abs(plan.q_joints - snapshot.state.joint_positions).reshape(4, 3).max(axis=1)
        raised = [task is LegTask.JOINTS for task in plan.legs]
        joints += [float(off[raised].max())] if any(raised) else []
        found = tracker.deviation
        assert found.place == pytest.approx(np.mean(places), abs=ROUNDING)
        assert found.attitude == pytest.approx(np.mean(attitudes), abs=1e-7)
        assert found.joints == pytest.approx(np.mean(joints or [0.0]), abs=ROUNDING)


def test_a_trunk_that_a_load_leans_is_judged_by_the_plan_and_not_by_its_correction() -> None:
    q = standing_q()
    q[3:7] = quaternion_from_rpy(0.2, 0.0, 0.0)
    snapshot = MODEL.snapshot(state_of(q))
    upright = holding_reference(MODEL.snapshot(state_of(standing_q())))
    tracker = PlanTracker(Anchor(np.zeros(3), 0.0))
    tracked = upright
    for _ in range(2000):
        tracked = tracker.track(target_of(upright), snapshot, 0.0, TICK)
    assert np.arccos(tracked.body.R_world_base[2, 2]) > 0.25, "the correction pulls against it"
    sag, lean = tracker.sag_and_lean
    assert lean == pytest.approx(0.2, abs=1e-9)
    assert sag == pytest.approx(upright.body.p_world[2] - snapshot.p_world_com[2])


@pytest.mark.parametrize("legs", [(LegTask.SWING,) * 4, (LegTask.JOINTS,) * 3 + (LegTask.STANCE,)])
def test_in_flight_nothing_is_corrected(legs: tuple[LegTask, ...]) -> None:
    snapshot = MODEL.snapshot(state_of(standing_q()))
    held = replace(holding_reference(snapshot), legs=legs)
    body = replace(held.body, p_world=held.body.p_world + 0.01)
    tracker = PlanTracker(Anchor(np.zeros(3), 0.0))
    plan = replace(held, body=body)
    tracked = tracker.track(target_of(plan), snapshot, 0.0, TICK)
    is_corrected = bool((tracked.body.p_world != body.p_world).any())
    assert is_corrected == (LegTask.STANCE in legs)


def test_what_is_integrated_is_the_error_of_the_tracked_point_and_of_the_attitude() -> None:
    rng = np.random.default_rng(6)
    for _ in range(30):
        plan = replace(random_plan(rng), legs=(LegTask.STANCE,) * 4)
        snapshot, body = near(plan, rng), plan.placed(ANCHOR).body
        tracked = PlanTracker(ANCHOR).track(target_of(plan), snapshot, 0.0, TICK)
        off = body.p_world - tracked_position(snapshot, body.point)
        moved = tracked.body.p_world - body.p_world
        off = np.clip(off, -POSITION_WINDOW, POSITION_WINDOW)
        np.testing.assert_allclose(moved, RATE * TICK * off, atol=ROUNDING)
        turned = Rotation.from_matrix(tracked.body.R_world_base @ body.R_world_base.T)
        wanted = Rotation.from_matrix(body.R_world_base @ snapshot.R_world_base.T)
        off = np.clip(wanted.as_rotvec(), -ANGLE_WINDOW, ANGLE_WINDOW)
        np.testing.assert_allclose(turned.as_rotvec(), RATE * TICK * off, atol=1e-6)


@pytest.mark.parametrize("touches", [False, True])
def test_compiled_and_plain_are_the_same(touches: bool) -> None:
    rng, steps = np.random.default_rng(5), hop_plan(MODEL, 0.1, 2).footsteps
    assert steps is not None
    contacts = steps.contacts
    tables = np.array(contacts.times), np.stack([contacts.since, contacts.until, steps.unloads], -1)
    load = packed(StanceLoad(0.01, 0.0, 400.0))
    for t in np.arange(0.0, 2.0, 0.05).tolist():
        plan, state = random_plan(rng), Tracking(landing=Landing.at(ANCHOR))
        state.correction.offset[:] = rng.uniform(-0.05, 0.05, 6)
        state.correction.knows_payload = touches
        for foot in state.landing.feet:
            foot.is_in_air, foot.is_awaited = rng.random(2) < 0.5
            foot.planned = float(rng.integers(3))
        snapshot = near(plan, rng, Payload(2.0, (0.1, 0.05, 0.02)))
        feet = np.full(4, touches)
        numbers = load, state, target_of(plan)
        assert_plain_is_compiled(follow, snapshot, t, TICK, feet, *tables, *numbers)
