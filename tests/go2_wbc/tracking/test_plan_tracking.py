"""A plan is followed where the robot stands, and what stays of the error is taken out."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from go2_wbc.planning.trunk import (
    ANGLE_LIMIT,
    ANGLE_WINDOW,
    POSITION_LIMIT,
    POSITION_WINDOW,
    RATE,
    integrated,
)
from go2_wbc.records import packed
from go2_wbc.reference import Anchor, BodyTarget, LegTask, Reference, Target, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rigid_body import NO_PAYLOAD, Payload
from go2_wbc.robot.rotations import quaternion_from_rpy, rotation_from_rpy
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.landing import Landing
from go2_wbc.tracking.plan_curves import StanceLoad
from go2_wbc.tracking.plan_tracking import (
    HEIGHT_PER_WEIGHT,
    PITCH_PER_MOMENT,
    ROLL_PER_MOMENT,
    Correction,
    Deviation,
    PlanTracker,
    Tracking,
    correct,
    follow,
    tracked_position,
)
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import holding_reference, random_state, standing_q, state_of
from tests.stepping_plans import hop_plan

MODEL = RobotModel()
TICK = 0.002
ROUNDING = 1e-10
ANCHOR = Anchor(np.array([0.31, -0.17, 0.043]), 1.3)
LIMITS = np.repeat([POSITION_LIMIT, ANGLE_LIMIT], 3)
WINDOWS = np.repeat([POSITION_WINDOW, ANGLE_WINDOW], 3)
GRAVITY = 9.81
errors = st.lists(st.floats(-0.6, 0.6), min_size=6, max_size=6).map(np.array)


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
    assert tracker.deviation == Deviation(0.0, 0.0, None)
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
        assert (found.joints is None) == (not joints)
        assert (found.joints or 0.0) == pytest.approx(np.mean(joints or [0.0]), abs=ROUNDING)


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


@pytest.mark.parametrize("feet", range(5))
def test_in_flight_and_over_two_feet_nothing_is_corrected(feet: int) -> None:
    """What was integrated there sent trots with a rolling trunk up to 0.4 m aside, and down."""
    snapshot = MODEL.snapshot(state_of(standing_q()))
    legs = (LegTask.STANCE,) * feet + (LegTask.SWING,) * (4 - feet)
    held = replace(holding_reference(snapshot), legs=legs)
    body = replace(held.body, p_world=held.body.p_world + 0.01)
    plan = replace(held, body=body)
    tracked = PlanTracker(Anchor(np.zeros(3), 0.0)).track(target_of(plan), snapshot, 0.0, TICK)
    is_corrected = bool((tracked.body.p_world != body.p_world).any())
    assert is_corrected == (feet > 2)


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
        plan = replace(plan, force_weight=float(rng.choice([0.0, 0.01])))
        state.correction.offset[:] = rng.uniform(-0.05, 0.05, 6)
        state.correction.friction[:] = rng.uniform(-0.01, 0.01, 6)
        state.correction.knows_payload = touches
        for foot in state.landing.feet:
            foot.is_in_air, foot.is_awaited = rng.random(2) < 0.5
            foot.planned = float(rng.integers(3))
        snapshot = near(plan, rng, Payload(2.0, (0.1, 0.05, 0.02)))
        feet = np.full(4, touches)
        numbers = load, state, target_of(plan)
        assert_plain_is_compiled(follow, snapshot, t, TICK, feet, *tables, *numbers)


def snapshot_of(seed: int, payload: Payload | None = None) -> Snapshot:
    state = random_state(np.random.default_rng(seed))
    return MODEL.snapshot(state) if payload is None else MODEL.snapshot(state, payload)


NOW = snapshot_of(1)


def corrected(s: Correction, error: np.ndarray, dt: float, now: Snapshot = NOW) -> Target:
    """What is made of a target at the origin, turned by nothing."""
    target = Target(R_world_base=np.eye(3), v_world=np.ones(3))
    correct(now, error, dt, s, target)
    return target


@given(errors, st.floats(1e-4, 1e-2))
def test_an_error_is_integrated_at_the_rate_and_a_large_one_counts_as_the_window(
    error: np.ndarray, dt: float
) -> None:
    s = Correction()
    target = corrected(s, error, dt)
    expected = np.clip(np.clip(error, -WINDOWS, WINDOWS) * RATE * dt, -LIMITS, LIMITS)
    np.testing.assert_allclose(s.offset, expected, atol=1e-12)
    np.testing.assert_allclose(target.p_world, expected[:3], atol=1e-12)
    turn = Rotation.from_matrix(target.R_world_base).as_rotvec()
    np.testing.assert_allclose(turn, expected[3:], atol=1e-12)
    assert (target.v_world == 1.0).all()


@given(st.lists(errors, min_size=1, max_size=20), st.floats(1e-3, 10.0))
def test_the_correction_never_leaves_its_bounds(history: list[np.ndarray], dt: float) -> None:
    s = Correction()
    for error in history:
        corrected(s, error, dt)
        assert (np.abs(s.offset) <= LIMITS).all()


def test_a_bounded_correction_comes_back_at_once() -> None:
    """The integral is bounded itself, so it does not wind up behind the bound."""
    s, error = Correction(), np.full(6, 0.03)
    for _ in range(200):
        corrected(s, error, 10 * TICK)
    corrected(s, error, 100.0)
    np.testing.assert_array_equal(s.offset, LIMITS)
    corrected(s, -error, TICK)
    assert (s.offset < LIMITS).all()


@pytest.mark.parametrize("sag", [0.01, -0.012, 0.11, 0.4, -0.6])
def test_an_offset_goes_the_way_of_the_differential_equation(sag: float) -> None:
    """Of a body that always stands ``sag`` below its corrected reference: o' = rate clip(sag - o).

    Errors above 0.1 rad used to be dropped: a robot that leaned further leaned for good.
    """
    window, limit, times = 0.47, 0.11, np.arange(1, 1500) * TICK

    def rate(_: float, o: np.ndarray) -> np.ndarray:
        return RATE * np.clip(sag - o, -window, window)

    truth = solve_ivp(rate, (0.0, 3.0), [0.0], t_eval=times, rtol=1e-9, atol=1e-12).y[0]
    offset = 0.0
    for wanted in np.clip(truth, -limit, limit):
        offset = integrated(offset, sag - offset, TICK, RATE, window, limit)
        assert offset == pytest.approx(wanted, abs=2e-3 * abs(sag))


def test_a_target_is_turned_in_the_world_and_not_in_the_body() -> None:
    s, planned = Correction(), Rotation.from_euler("ZYX", [1.0, 0.2, -0.3])
    s.offset[:] = 0.01, -0.02, 0.03, 0.1, -0.2, 0.05
    target = Target(R_world_base=planned.as_matrix(), p_world=np.array([1.0, 2.0, 3.0]))
    correct(NOW, np.zeros(6), TICK, s, target)
    np.testing.assert_allclose(target.p_world, [1.01, 1.98, 3.03], atol=1e-12)
    turned = Rotation.from_rotvec([0.1, -0.2, 0.05]) * planned
    np.testing.assert_allclose(target.R_world_base, turned.as_matrix(), atol=1e-12)


def taken_over(now: Snapshot, bare: Snapshot, payload: Payload) -> np.ndarray:
    """Upward, about the heading's x and y: what holds the payload's weight, by its lever."""
    R = bare.R_world_base
    lever = bare.state.p_world_base + R @ payload.place - bare.p_world_com
    heading = Rotation.from_euler("z", np.arctan2(R[1, 0], R[0, 0])).as_matrix()
    ahead, left, _ = heading.T @ lever
    weight = payload.mass * GRAVITY
    roll, pitch = ROLL_PER_MOMENT * left * weight, -PITCH_PER_MOMENT * ahead * weight
    x, y, _ = heading @ [roll, pitch, 0.0]
    return np.array([HEIGHT_PER_WEIGHT * weight, x, y])


@pytest.mark.parametrize("seed", range(5))
def test_what_holds_a_payload_is_taken_out_once_it_is_known(seed: int) -> None:
    rng = np.random.default_rng(seed)
    payload = Payload(rng.uniform(0.2, 1.0), (*rng.uniform(-0.1, 0.1, 2), 0.05))
    bare, loaded = snapshot_of(seed), snapshot_of(seed, payload)
    known, s = taken_over(loaded, bare, payload), Correction()
    s.offset[:] = np.clip([0.01, -0.01, *(2.0 * known), 0.05], -LIMITS, LIMITS)
    held = s.offset.copy()
    corrected(s, np.zeros(6), 0.0, bare)
    np.testing.assert_array_equal(s.offset, held)
    corrected(s, np.zeros(6), 0.0, loaded)
    held[2:5] -= known
    np.testing.assert_allclose(s.offset, held, atol=1e-9)
    before = s.offset.copy()
    corrected(s, np.zeros(6), 0.0, loaded)
    np.testing.assert_array_equal(s.offset, before, "nothing more is known")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_more_is_taken_out_than_there_is(sign: float) -> None:
    """A correction that holds less than the payload asks for, or pulls the other way, ends at 0."""
    payload = Payload(4.0, (0.08, -0.06, 0.05))
    bare, loaded = snapshot_of(3), snapshot_of(3, payload)
    s = Correction()
    s.offset[2:5] = sign * 1e-4 * np.sign(taken_over(loaded, bare, payload))
    before = s.offset.copy()
    corrected(s, np.zeros(6), 0.0, bare)
    corrected(s, np.zeros(6), 0.0, loaded)
    np.testing.assert_array_equal(s.offset, before if sign < 0.0 else np.zeros(6))


def test_a_payload_that_is_known_from_the_start_takes_nothing() -> None:
    s = Correction()
    s.offset[2:5] = 0.05
    corrected(s, np.zeros(6), 0.0, snapshot_of(3, Payload(4.0, (0.08, -0.06, 0.05))))
    assert (s.offset[2:5] == 0.05).all()


@pytest.mark.parametrize("point", list(TrackedPoint))
def test_the_tracked_position_is_that_of_the_named_point(point: TrackedPoint) -> None:
    com, base = NOW.p_world_com, NOW.state.p_world_base
    expected = {TrackedPoint.COM: com, TrackedPoint.BASE: base}
    np.testing.assert_array_equal(tracked_position(NOW, point), expected[point])
    assert not np.allclose(com, base)
