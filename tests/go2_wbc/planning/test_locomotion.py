"""The locomotion planner on synthetic snapshots: when it steps, where to, and what it asks."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.contacts import GAITS, Gait
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.footholds import LEAST_GAP
from go2_wbc.planning.ground import EASE, GROUND_SHARE, LEASH
from go2_wbc.planning.locomotion import HURRY, LocomotionPlanner
from go2_wbc.planning.slip import MOST_FRICTION
from go2_wbc.reference import LegTask, Reference, TrackedPoint
from go2_wbc.robot.rotations import log_rotation, yaw_rotation
from go2_wbc.robot.state import Snapshot
from tests import engine_helpers as helpers
from tests.go2_wbc.planning.squared import CONFIG, MODEL, at, moving, resting

TROT = replace(GAITS["trot"], stride=None)
"""One whose stride does not follow the speed, so that what is expected of it can be written."""
TICK = 0.002
EXACT = 1e-9  # rounding in sums of a few hundred ticks
SWING_END = TROT.swing_time - TICK
LAST_TICK = 5e-4  # [m] the swing curve's way in the last tick, with margin
OUTSIDE = 0.01  # m


def started(snapshot: Snapshot, gait: Gait = TROT) -> LocomotionPlanner:
    planner = LocomotionPlanner(MODEL, gait, CONFIG)
    planner.start(snapshot)
    return planner


def hold(
    planner: LocomotionPlanner, snapshot: Snapshot, command: VelocityCommand, seconds: float
) -> Reference:
    """The last reference of a robot that stays where it is whatever it is asked."""
    start = snapshot.state.time
    reference = planner.update(snapshot, command)
    for tick in range(1, round(seconds / TICK) + 1):
        reference = planner.update(at(snapshot, start + tick * TICK), command)
    return reference


class IdealRobot:
    """Does at once what the reference says; its stance feet stay where they are."""

    def __init__(self) -> None:
        self.snapshot = resting()
        self.offset = self.snapshot.p_world_com - self.snapshot.state.p_world_base

    def follow(self, reference: Reference) -> None:
        body, state = reference.body, self.snapshot.state
        q, v = state.q.copy(), state.v.copy()
        q[:3] = body.p_world - self.offset
        q[3:7] = pin.Quaternion(body.R_world_base).coeffs()
        v[:3] = body.R_world_base.T @ body.v_world
        self.snapshot = self.snapshot.replaced(
            state=replace(state, time=state.time + TICK, q=q, v=v),
            R_world_base=body.R_world_base,
            p_world_com=body.p_world,
            v_world_com=body.v_world,
            p_world_feet=np.maximum(reference.p_world_feet, [-np.inf, -np.inf, MODEL.foot_radius]),
        )


@pytest.mark.parametrize("leg", range(4))
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_the_stride_follows_a_foot_that_comes_down(leg: int, share: float) -> None:
    planner, landed = started(resting()), np.arange(4) == leg
    hold(planner, resting(), VelocityCommand(0.3), 0.1)
    down = (TROT.offsets[leg] - TROT.offsets[0]) % 1.0  # of the front left foot's stride
    ahead = (planner.phase - down + 0.5) % 1.0 - 0.5
    assert abs(ahead) > 0.1
    planner.follow_feet(landed, share)
    left = (planner.phase - down + 0.5) % 1.0 - 0.5
    assert left == pytest.approx((1.0 - share) * ahead)


def test_the_phase_is_that_of_the_front_left_foot() -> None:
    planner = started(resting())
    reference = hold(planner, resting(), VelocityCommand(0.3), 0.0)
    assert planner.phase == pytest.approx(0.5, abs=TICK / TROT.period)
    assert not reference.stance[0]
    assert reference.stance[1]
    hold(planner, resting(), VelocityCommand(0.3), 0.5 * TROT.period)
    assert min(planner.phase, 1.0 - planner.phase) < 2.0 * TICK / TROT.period


def test_before_it_has_started_it_is_not_stepping_and_has_no_heading() -> None:
    # It had no attribute to tell it by.
    planner = LocomotionPlanner(MODEL, TROT, CONFIG)
    assert not planner.is_stepping
    assert planner.heading == 0.0


def test_without_a_command_it_stands_and_holds_its_place() -> None:
    start = resting(yaw=0.4)
    planner = started(start)
    reference = hold(planner, start, ZERO_COMMAND, 1.0)
    assert not planner.is_stepping
    assert reference.legs == helpers.FOUR_FEET
    assert reference.body.point is TrackedPoint.COM
    np.testing.assert_allclose(reference.body.p_world, start.p_world_com, atol=EXACT)
    np.testing.assert_allclose(reference.body.R_world_base, yaw_rotation(0.4), atol=EXACT)
    np.testing.assert_array_equal(reference.body.v_world, 0.0)
    np.testing.assert_array_equal(reference.p_world_feet, start.p_world_feet)


@pytest.mark.parametrize(
    "command", [VelocityCommand(0.3), VelocityCommand(0.0, -0.2), VelocityCommand(angular_z=0.5)]
)
def test_a_command_starts_the_gait_at_its_first_phase(command: VelocityCommand) -> None:
    planner = started(resting())
    planner.update(resting(), ZERO_COMMAND)
    reference = planner.update(resting(TICK), command)
    assert planner.is_stepping
    np.testing.assert_array_equal(reference.stance, TROT.schedule().modes[0])
    assert LegTask.SWING in reference.legs


def test_a_push_or_a_com_beyond_the_capture_margin_starts_the_gait_and_a_smaller_one_not() -> None:
    omega = np.sqrt(MODEL.gravity / CONFIG.height)
    for direction in np.random.default_rng(1).normal(size=(8, 2)):
        margin = CONFIG.capture_margin * np.array([*direction / np.linalg.norm(direction), 0.0])
        for share, steps in ((0.98, False), (1.02, True)):
            pushed, start = moving(resting(TICK), share * omega * margin), resting(TICK)
            displaced = start.replaced(p_world_com=start.p_world_com + share * margin)
            for snapshot in (pushed, displaced):
                planner = started(resting())
                planner.update(snapshot, ZERO_COMMAND)
                assert planner.is_stepping is steps


def test_squaring_up_steps_unless_the_feet_are_below_the_hips() -> None:
    start = resting()
    planner = started(start)
    assert planner.square_up(start)
    assert not planner.is_stepping
    feet = start.p_world_feet.copy()
    feet[2, 0] += 3 * CONFIG.square_tolerance
    assert not planner.square_up(start.replaced(p_world_feet=feet))
    assert planner.is_stepping


def test_the_reference_velocity_ramps_to_the_command_at_the_allowed_rate() -> None:
    """Along a straight line: on the ground all directions are alike."""
    planner, command = started(resting()), VelocityCommand(0.6, -0.3, 1.0)
    wanted, previous = np.array([0.6, -0.3, 1.0]), np.zeros(3)
    for tick in range(1, 301):
        body = planner.update(resting(tick * TICK), command).body
        v_body = body.R_world_base.T @ body.v_world
        velocity = np.array([*v_body[:2], body.w_world[2]])
        change = np.abs(velocity - previous) / TICK
        assert np.hypot(*change[:2]) <= CONFIG.linear_acceleration + EXACT
        assert change[2] <= CONFIG.angular_acceleration + EXACT
        assert velocity[0] == pytest.approx(-2.0 * velocity[1], abs=EXACT)
        previous = velocity
    np.testing.assert_allclose(previous, wanted, atol=EXACT)


@pytest.mark.parametrize(
    "command", [VelocityCommand(1.0, 0.4, 0.0), VelocityCommand(angular_z=2.0)]
)
def test_of_a_robot_that_is_held_back_the_reference_stays_on_the_leash(
    command: VelocityCommand,
) -> None:
    start = resting(yaw=3.0)
    planner = started(start)
    body = hold(planner, start, command, 1.5).body
    lead = np.linalg.norm(body.p_world[:2] - start.p_world_com[:2])
    turn = np.arctan2(*(yaw_rotation(3.0).T @ body.R_world_base)[[1, 0], [0, 0]])
    if command.angular_z:
        assert turn == pytest.approx(CONFIG.yaw_leash, abs=EXACT)
        assert lead < EXACT
    else:
        assert lead == pytest.approx(CONFIG.position_leash, abs=EXACT)
        assert turn == pytest.approx(0.0, abs=EXACT)


def test_velocities_of_the_reference_are_the_rates_of_its_pose() -> None:
    robot, planner = IdealRobot(), started(resting())
    before = planner.update(robot.snapshot, ZERO_COMMAND).body
    for _ in range(300):
        robot.follow(planner.update(robot.snapshot, VelocityCommand(0.3, -0.1, 0.5)))
        body = planner.update(robot.snapshot, VelocityCommand(0.3, -0.1, 0.5)).body
        turned = log_rotation(body.R_world_base @ before.R_world_base.T) / TICK
        np.testing.assert_allclose(body.w_world, turned, atol=1e-6)
        moved = (body.p_world - before.p_world) / TICK
        np.testing.assert_allclose(body.v_world, moved, atol=1e-3)
        before = body


def test_a_robot_that_hangs_low_is_asked_for_more_height() -> None:
    start = resting()
    low = start.replaced(p_world_com=start.p_world_com - [0.0, 0.0, 0.02])
    reference = hold(started(start), low, ZERO_COMMAND, 0.5)
    assert reference.body.p_world[2] > CONFIG.height + 0.01


def landing(snapshot: Snapshot, command: VelocityCommand) -> Reference:
    """The last reference of the first swing, when the feet have all but arrived."""
    return hold(started(snapshot), snapshot, command, SWING_END)


def test_a_robot_that_steps_in_place_puts_its_feet_below_its_hips() -> None:
    start = resting(yaw=0.8)
    feet = start.p_world_feet + np.random.default_rng(3).normal(scale=0.03, size=(4, 3))
    scattered = start.replaced(p_world_feet=np.array([*feet.T[:2], start.p_world_feet.T[2]]).T)
    planner = started(scattered)
    planner.square_up(scattered)
    reference = hold(planner, scattered, ZERO_COMMAND, SWING_END)
    swing = ~reference.stance
    assert swing.sum() == 2
    nominal = start.p_world_feet[swing, :2]
    np.testing.assert_allclose(reference.p_world_feet[swing, :2], nominal, atol=LAST_TICK)


def test_the_foothold_is_half_the_stance_travel_ahead_corrected_by_the_velocity_error() -> None:
    """Raibert 1986: hip + v T/2 + k (v - v_ref), the hip being where it will be at touchdown."""
    start, v = resting(), np.array([0.6, -0.2, 0.0])
    reference = landing(moving(start, v), VelocityCommand(0.2))
    v_ref = reference.body.v_world
    remaining = TROT.swing_time - SWING_END
    expected = v * TROT.stance_time / 2 + CONFIG.velocity_feedback * (v - v_ref) + v * remaining
    swing = ~reference.stance
    found = reference.p_world_feet[swing] - start.p_world_feet[swing]
    np.testing.assert_allclose(found[:, :2], np.tile(expected[:2], (2, 1)), atol=LAST_TICK)
    depth = CONFIG.swing.touchdown_depth
    np.testing.assert_allclose(found[:, 2], -depth, atol=LAST_TICK)


def test_a_robot_that_speeds_up_puts_its_feet_behind_its_hips() -> None:
    """A force m (a, g) through the CoM, h above the ground, comes from h a / g behind it."""
    start = resting()
    planner = LocomotionPlanner(MODEL, TROT, replace(CONFIG, linear_acceleration=3.0))
    planner.start(start, MOST_FRICTION)
    reference = hold(planner, start, VelocityCommand(2.0), SWING_END)
    half, v_ref = TROT.stance_time / 2, reference.body.v_world[0]
    way = 3.0 * half**2 / 2 - 3.0 * CONFIG.height / MODEL.gravity
    swing = ~reference.stance
    found = (reference.p_world_feet[swing] - start.p_world_feet[swing])[:, 0]
    np.testing.assert_allclose(found, way - CONFIG.velocity_feedback * v_ref, atol=0.01)


@pytest.mark.parametrize(("ahead", "left"), [(0.0, 0.0), (0.2, 0.1)])
def test_a_turning_robot_steps_along_the_circle_about_its_middle(ahead: float, left: float) -> None:
    """In a curve outside of it: it walked 20 mm inside its way, and 2 % too slowly."""
    start = resting()
    reference = landing(start, VelocityCommand(ahead, left, 0.6))
    v_x, v_y, _ = v_ref = reference.body.v_world
    outside = 0.6 * CONFIG.height / MODEL.gravity * np.array([v_y, -v_x])
    R = yaw_rotation(0.6 * (TROT.stance_time / 2 + TROT.swing_time - SWING_END))[:2, :2]
    for leg in np.flatnonzero(~reference.stance):
        hip = start.p_world_feet[leg, :2]
        found = reference.p_world_feet[leg, :2]
        expected = R @ hip - CONFIG.velocity_feedback * v_ref[:2] + outside
        np.testing.assert_allclose(found, expected, atol=LAST_TICK)


def test_feet_of_a_fast_turn_stay_on_their_circle_all_the_way() -> None:
    """They went 5 cm outside of it in mid-swing: motors saturated, and the robot fell."""
    start = resting()
    planner = LocomotionPlanner(MODEL, TROT, replace(CONFIG, angular_acceleration=1e4))
    planner.start(start)
    radius = np.linalg.norm(start.p_world_feet[:, :2], axis=1).max()
    for tick in range(round(SWING_END / TICK)):
        reference = planner.update(at(start, TICK * tick), VelocityCommand(0.0, 0.0, 6.0))
        feet = reference.p_world_feet[~reference.stance, :2]
        assert np.linalg.norm(feet, axis=1).max() < radius + OUTSIDE


def test_commands_that_were_late_are_taken_for_late_while_they_seem_to_be_prompt() -> None:
    start, told = resting(), []
    planner = LocomotionPlanner(MODEL, TROT, CONFIG)
    planner.start(start)
    for tick in range(round(60.0 / 0.5)):
        delay = 0.012 if tick == 0 else 0.004
        planner.update(at(start, 0.5 * tick), ZERO_COMMAND, delay=delay)
        told.append(planner.is_late)
    assert all(told[: round(15.0 / 0.5)])
    assert not told[-1], "for ever"


def test_a_foothold_stays_within_reach_of_the_hip() -> None:
    start, v = resting(), np.array([4.0, 3.0, 0.0])
    reference = landing(moving(start, v), ZERO_COMMAND)
    swing = ~reference.stance
    hips = start.p_world_feet[swing] + v * (TROT.swing_time - SWING_END)
    distance = np.linalg.norm((reference.p_world_feet[swing] - hips)[:, :2], axis=1)
    np.testing.assert_allclose(distance, CONFIG.foothold_reach, atol=5 * LAST_TICK)


def test_a_foot_that_speeds_the_robot_up_is_within_reach_until_it_leaves() -> None:
    """A robot that set out at 6 m/s^2 left its feet 0.3 m behind, where they bear nothing."""
    start, config = resting(), replace(CONFIG, ground_friction=MOST_FRICTION)
    planner = LocomotionPlanner(MODEL, TROT, config)
    planner.start(start)
    reference = hold(planner, start, VelocityCommand(3.0), SWING_END)
    swing = ~reference.stance
    ahead = (reference.p_world_feet - start.p_world_feet)[swing, 0]
    gone = 0.5 * config.linear_acceleration * TROT.stance_time**2
    np.testing.assert_allclose(ahead - gone, -config.foothold_reach, atol=0.01)


@pytest.mark.parametrize(("is_standing", "is_rough"), [(True, False), (False, False), (True, True)])
def test_the_gait_hurries_as_the_knee_of_a_standing_leg_gets_straight(
    is_standing: bool, is_rough: bool
) -> None:
    """Its foot bears nothing: trunks fell by 5 cm before the others came down. Not on stairs.

    There 4 of 6 fell by sight, and 2 of 6 over blocks.
    """
    start, command = resting(), VelocityCommand(0.5)
    planner = started(start)
    reference = hold(planner, start, command, 0.1)
    leg, before = np.flatnonzero(reference.stance == is_standing)[0], planner.phase
    planner._state.clock.is_rough = is_rough
    q = start.state.q.copy()
    q[9 + 3 * leg] = MODEL.q_upper[2 + 3 * leg]
    straight = start.replaced(state=replace(start.state, q=q, time=0.1 + TICK))
    planner.update(straight, command)
    faster = 1.0 + HURRY * (is_standing and not is_rough)
    assert planner.phase - before == pytest.approx(faster * TICK / TROT.period)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("is_last", [False, True])
def test_a_foot_comes_down_on_its_own_side_of_a_neighbour(axis: int, is_last: bool) -> None:
    """Legs hit each other at each turn from 2 m/s ahead to 2 back, and fell over one another."""
    start, neighbour = resting(yaw=0.8), 2 if axis == 0 else 1
    swing = np.flatnonzero(~landing(start, VelocityCommand(1e-6)).stance)
    leg = next(leg for leg in swing.tolist() if bool(leg & neighbour) == is_last)
    way = yaw_rotation(0.8)[:, axis] * (-1.0 if is_last else 1.0)
    feet = start.p_world_feet.copy()
    feet[leg ^ neighbour] = feet[leg] - 0.02 * way
    near = start.replaced(p_world_feet=feet)
    apart = landing(near, VelocityCommand(1e-6)).p_world_feet[leg] - feet[leg ^ neighbour]
    np.testing.assert_allclose(apart @ way, LEAST_GAP, atol=LAST_TICK)
    thrown = [moving(at_start, -way) for at_start in (start, near)]
    goals = [landing(at_start, VelocityCommand(1e-6)).p_world_feet[leg] for at_start in thrown]
    np.testing.assert_allclose(goals[0], goals[1], atol=LAST_TICK, err_msg="the thrown may")


@pytest.mark.parametrize("command", [VelocityCommand(3.4), VelocityCommand(-2.0)])
def test_the_gap_of_the_feet_gives_way_to_a_fast_trot(command: VelocityCommand) -> None:
    """Hind feet that were put back by it at each step: robots fell at 3.5 m/s, and one at 3."""
    config = replace(CONFIG, ground_friction=MOST_FRICTION)
    robot, planner = IdealRobot(), LocomotionPlanner(MODEL, GAITS["trot"], config)
    planner.start(robot.snapshot)
    landed, stood = np.full((4, 2), np.nan), np.ones(4, dtype=bool)
    for _ in range(2000):
        reference = planner.update(robot.snapshot, command)
        came = reference.stance & ~stood
        away = reference.p_world_feet[:, :2] - reference.body.p_world[:2]
        landed[came] = (away - MODEL.p_base_feet_nominal[:, :2])[came]
        stood = reference.stance
        robot.follow(reference)
    np.testing.assert_allclose(landed - landed.mean(axis=0), 0.0, atol=0.005)


@pytest.mark.parametrize("seed", range(5))
def test_the_mirrored_robot_is_asked_for_the_mirror_image(seed: int) -> None:
    rng = np.random.default_rng(seed)
    state = helpers.random_state(rng)
    x, y, turn = rng.uniform(-0.5, 0.5, size=3)
    mirrored_trot = replace(TROT, offsets=(0.0, 0.5, 0.5, 0.0))
    left, right = state, helpers.mirrored_state(state)
    planners = [started(MODEL.snapshot(s), g) for s, g in ((left, TROT), (right, mirrored_trot))]
    commands = VelocityCommand(x, y, turn), VelocityCommand(x, -y, -turn)
    for tick in range(120):
        here, there = (
            planner.update(MODEL.snapshot(replace(s, time=tick * TICK)), command)
            for planner, s, command in zip(planners, (left, right), commands, strict=True)
        )
        image = helpers.mirrored_reference(here)
        assert image.legs == there.legs
        for name in ("p_world_feet", "v_world_feet", "a_world_feet"):
            np.testing.assert_allclose(getattr(image, name), getattr(there, name), atol=EXACT)
        for name in ("p_world", "v_world", "R_world_base", "w_world"):
            np.testing.assert_allclose(
                getattr(image.body, name), getattr(there.body, name), atol=EXACT
            )


def test_diagonals_take_turns_and_swing_feet_are_lifted() -> None:
    robot, command = IdealRobot(), VelocityCommand(0.4)
    planner = started(robot.snapshot)
    half, highest = round(TROT.period / 2 / TICK), 0.0
    for tick in range(6 * half):
        reference = planner.update(robot.snapshot, command)
        expected = TROT.schedule().modes[(tick // half) % 2]
        np.testing.assert_array_equal(reference.stance, expected, err_msg=f"{tick=}")
        highest = max(highest, float(reference.p_world_feet[:, 2].max()))
        robot.follow(reference)
    assert highest == pytest.approx(MODEL.foot_radius + CONFIG.swing.apex, abs=1e-3)


def test_it_stops_stepping_at_a_touchdown_once_it_stands_squarely_at_rest() -> None:
    robot = IdealRobot()
    planner = started(robot.snapshot)
    for _ in range(500):
        robot.follow(planner.update(robot.snapshot, VelocityCommand(0.5, 0.1, 0.3)))
    reference = planner.update(robot.snapshot, ZERO_COMMAND)
    for _ in range(1000):
        if not planner.is_stepping:
            break
        robot.follow(reference)
        reference = planner.update(robot.snapshot, ZERO_COMMAND)
    assert not planner.is_stepping
    assert reference.legs == helpers.FOUR_FEET
    np.testing.assert_allclose(reference.body.v_world, 0.0, atol=EXACT)
    assert planner.square_up(robot.snapshot)
    assert planner.heading == pytest.approx(float(robot.snapshot.state.rpy[2]), abs=0.05)


def touching(snapshot: Snapshot, *, is_touching: bool = True) -> Snapshot:
    contact = np.full(4, is_touching)
    return snapshot.replaced(state=replace(snapshot.state, feet_in_contact=contact))


@pytest.mark.parametrize("is_touching", [True, False])
def test_feet_that_touch_higher_up_raise_the_reference_and_no_others(is_touching: bool) -> None:
    """Feet that came down late used to lift the trunk by 7 cm on joints with much friction."""
    start = touching(resting(), is_touching=is_touching)
    raised = start.replaced(p_world_feet=start.p_world_feet + np.array([0.0, 0.0, 0.05]))
    planner = started(start)
    before = planner.update(start, VelocityCommand(0.2))
    after = hold(planner, at(raised, TICK), VelocityCommand(0.2), 2.0)
    rise = after.body.p_world[2] - before.body.p_world[2]
    assert rise > 0.035 if is_touching else abs(rise) < EXACT


@pytest.mark.parametrize("is_rough", [True, False])
def test_a_high_step_does_not_throw_a_robot_on_rough_ground(is_rough: bool) -> None:
    """Asked to be 9 cm higher at once, and level at any price, it jumped off blocks of 14 cm."""
    start = touching(resting())
    planner = started(start)
    ground, goals = planner._state.ground, planner._state.horizon.goals
    ground.height += 0.2
    ground.rough_way = float(is_rough)
    reference = planner.update(at(start, TICK), VelocityCommand(0.2))
    asked = np.array([reference.body.p_world[2], *goals[:, 5]]) - start.p_world_com[2]
    assert np.all(np.abs(asked - LEASH) < EXACT) if is_rough else np.all(asked > 0.15)
    assert reference.orientation_discount == (EASE if is_rough else 0.0)


def test_the_ground_is_where_a_foot_is_first_touched_not_where_it_goes_on_to() -> None:
    """Front right and rear left swing first; both are late, touch 3 cm up, and then slide down."""
    start = resting()
    planner = started(start)
    command = VelocityCommand(0.2)
    before = hold(planner, start, command, TROT.swing_time + 5 * TICK)  # both are awaited

    def lifted(height: float, tick: int) -> Snapshot:
        feet = start.p_world_feet + np.array([0.0, 0.0, height])
        time = TROT.swing_time + tick * TICK
        return touching(at(start, time).replaced(p_world_feet=feet))

    heights = [
        planner.update(snapshot, command).body.p_world[2] - before.body.p_world[2]
        for snapshot in (lifted(0.03, 6), lifted(-0.03, 7))
    ]
    np.testing.assert_allclose(heights, GROUND_SHARE * 0.03, atol=2e-4)  # the correction's tick
