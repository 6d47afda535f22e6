"""The ground below a walking robot: its plane, how rough it is, and what it permits."""

import numpy as np
import pytest

from go2_wbc.planning.ground import (
    CLIMBED,
    DELAY,
    EARLIER,
    FAST,
    FAST_HASTE,
    FIRST_LEAN,
    FIRST_LIFT,
    FIRST_RAISED,
    FIRST_WAY,
    FORGETS,
    GROUND_SHARE,
    HASTE_FRICTION,
    HIGH,
    LATE,
    LATE_ASIDE,
    LATE_HASTE,
    LATE_SPEED,
    LEAN_RATE,
    LIFT_RATE,
    MEMORY,
    MOST_RAISE,
    MOST_SLOPE,
    PROMPT,
    QUICK,
    ROUGH,
    ROUGH_BRAKE,
    ROUGH_HASTE,
    SMOOTH,
    STEEP,
    STEEP_FORGETS,
    STUMBLE,
    TOO_FAST,
    Ground,
    RoughConfig,
    apex_raise,
    carry_ground,
    delay,
    earliness,
    expect_steps,
    ground_at,
    ground_below,
    haste,
    is_rough,
    landing_height,
    learn_ground,
    level_friction,
    note_stumble,
    slow_down,
    tilt,
)
from go2_wbc.planning.slip import MOST_FRICTION
from go2_wbc.robot.state import Snapshot
from tests import engine_helpers as helpers

MODEL = helpers.symmetric_model()
CONFIG = RoughConfig()
SLOPE = np.array([0.2, -0.1])
EXACT = 1e-12
TICK = 0.002
SLOW = np.array([0.0, QUICK, 6.0])  # as fast as it may be without being fast


def on_plane(slope: np.ndarray, height: float = 0.4) -> Snapshot:
    """A robot whose feet stand on a plane that is ``height`` high below its CoM."""
    snapshot = MODEL.snapshot(helpers.state_of(helpers.standing_q()))
    feet, com = snapshot.p_world_feet.copy(), snapshot.p_world_com
    feet[:, 2] = height + (feet[:, :2] - com[:2]) @ slope + MODEL.foot_radius
    return snapshot.replaced(p_world_feet=feet)


def plane(snapshot: Snapshot) -> Ground:
    return ground_below(snapshot, MODEL.foot_radius)


def learn(ground: Ground, feet: np.ndarray, met: np.ndarray, tells: bool = True) -> None:
    here = on_plane(np.zeros(2)).replaced(p_world_feet=feet)
    learn_ground(ground, here, MODEL.foot_radius, met, 0.0, tells)


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
    carry_ground(ground, moved, TICK)
    assert ground.height == pytest.approx(0.4 + SLOPE @ [0.5, 0.2], abs=EXACT)


def test_the_robot_goes_slowly_on_rough_ground_and_for_a_way_after_it() -> None:
    snapshot, asked = on_plane(np.zeros(2)), np.array([1.2, -0.9, 2.0])
    ground = plane(snapshot)
    walking = snapshot.replaced(v_world_com=np.array([0.5, 0.0, 0.0]))
    half = 0.5 * MEMORY / 0.5  # s, in which half of the way is come

    def told() -> np.ndarray:
        velocity = asked.copy()
        carry_ground(ground, walking, half)
        slow_down(ground, CONFIG, 0.0, velocity)
        return velocity

    np.testing.assert_array_equal(told(), asked)
    ground.roughness = 1.01 * ROUGH
    np.testing.assert_allclose(told(), asked * CONFIG.high_speed / 1.5)  # the first step
    np.testing.assert_allclose(told(), asked * CONFIG.speed / 1.5)
    ground.roughness = 1.01 * HIGH
    slowly = asked * CONFIG.high_speed / 1.5
    np.testing.assert_allclose(told(), slowly)
    ground.roughness = 0.99 * ROUGH
    np.testing.assert_allclose(told(), slowly)
    carry_ground(ground, snapshot, 100.0)  # one that stands does not forget
    assert is_rough(ground)
    np.testing.assert_array_equal(told(), asked)
    ground.roughness = 1.01 * HIGH
    told()
    ground.roughness, ground.slope[0] = 0.0, 2.0 * STEEP  # a ramp, that is as feet expect it
    carry_ground(ground, walking, 1.01 * MEMORY / 0.5 / STEEP_FORGETS)
    assert not is_rough(ground)


def test_on_rough_ground_no_foot_is_led_above_the_highest_that_was_met() -> None:
    ground = plane(on_plane(np.zeros(2)))
    highest = ground.p_met[:, 2].max()
    assert landing_height(ground, highest + 0.1) == highest + 0.1
    ground.rough_way = 1.0
    assert landing_height(ground, highest + 0.1) == highest
    assert landing_height(ground, highest - 0.1) == highest - 0.1


def test_the_robot_speeds_up_as_ground_and_motors_bear_it() -> None:
    level, slope = plane(on_plane(np.zeros(2))), plane(on_plane(SLOPE))
    assert haste(level, CONFIG, MOST_FRICTION, PROMPT, SLOW) == 1.0
    assert haste(level, CONFIG, MOST_FRICTION, 2.0 * LATE, SLOW) == pytest.approx(LATE_HASTE)
    assert haste(level, CONFIG, 0.5 * HASTE_FRICTION, LATE, SLOW) == pytest.approx(0.25)
    assert haste(slope, CONFIG, HASTE_FRICTION, 0.0, SLOW) < 1.0
    assert haste(level, CONFIG, MOST_FRICTION, 0.0, FAST / QUICK * SLOW) == pytest.approx(
        FAST_HASTE
    )


def test_on_rough_ground_the_robot_brakes_harder_than_it_speeds_up_also_on_low_friction() -> None:
    level, asked = plane(on_plane(np.zeros(2))), np.array([TOO_FAST * CONFIG.speed, 0.0, 9.0])
    level.rough_way = 0.1
    low = 0.5 * HASTE_FRICTION
    assert haste(level, CONFIG, MOST_FRICTION, 0.0, asked) == pytest.approx(ROUGH_HASTE)
    assert haste(level, CONFIG, low, 0.0, asked) == pytest.approx(0.25 * ROUGH_HASTE)
    assert haste(level, CONFIG, MOST_FRICTION, 0.0, 1.01 * asked) == ROUGH_BRAKE
    assert haste(level, CONFIG, low, 0.0, 1.01 * asked) == pytest.approx(0.25)
    level.high_way = 0.1
    slower = CONFIG.high_speed / CONFIG.speed * asked
    assert haste(level, CONFIG, MOST_FRICTION, 0.0, 1.01 * slower) == ROUGH_BRAKE


def test_feet_of_a_thrown_robot_tell_the_height_but_no_roughness() -> None:
    feet, met = on_plane(np.zeros(2)).p_world_feet.copy(), np.ones(4, dtype=bool)
    feet[:, 2] += 2.0 * ROUGH
    for tells, rough, way in ((True, 2.0 * ROUGH, FIRST_WAY), (False, 0.0, 0.0)):
        ground = plane(on_plane(np.zeros(2)))
        learn(ground, feet, met, tells)
        assert ground.roughness == pytest.approx(rough, abs=EXACT)
        assert ground.rise_way == way
        assert ground.height == pytest.approx(0.4 + GROUND_SHARE * 2.0 * ROUGH)


def test_where_commands_act_late_the_robot_walks_slower() -> None:
    ground, velocity = plane(on_plane(np.zeros(2))), np.array([1.2, -1.6, 2.0])
    slow_down(ground, CONFIG, 0.99 * LATE, velocity)
    np.testing.assert_array_equal(velocity, [1.2, -1.6, 2.0])
    slow_down(ground, CONFIG, LATE, velocity)
    share = 1.0 / np.hypot(1.2 / LATE_SPEED, 1.6 / LATE_ASIDE)
    np.testing.assert_allclose(velocity, share * np.array([1.2, -1.6, 2.0]))


def test_feet_that_are_foretold_below_the_ground_make_it_no_rougher() -> None:
    """Those that came down at 2 m/s on level ground were seen 3 cm below it 14 ms later."""
    feet, down = on_plane(np.zeros(2)).p_world_feet.copy(), np.zeros((4, 3))
    feet[:, 2] -= 0.028
    down[:, 2] = -2.0
    here = on_plane(np.zeros(2)).replaced(p_world_feet=feet, v_world_contacts=down)
    for late, low in ((0.0, 0.028), (PROMPT, 0.028), (PROMPT + 0.01, 0.008), (0.02, 0.0)):
        ground = plane(on_plane(np.zeros(2)))
        learn_ground(ground, here, MODEL.foot_radius, np.ones(4, dtype=bool), late, True)
        assert ground.roughness == pytest.approx(low, abs=1e-9)
        assert ground.height == pytest.approx(0.4 - GROUND_SHARE * low)


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
    ground.rough_way, ground.slope[:] = 0.0, 2.0 * SLOPE
    walking = on_plane(SLOPE).replaced(v_world_com=np.array([0.5, 0.0, 0.0]))
    carry_ground(ground, walking, 0.0)  # a ramp: smooth and steep
    assert level_friction(ground, friction, 0.01) < friction - 0.1  # as behind it its crest is met
    carry_ground(ground, walking, FIRST_WAY / 0.5)
    assert level_friction(ground, friction, 0.01) == pytest.approx(friction)
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
    assert apex_raise(ground, CONFIG) == 0.0
    learn(ground, snapshot.p_world_feet + [0.0, 0.0, 0.05], front_left)
    assert apex_raise(ground, CONFIG) == pytest.approx(0.05 - SMOOTH)
    note_stumble(ground)
    assert apex_raise(ground, CONFIG) == pytest.approx(STUMBLE - SMOOTH)
    assert delay(ground) == pytest.approx(DELAY * apex_raise(ground, CONFIG) / MOST_RAISE)
    for _ in range(20):
        learn(ground, snapshot.p_world_feet, np.ones(4, dtype=bool))
    assert apex_raise(ground, CONFIG) == 0.0
    ground.rough_way = 0.1
    for steep, raised in ((0.0, FIRST_RAISED), (1.01 * STEEP, CONFIG.raised)):
        ground.slope[:] = steep, 0.0
        assert apex_raise(ground, CONFIG) == pytest.approx(raised)
    assert delay(ground) == 0.0


def test_feet_arrive_earlier_on_stairs_that_rise_but_not_on_a_block() -> None:
    snapshot, up = on_plane(np.zeros(2)), (0.5, 0.0)
    ground, walking = plane(snapshot), snapshot.replaced(v_world_com=np.array([0.5, 0.0, 0.0]))
    carry_ground(ground, walking, 0.0)
    ground.slope[0], ground.roughness = 2.0 * STEEP, 2.0 * ROUGH
    for climbed, expected in ((0.9 * CLIMBED, 0.0), (1.1 * CLIMBED, EARLIER)):
        ground.p_met[:, 2] = snapshot.p_world_feet[:, 2] + climbed  # with all feet on a block
        carry_ground(ground, walking, 0.0)
        assert earliness(ground, up) == pytest.approx(expected)
    assert earliness(ground, (-0.5, 0.0)) == 0.0
    carry_ground(ground, walking, 0.11 * CLIMBED / FORGETS / 0.5)
    assert earliness(ground, up) == 0.0, "the lowest place is far behind"
    ground.low -= CLIMBED
    ground.rough_way = 0.0
    assert earliness(ground, up) == 0.0


def test_the_trunk_is_carried_for_the_next_step_up_until_the_ground_falls_or_a_way_is_come() -> (
    None
):
    snapshot, feet = on_plane(np.zeros(2)), np.ones(4, dtype=bool)
    walking, ahead = snapshot.replaced(v_world_com=np.array([-0.3, 0.4, 0.0])), (-0.3, 0.4)
    ground = plane(snapshot)

    def carried(time: float) -> tuple[float, tuple[float, float]]:
        expect_steps(ground, walking, ahead, time)
        return ground.lift, tilt(ground)

    note_stumble(ground)
    assert carried(0.01) == (0.0, (0.0, 0.0)), "a brush at speed"
    ground.rough_way = 9.0
    lift, lean = carried(0.01)
    assert lift == pytest.approx(0.01 * LIFT_RATE)
    assert lean == pytest.approx((-0.01 * LEAN_RATE, 0.01 * LEAN_RATE))
    raised = FIRST_LIFT, pytest.approx(FIRST_LEAN * np.array(ahead) / 0.5)
    assert carried(0.5) == raised
    carried(FIRST_WAY / 0.5)
    assert carried(0.5) == (0.0, (0.0, 0.0))
    for off, share in ((1.1 * ROUGH, 1.0), (-3.0 * ROUGH, 0.0)):
        learn(ground, snapshot.p_world_feet + [0.0, 0.0, off], feet)
        ground.slope[:] = 0.0
        assert carried(0.5)[0] == pytest.approx(share * FIRST_LIFT)
    note_stumble(ground)
    ground.slope[0] = 0.5 * STEEP
    assert carried(0.5)[0] == pytest.approx(0.5 * FIRST_LIFT), "as far as it is level"
