"""``TrajectoryFollow``: the velocities that lead along a path, for a robot that obeys them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from controller.bridges.unitree.sport_robot import ARRIVAL_TIME, SportPath
from controller.navigation import APPROACH
from go2_wbc.robot.state import RobotState
from tests.controller.plants import lying_state

STEP = 0.02


def state_at(time: float, x: float, y: float, yaw: float) -> RobotState:
    q = lying_state(0.0).q.copy()
    q[:2] = x, y
    q[3:7] = 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)
    return replace(lying_state(time), q=q)


def arc(radius: float, rate: float, duration: float, yaw: float) -> np.ndarray:
    """Walking round in a circle to the left, from the origin with this heading."""
    t = np.linspace(0.0, duration, 30)
    heading, speed = yaw + rate * t, radius * rate
    x = radius * (np.sin(heading) - math.sin(yaw))
    y = radius * (math.cos(yaw) - np.cos(heading))
    wrapped = (heading + math.pi) % (2 * math.pi) - math.pi
    velocity = speed * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.column_stack([t, x, y, wrapped, velocity, np.full(30, rate)])


@pytest.mark.parametrize("yaw", [0.0, 2.0, -2.5])
def test_on_the_path_the_robot_goes_on_as_the_path_does(yaw: float) -> None:
    points = arc(0.5, 0.8, 6.0, yaw)
    command = SportPath(points).command(state_at(3.0, 0.0, 0.0, yaw))
    assert command is not None
    assert command.linear_x == pytest.approx(0.4, abs=1e-6)
    assert command.linear_y == pytest.approx(0.0, abs=1e-6)
    assert command.angular_z == pytest.approx(0.8, abs=1e-6)


@pytest.mark.parametrize("yaw", [0.0, 2.0, -2.5])
def test_a_robot_that_starts_aside_comes_to_the_path_and_ends_at_its_end(yaw: float) -> None:
    points = arc(0.5, 0.8, 6.0, yaw)
    path, (x, y, heading) = SportPath(points), (0.1, -0.1, yaw + 0.3)
    time, misses = 10.0, list[float]()
    while command := path.command(state_at(time, x, y, heading)):
        c, s = math.cos(heading), math.sin(heading)
        x += STEP * (c * command.linear_x - s * command.linear_y)
        y += STEP * (s * command.linear_x + c * command.linear_y)
        heading += STEP * command.angular_z
        time += STEP
        there = [np.interp(time - 10.0, points[:, 0], points[:, column]) for column in (1, 2)]
        misses.append(math.hypot(x - there[0], y - there[1]))
        assert time < 10.0 + 6.0 + ARRIVAL_TIME + 1.0
    assert max(misses[150:]) < 0.02
    assert math.hypot(x - points[-1, 1], y - points[-1, 2]) < 0.02
    assert math.sin(heading - points[-1, 3]) == pytest.approx(0.0, abs=0.03)


def test_a_robot_that_is_held_back_is_not_dragged_for_ever() -> None:
    path = SportPath(arc(0.5, 0.8, 2.0, 0.0))
    times = np.arange(0.0, 6.0, STEP)
    commands = [path.command(state_at(float(t), 0.0, 0.0, 0.0)) for t in times]
    last = [t for t, command in zip(times, commands, strict=True) if command is not None][-1]
    assert last == pytest.approx(2.0 + ARRIVAL_TIME, abs=2 * STEP)
    held = commands[120]
    assert held is not None  # after its last point it only makes for that
    assert held.angular_z == pytest.approx(APPROACH * 1.6, abs=1e-6)
