"""Goals point at their goal, slow down before it, and judge the measured pose."""

from math import cos, degrees, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.modes import are_within
from controller.navigation import (
    DISTANCE_TOLERANCE,
    GREATEST_DISTANCE,
    GREATEST_TURN,
    HEADING_TOLERANCE,
    TURN_RATE,
    WALK_SPEED,
    DriveStraight,
    Goal,
    TurnInPlace,
)
from go2_wbc.errors import CommandError
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.robot.state import RobotState

# Rounding of sines and quaternions.
EXACT = 1e-9
STEP = 0.05

yaws = st.floats(-pi, pi)
places = st.floats(-5.0, 5.0)


def pose(x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> RobotState:
    q = np.zeros(19)
    q[:3] = x, y, 0.3
    q[5], q[6] = sin(yaw / 2), cos(yaw / 2)
    return RobotState(0.0, q, np.zeros(18), np.zeros(12), np.zeros(4), np.ones(4, bool))


def begun(goal: Goal, state: RobotState) -> Goal:
    goal.begin(state)
    return goal


def walk(goal: Goal, x: float, y: float, yaw: float) -> RobotState:
    """Follows the commands exactly, as an ideal robot would, until the goal is done."""
    state = pose(x, y, yaw)
    goal.begin(state)
    for _ in range(round(goal.time_limit / STEP)):
        if goal.is_done(state):
            break
        command = goal.command(state)
        x += STEP * (command.linear_x * cos(yaw) - command.linear_y * sin(yaw))
        y += STEP * (command.linear_x * sin(yaw) + command.linear_y * cos(yaw))
        yaw += STEP * command.angular_z
        state = pose(x, y, yaw)
    return state


@given(x=places, y=places, yaw=yaws, ahead=places, left=places)
def test_displacement_is_measured_in_the_frame_of_the_start(
    x: float, y: float, yaw: float, ahead: float, left: float
) -> None:
    goal = begun(DriveStraight(1.0), pose(x, y, yaw))
    end = pose(x + ahead * cos(yaw) - left * sin(yaw), y + ahead * sin(yaw) + left * cos(yaw))
    measured = goal.measurements(end)
    assert (measured["walked [m]"], measured["aside [m]"]) == pytest.approx(
        (ahead, left), abs=EXACT
    )


@pytest.mark.parametrize("direction", [1, -1])
def test_the_angle_turned_is_counted_over_several_turns(direction: int) -> None:
    goal = begun(TurnInPlace(1.0), pose(yaw=3.0))
    for step in range(1, 200):
        state = pose(yaw=3.0 + direction * 0.1 * step)
        for _ in range(2):
            turned = radians(goal.measurements(state)["turned [deg]"])
            assert turned == pytest.approx(direction * 0.1 * step, abs=EXACT)
            goal.command(state)


def test_whether_a_turn_is_done_may_be_asked_as_often_as_one_likes() -> None:
    # Whoever asked for a state out of turn moved the count: -2 rad, asked last, made a turn of it.
    goal = begun(TurnInPlace(2.0), pose())
    for yaw in (2.0, -2.0, 2.0):
        assert goal.is_done(pose(yaw=yaw)) is (yaw == 2.0)
        assert are_within(goal.errors(pose(yaw=yaw))) is (yaw == 2.0)
        assert goal.measurements(pose(yaw=yaw))["turned [deg]"] == pytest.approx(degrees(yaw))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_goal_starts_towards_its_goal_at_its_full_speed(sign: float) -> None:
    turn, drive = (
        begun(goal, pose()).command(pose()) for goal in (TurnInPlace(sign), DriveStraight(sign))
    )
    assert turn == VelocityCommand(angular_z=sign * TURN_RATE)
    assert drive == VelocityCommand(linear_x=sign * WALK_SPEED)


@given(x=places, y=places, yaw=yaws, angle=st.floats(-GREATEST_TURN, GREATEST_TURN))
def test_an_ideal_robot_turns_by_the_angle_and_stays_in_place(
    x: float, y: float, yaw: float, angle: float
) -> None:
    goal = TurnInPlace(angle)
    end = walk(goal, x, y, yaw)
    assert are_within(goal.errors(end))
    assert goal.measurements(end)["turned [deg]"] == pytest.approx(
        goal.measurements(end)["asked [deg]"], abs=0.5
    )
    assert end.q[:2] == pytest.approx([x, y], abs=0.01)


@given(x=places, y=places, yaw=yaws, distance=st.floats(-3.0, 3.0))
def test_an_ideal_robot_walks_the_distance_along_its_heading(
    x: float, y: float, yaw: float, distance: float
) -> None:
    goal = DriveStraight(distance)
    end = walk(goal, x, y, yaw)
    assert are_within(goal.errors(end))
    goal = [x + distance * cos(yaw), y + distance * sin(yaw)]
    assert end.q[:2] == pytest.approx(goal, abs=0.01)


def test_a_robot_is_led_back_to_its_line_and_its_place_in_a_time_limit() -> None:
    goal = begun(DriveStraight(1.0), pose())
    assert goal.command(pose(y=0.1)).linear_y < 0.0
    assert goal.command(pose(y=-0.1)).linear_y > 0.0
    assert goal.command(pose(yaw=0.1)).angular_z < 0.0
    goal = begun(TurnInPlace(pi / 2), pose())
    assert goal.command(pose(x=0.1)).linear_x < 0.0
    # A quarter turn on, the start lies behind it to its left.
    turned = goal.command(pose(x=0.1, yaw=pi / 2))
    assert turned.linear_y > 0.0
    assert abs(turned.linear_x) < EXACT
    assert TurnInPlace(2.0).time_limit >= 3 * 2.0 / TURN_RATE
    assert DriveStraight(-2.0).time_limit >= 3 * 2.0 / WALK_SPEED


@pytest.mark.parametrize(
    ("goal", "end", "is_good"),
    [
        (DriveStraight(1.0), pose(x=1.0), True),
        (DriveStraight(1.0), pose(x=1.0 - 0.9 * DISTANCE_TOLERANCE), True),
        (DriveStraight(1.0), pose(x=1.0 + 1.1 * DISTANCE_TOLERANCE), False),
        (DriveStraight(1.0), pose(x=1.0, y=1.1 * DISTANCE_TOLERANCE), False),
        (DriveStraight(1.0), pose(x=1.0, yaw=1.1 * HEADING_TOLERANCE), False),
        (DriveStraight(1.0), pose(), False),
        (TurnInPlace(0.5), pose(yaw=0.5 + 0.9 * HEADING_TOLERANCE), True),
        (TurnInPlace(0.5), pose(yaw=0.5 - 1.1 * HEADING_TOLERANCE), False),
        (TurnInPlace(0.5), pose(yaw=-0.5), False),
    ],
)
def test_a_walk_is_judged_by_place_and_heading_and_a_turn_by_the_heading(
    goal: Goal, end: RobotState, *, is_good: bool
) -> None:
    assert are_within(begun(goal, pose()).errors(end)) is is_good


def test_a_robot_that_is_still_moving_is_not_done() -> None:
    drive, turn = begun(DriveStraight(1.0), pose()), begun(TurnInPlace(0.5), pose())
    moving = pose(x=1.0)
    moving.v[0] = 0.2
    assert not drive.is_done(moving)
    assert drive.is_done(pose(x=1.0))
    turning = pose(yaw=0.5)
    turning.v[5] = 0.3
    assert not turn.is_done(turning)
    assert turn.is_done(pose(yaw=0.5))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_goal_beyond_the_limits_is_refused(sign: float) -> None:
    TurnInPlace(sign * GREATEST_TURN)
    DriveStraight(sign * GREATEST_DISTANCE)
    with pytest.raises(CommandError, match="looks like degrees: write deg"):
        TurnInPlace(sign * (GREATEST_TURN + radians(1)))
    with pytest.raises(CommandError, match=r"distance must be within \+-100 m"):
        DriveStraight(sign * (GREATEST_DISTANCE + 0.1))
