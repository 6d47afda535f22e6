"""References: placing a motion in the world is a rigid motion, and anchors undo it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.errors import CommandError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.reference import (
    ASTRAY,
    BRISK,
    LEFT_BEHIND,
    PROPPED,
    SLACK,
    STILL,
    Anchor,
    LegTask,
    Reference,
    Target,
    TrackedPoint,
    hold_feet,
    sag_and_lean,
)
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import (
    JO,
    ST,
    SW,
    cases,
    random_reference,
    random_state,
    state_of,
    with_planned_forces,
)

EXACT = 1e-12  # rounding of numbers of order one
METRES = st.floats(-10.0, 10.0)
anchors = st.builds(
    lambda x, y, z, yaw: Anchor(np.array([x, y, z]), yaw),
    METRES,
    METRES,
    st.floats(-0.5, 0.5),
    st.floats(-np.pi, np.pi),
)
MODEL = RobotModel()
RNG = np.random.default_rng(3)
PLAIN = random_reference(MODEL.snapshot(random_state(RNG)), (ST, SW, JO, ST), 2.0, RNG)
REFERENCE = with_planned_forces(PLAIN, RNG)


def vectors(reference: Reference) -> np.ndarray:
    """Everything that turns but does not shift."""
    body = reference.body
    rows = [body.v_world, body.a_world, body.w_world, body.dw_world, *body.R_world_base.T]
    return np.array(
        [*rows, *reference.v_world_feet, *reference.a_world_feet, *reference.f_world_feet]
    )


def points(reference: Reference) -> np.ndarray:
    return np.array([reference.body.p_world, *reference.p_world_feet])


@given(anchors)
def test_placing_turns_every_vector_and_moves_every_point(anchor: Anchor) -> None:
    placed, R = REFERENCE.placed(anchor), yaw_rotation(anchor.yaw)
    np.testing.assert_allclose(vectors(placed), vectors(REFERENCE) @ R.T, atol=EXACT)
    expected = points(REFERENCE) @ R.T + anchor.p_world
    np.testing.assert_allclose(points(placed), expected, atol=10 * EXACT)


def test_placing_leaves_legs_joints_and_force_bounds_alone() -> None:
    placed = REFERENCE.placed(Anchor(np.array([1.0, 2.0, 3.0]), 0.7))
    assert placed.legs == REFERENCE.legs
    assert placed.body.point is REFERENCE.body.point
    for name in ("q_joints", "v_joints", "a_joints", "normal_force_min", "normal_force_max"):
        np.testing.assert_array_equal(getattr(placed, name), getattr(REFERENCE, name))


def test_stance_names_the_legs_that_stand_and_the_row_holds_the_planned_forces() -> None:
    np.testing.assert_array_equal(REFERENCE.stance, [True, False, False, True])
    assert REFERENCE.legs[1] is LegTask.SWING
    again = Reference.of_row(REFERENCE.row)
    assert again.force_weight == REFERENCE.force_weight
    np.testing.assert_array_equal(again.f_world_feet, REFERENCE.f_world_feet)


@given(anchors)
def test_the_anchor_of_placed_feet_is_the_anchor(anchor: Anchor) -> None:
    radius = 0.022
    feet = np.array([[0.2, 0.14, radius], [0.2, -0.14, radius]])
    feet = np.concatenate([feet, feet * [-1.0, 1.0, 1.0]])
    found = Anchor.of_feet(anchor.p_world + feet @ yaw_rotation(anchor.yaw).T, radius)
    np.testing.assert_allclose(found.p_world, anchor.p_world, atol=100 * EXACT)
    assert wrap_angle(found.yaw - anchor.yaw) == pytest.approx(0.0, abs=1e-9)


def test_the_anchor_does_not_change_the_feet_it_was_given() -> None:
    feet = MODEL.snapshot(state_of(random_state(RNG).q)).p_world_feet
    before = feet.copy()
    Anchor.of_feet(feet, 0.022)
    np.testing.assert_array_equal(feet, before)


def test_a_motion_plan_without_a_reference_cannot_be_made() -> None:
    with pytest.raises(TypeError, match="at"):
        MotionPlan()  # pyright: ignore[reportAbstractUsage]


@pytest.mark.parametrize("weight", [-1e-3, 1e-9, 1e3])
def test_a_weight_of_planned_forces_that_costs_accuracy_is_refused(weight: float) -> None:
    with pytest.raises(CommandError, match="force_weight must be 0 or 1e-06 to 100, got"):
        _ = replace(REFERENCE, force_weight=weight).row


@pytest.mark.parametrize("name", ["friction", "orientation_discount"])
def test_a_number_below_zero_is_refused(name: str) -> None:
    with pytest.raises(CommandError, match=rf"{name} must be 0 or more, got -0\.1"):
        _ = replace(REFERENCE, **{name: -0.1}).row


def test_sag_is_measured_at_what_is_tracked_and_lean_between_the_verticals() -> None:
    for snapshot, reference in cases(MODEL, 50, seed=11):
        body = reference.body
        is_com = body.point is TrackedPoint.COM
        tracked = snapshot.p_world_com if is_com else snapshot.state.p_world_base
        sag, lean = sag_and_lean(Target.of(reference.row), snapshot)
        assert sag == pytest.approx(body.p_world[2] - tracked[2], abs=EXACT)
        up = np.array([0.0, 0.0, 1.0])
        wanted, measured = body.R_world_base.T @ up, snapshot.R_world_base.T @ up
        angle = np.arctan2(np.linalg.norm(np.cross(wanted, measured)), wanted @ measured)
        assert lean == pytest.approx(angle, abs=1e-9)
        turned = reference.placed(Anchor(np.zeros(3), 1.0))
        assert sag_and_lean(Target.of(turned.row), snapshot)[1] == pytest.approx(lean, abs=1e-9)
        assert_plain_is_compiled(sag_and_lean, Target.of(reference.row), snapshot)


def test_a_foot_is_held_by_what_its_motors_push_it_with_towards_its_place() -> None:
    seen = 0
    for snapshot, reference in cases(MODEL, 50, seed=12):
        target, held, turned = Target.of(reference.row), np.empty(4), snapshot.state
        tau = np.random.default_rng(seen).uniform(-20.0, 20.0, 12)
        snapshot = snapshot.replaced(v_world_feet=0.1 * snapshot.v_world_feet)
        assert hold_feet(target, snapshot, tau, held) == held.max()
        for leg, task in enumerate(reference.legs):
            joints = slice(3 * leg, 3 * leg + 3)
            J = snapshot.J_feet[leg][:, 6:][:, joints]
            v, v_des = snapshot.v_world_feet[leg], reference.v_world_feet[leg]
            way = reference.p_world_feet[leg] - snapshot.p_world_feet[leg]
            if task is LegTask.JOINTS:
                way = J @ (reference.q_joints - turned.joint_positions)[joints]
                v_des = v + J @ (reference.v_joints - turned.joint_velocities)[joints]
            left = (v_des - v) @ way / np.linalg.norm(way)
            force = np.linalg.solve(J.T, (tau - snapshot.bias[6:])[joints])
            stays = np.linalg.norm(v) < STILL
            stays &= left > min(LEFT_BEHIND, float(np.linalg.norm(v_des))) - SLACK
            is_held = task is not LegTask.STANCE and stays and np.linalg.norm(way) > ASTRAY
            expected = force @ way / np.linalg.norm(way) if is_held else 0.0
            is_slow = task is LegTask.SWING and np.linalg.norm(v_des) < BRISK
            if is_slow and expected < PROPPED:
                expected = 0.0
            assert held[leg] == pytest.approx(expected, rel=1e-6)
            seen += is_held
        assert_plain_is_compiled(hold_feet, target, snapshot, tau, held)
    assert seen > 10


@pytest.mark.parametrize(
    ("led", "moves", "force", "is_held"),
    [
        (0.6, 0.1, 50.0, True),
        (0.0, 0.0, 50.0, True),
        (0.4, 0.28, 50.0, False),
        (0.0, 0.2, 50.0, False),
        (-0.6, 0.0, 50.0, False),
        (0.6, 0.1, 30.0, False),
        (1.4, 0.1, 30.0, True),
        (-0.6, -0.1, -30.0, False),
        (-0.6, -0.1, -50.0, True),
    ],
)
def test_a_foot_is_held_if_its_place_leaves_it_not_if_it_comes_late_or_is_let_down(
    led: float, moves: float, force: float, is_held: bool
) -> None:
    # A foot that joints which rub let down late, a leg whose knee lay on a slope, and feet whose
    # calves lay on, or were at, the nose of a step, were "held".
    snapshot = MODEL.snapshot(random_state(np.random.default_rng(5)))
    velocities = np.zeros((4, 3))
    velocities[1, 2] = -moves
    snapshot = snapshot.replaced(v_world_feet=velocities)
    reference = random_reference(snapshot, (ST, SW, ST, ST), 2.0, np.random.default_rng(6))
    places, speeds = snapshot.p_world_feet.copy(), np.zeros((4, 3))
    places[1, 2] -= np.sign(force) * 2.0 * ASTRAY
    speeds[1, 2] = -led
    target = Target.of(replace(reference, p_world_feet=places, v_world_feet=speeds).row)
    held, load = np.empty(4), np.array([0.0, 0.0, -force])
    tau = snapshot.bias[6:] + np.tile(snapshot.J_feet[1][:, 9:12].T @ load, 4)
    hold_feet(target, snapshot, tau, held)
    assert held[1] == pytest.approx(abs(force) if is_held else 0.0, abs=1e-6)
