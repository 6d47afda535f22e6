"""The ground below a walking robot: its plane, and how rough it is."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.planning.ground import (
    DELAY,
    MOST_RAISE,
    MOST_SLOPE,
    SMOOTH,
    STUMBLE,
    Ground,
    apex_raise,
    carry_ground,
    delay,
    ground_at,
    ground_below,
    learn_ground,
    level_friction,
    note_stumble,
)
from go2_wbc.robot.snapshot import Snapshot
from tests import engine_helpers as helpers

MODEL = helpers.symmetric_model()
SLOPE = np.array([0.2, -0.1])
EXACT = 1e-12


def on_plane(slope: np.ndarray, height: float = 0.4) -> Snapshot:
    """A robot whose feet stand on a plane that is ``height`` high below its CoM."""
    snapshot = MODEL.snapshot(helpers.state_of(helpers.standing_q()))
    feet, com = snapshot.p_world_feet.copy(), snapshot.p_world_com
    feet[:, 2] = height + (feet[:, :2] - com[:2]) @ slope + MODEL.foot_radius
    return snapshot.replaced(p_world_feet=feet)


def plane(snapshot: Snapshot) -> Ground:
    return ground_below(snapshot, MODEL.foot_radius)


def learn(ground: Ground, feet: np.ndarray, met: np.ndarray) -> None:
    here = on_plane(np.zeros(2)).replaced(p_world_feet=feet)
    learn_ground(ground, here, MODEL.foot_radius, met)


def test_the_plane_at_first_is_that_through_the_feet() -> None:
    snapshot = on_plane(SLOPE)
    ground = plane(snapshot)
    np.testing.assert_allclose(ground.slope, SLOPE, atol=EXACT)
    assert ground.height == pytest.approx(0.4, abs=EXACT)
    for x, y, z in snapshot.p_world_feet:
        assert ground_at(ground, x, y) == pytest.approx(z - MODEL.foot_radius, abs=EXACT)


def test_feet_in_a_line_or_on_a_wall_tell_no_slope_that_no_foot_could_hold_on() -> None:
    snapshot = on_plane(SLOPE)
    line = snapshot.p_world_feet.copy()
    line[:, 1] = 0.0
    np.testing.assert_array_equal(plane(snapshot.replaced(p_world_feet=line)).slope, 0.0)
    np.testing.assert_allclose(plane(on_plane(10 * SLOPE)).slope, [MOST_SLOPE, -MOST_SLOPE])


def test_it_is_carried_along_with_the_robot() -> None:
    snapshot = on_plane(SLOPE)
    ground = plane(snapshot)
    moved = snapshot.replaced(p_world_com=snapshot.p_world_com + [0.5, 0.2, 0.0])
    carry_ground(ground, moved)
    assert ground.height == pytest.approx(0.4 + SLOPE @ [0.5, 0.2], abs=EXACT)


@pytest.mark.parametrize("friction", [0.3, 0.6])
def test_an_upright_cone_lies_within_that_about_the_normal_of_a_slope(friction: float) -> None:
    ground = plane(on_plane(SLOPE))
    level = level_friction(ground, friction, 0.01)
    around = np.linspace(0.0, 2.0 * np.pi, 3600)
    forces = np.column_stack([level * np.cos(around), level * np.sin(around), np.ones(3600)])
    normal = np.array([-SLOPE[0], -SLOPE[1], 1.0]) / np.sqrt(1.0 + SLOPE @ SLOPE)
    into = forces @ normal
    along = np.linalg.norm(forces - into[:, None] * normal, axis=1)
    assert (along / into).max() == pytest.approx(friction, abs=1e-5)
    assert level_friction(ground, 0.1, 0.12) == 0.12
    learn(ground, on_plane(SLOPE, 0.5).p_world_feet, np.ones(4, dtype=bool))
    assert level_friction(ground, friction, 0.01) == pytest.approx(friction)  # as on stairs
    assert level_friction(plane(on_plane(np.zeros(2))), friction, 0.01) == friction


def test_feet_that_land_on_another_plane_turn_it_there() -> None:
    ground, new = plane(on_plane(np.zeros(2))), on_plane(SLOPE, 0.43)
    pairs = np.array([True, False, False, True])
    for n in range(40):
        learn(ground, new.p_world_feet, pairs if n % 2 else ~pairs)
    np.testing.assert_allclose(ground.slope, SLOPE, atol=1e-3)
    assert ground.height == pytest.approx(0.43, abs=1e-3)
    assert ground.roughness < 1e-2


def test_a_step_raises_the_swing_for_a_while_and_smooth_ground_does_not() -> None:
    snapshot = on_plane(np.zeros(2))
    ground, front_left = plane(snapshot), np.array([True, False, False, False])
    learn(ground, snapshot.p_world_feet, front_left)
    assert apex_raise(ground) == 0.0
    learn(ground, snapshot.p_world_feet + [0.0, 0.0, 0.05], front_left)
    assert apex_raise(ground) == pytest.approx(0.05 - SMOOTH)
    note_stumble(ground)
    assert apex_raise(ground) == pytest.approx(STUMBLE - SMOOTH)
    assert delay(ground) == pytest.approx(DELAY * apex_raise(ground) / MOST_RAISE)
    for _ in range(20):
        learn(ground, snapshot.p_world_feet, np.ones(4, dtype=bool))
    assert apex_raise(ground) == 0.0
