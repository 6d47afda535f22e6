"""Every gait that has a name walks at the edge of its envelope, rests, and does what comes next."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from jaxtyping import Float

from controller import GO2Controller
from controller.behaviours.walking import Walking
from controller.sweeps.trials import TrialRobot, set_off
from controller.walker import CHANGE_SHARE, Walker
from go2_wbc.config import Config
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand, VelocityEnvelope
from go2_wbc.planning.envelopes import DWELL, envelope_of
from go2_wbc.planning.gait_clock import time_between
from go2_wbc.planning.locomotion import LocomotionConfig
from go2_wbc.planning.slip import MOST_FRICTION
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel

FRICTION = 0.7
SLOW = 0.05  #: Share of the command by which the mean speed may be off
CHANGES = ("pace", "bound", "walk", "gallop", "pronk", "flying_trot", "trot")
"""One after the other, the robot walking all the time."""
STRIDE = np.full(150, 1.0 / 150)
"""Ticks of 2 ms over which a speed is averaged: within a stride the bound slows down by 0.3 m/s."""
FAST = 9.0  #: m/s, rad/s: beyond every envelope, so that it is clipped to it


def mean_velocity(robot: TrialRobot, until: float, time: float) -> Float[np.ndarray, "3"]:
    """Of the CoM [m/s], from some time on and for as long [s]; a fall fails."""
    robot.wait(until)
    robot.truth.clear()
    robot.wait(time)
    return robot.truth.recording().com_velocity.mean(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(GAITS.keys() - {"trot"}))
def test_a_gait_walks_at_the_edge_of_its_envelope_and_comes_to_rest(name: str) -> None:
    with TrialRobot(MujocoPlant(friction=FRICTION, seed=41)) as robot:
        go2 = robot.go2
        set_off(robot, name, VelocityCommand(FAST))
        wanted = go2.command.linear_x
        assert wanted == pytest.approx(envelope_of(GAITS[name], VelocityEnvelope()).forward)
        assert mean_velocity(robot, 2.0, 2.0)[0] == pytest.approx(wanted, rel=SLOW)
        for aside, turning in ((FAST, 0.0), (0.0, -FAST)):
            go2.move(0.0, turning, linear_y=aside)
            robot.wait(1.5)
        go2.stop()
        robot.require(go2.stand())
        assert np.abs(go2.state.v[:6]).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("turn", [-1.4, 0.5, 1.8])
def test_a_bound_turns_at_once_on_ground_of_which_nothing_is_known(turn: float) -> None:
    with GO2Controller(plant=MujocoPlant(friction=FRICTION, seed=9700)) as go2:
        assert go2.walk("bound")
        assert go2.turn_left(turn)


@pytest.mark.slow
def test_a_pace_needs_no_more_friction_than_a_narrow_stance_does() -> None:
    # With its feet as far apart as a trot's it fell here: it pushed them aside by half its weight.
    with TrialRobot(MujocoPlant(sensors="imu", friction=0.4, seed=71)) as robot:
        set_off(robot, "pace", VelocityCommand(0.5))
        np.testing.assert_allclose(mean_velocity(robot, 2.0, 2.0), [0.5, 0.0, 0.0], atol=0.03)
        robot.go2.stop()
        robot.require(robot.go2.stand())


@pytest.mark.slow
def test_gaits_pass_over_into_one_another_while_the_robot_walks() -> None:
    # It came to rest before every change.
    with TrialRobot(MujocoPlant(friction=FRICTION, seed=43)) as robot:
        go2 = robot.go2
        set_off(robot, "trot", VelocityCommand(FAST))
        robot.wait(2.0)
        for name in CHANGES:
            robot.truth.clear()
            robot.require(go2.walk(name))
            robot.wait(1.0)
            most = envelope_of(GAITS[name], VelocityEnvelope()).forward
            assert go2.command.linear_x <= most * (1.0 + 1e-9)
            ahead = robot.truth.recording().com_velocity[:, 0]
            assert np.convolve(ahead, STRIDE, "valid").min() > 0.15
        assert go2.command.linear_x > 0.0
        go2.stop()
        robot.require(go2.stand())


@pytest.mark.slow
def test_a_command_that_comes_with_a_gait_is_followed_once_the_gait_is_there() -> None:
    """Of 250 runs of ten changes of gait, each with a command at once, 3 fell half-way."""
    with TrialRobot(MujocoPlant(friction=FRICTION, seed=73)) as robot:
        go2 = robot.go2
        set_off(robot, "walk", VelocityCommand(-0.2))
        robot.wait(1.0)
        asked = go2.state.time
        robot.require(go2.walk("gallop"))
        go2.move(-0.8)
        assert go2.command.linear_x == -0.8
        robot.truth.clear()
        is_there = asked + time_between(GAITS["walk"], GAITS["gallop"])
        robot.wait(is_there - go2.state.time)
        slow = envelope_of(GAITS["walk"], VelocityEnvelope()).scaled(CHANGE_SHARE).backward
        speed = np.convolve(robot.truth.recording().com_velocity[:, 0], STRIDE, "valid")
        assert speed.min() > -slow - 0.15
        assert mean_velocity(robot, 1.0, 1.0)[0] == pytest.approx(-0.8, rel=2.0 * SLOW)


def test_a_change_of_gait_within_another_one_waits_for_both() -> None:
    model, config = RobotModel(), LocomotionConfig()
    walking = Walking(model, GAITS["trot"], config)
    walking.start(model.snapshot(MujocoPlant().read()))
    slow, wide = VelocityEnvelope(forward=0.2), VelocityEnvelope()
    walking.pass_over(GAITS["pace"], slow, 1.0)
    walking.pass_over(GAITS["bound"], wide, 1.1)
    walking.command = VelocityCommand(1.0)
    both = sum(
        max(time_between(GAITS[a], GAITS[b]), DWELL) for a, b in pairwise(("trot", "pace", "bound"))
    )
    assert walking.asked(1.0 + both - 0.01).linear_x == 0.2
    assert walking.asked(1.0 + both + 0.01).linear_x == 1.0


@pytest.mark.parametrize(("has_slid", "counted_on"), [(True, 0.15), (False, MOST_FRICTION)])
def test_what_a_foot_has_shown_of_ice_is_kept_for_the_next_walk(
    has_slid: bool, counted_on: float
) -> None:
    """What is only not known yet is not: a bound then counts on the ground."""
    model, config = RobotModel(), Config()
    snapshot = model.snapshot(MujocoPlant().read())
    loop = SimpleNamespace(model=model, heights=None)
    runner: Any = SimpleNamespace(loop=loop, engage=lambda walking: walking.start(snapshot))
    walker = Walker(runner, config)
    walker.walking = Walking(model, GAITS["trot"], config.locomotion, 0.15, has_slid)
    walker.start("bound")
    walker.walking.update(snapshot)
    assert walker.walking.friction == pytest.approx(counted_on, abs=0.01)
    assert walker.walking.has_slid == has_slid


@pytest.mark.slow
def test_auto_goes_from_walk_to_flying_trot_and_back_to_rest() -> None:
    with TrialRobot(MujocoPlant(friction=FRICTION, seed=44)) as robot:
        go2 = robot.go2
        set_off(robot, "auto", ZERO_COMMAND)
        walking = go2._pilot._walker.walking
        for speed, name in ((0.3, "walk"), (0.9, "trot"), (2.0, "flying_trot")):
            go2.move(speed)
            robot.wait(3.0)
            assert walking.gait.name == name
            assert mean_velocity(robot, 0.0, 1.5)[0] == pytest.approx(speed, rel=SLOW)
        robot.require(go2.walk("trot"))
        assert walking.choice is None
        assert go2.command.linear_x <= envelope_of(GAITS["trot"], None).forward * (1.0 + 1e-9)
        robot.require(go2.walk("auto"))
        go2.stop()
        robot.wait(1.0)
        assert walking.gait.name == "walk"
        robot.require(go2.stand())
