"""A robot's day, and the promises of every call: honest, repeatable, and over when it is over."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from controller import GO2Controller, Mode, Outcome
from go2_wbc.contacts import Gait
from go2_wbc.errors import ModeError, MotionInfeasible, StanceMismatch
from go2_wbc.planning.envelopes import LADDER, trot_of
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from motions import compile_timeline, load_motion
from tests.controller.plants import PERIOD, WatchedPlant
from tests.go2_wbc.plant.contract import same
from tests.motions.doctored import with_joint_beyond_its_limit

# What the goals promise.
DISTANCE_TOLERANCE = 0.02
ANGLE_TOLERANCE = np.radians(1.5)
SIDE_TOLERANCE = 0.05  # m; a walked way sags and sways by less than this


@dataclass(frozen=True)
class Step:
    """One call of the day: what it returned, and the truth before and after it."""

    returned: bool | None
    mode: Mode
    outcome: Outcome
    before: RobotState
    after: RobotState


Day = dict[str, Step]


def steps(go2: GO2Controller) -> Iterator[tuple[str, Callable[[], bool | None]]]:
    yield "stand", go2.stand
    yield "sit", go2.sit
    yield "stand from sitting", go2.stand
    yield "turn left", lambda: go2.turn_left(0.4)
    yield "turn right", lambda: go2.turn_right(0.3)
    yield "forward", lambda: go2.move_forward(0.25)
    yield "backward", lambda: go2.move_forward(-0.15)
    yield "walk", go2.walk
    yield "move", lambda: go2.move(0.3, 0.2, linear_y=0.1)
    yield "wait", lambda: go2.wait(1.5)
    yield "stop", go2.stop
    yield "sit from walking", go2.sit
    yield "lie down", go2.lie_down
    yield "stand from lying", go2.stand


@pytest.fixture(scope="module")
def day() -> Day:
    """One robot does everything, once."""
    done: Day = {}
    with GO2Controller(plant=MujocoPlant(control_period=PERIOD)) as go2:
        for name, call in steps(go2):
            before = go2.state
            returned = call()
            done[name] = Step(returned, go2.mode, go2.last_outcome, before, go2.state)
    return done


@pytest.fixture(scope="module")
def standing() -> Iterator[GO2Controller]:
    """A standing robot; its tests leave it standing."""
    with GO2Controller(plant=MujocoPlant(control_period=PERIOD)) as go2:
        assert go2.stand()
        yield go2


MODES = {
    "stand": Mode.STANDING,
    "sit": Mode.SITTING,
    "stand from sitting": Mode.STANDING,
    "turn left": Mode.WALKING,
    "turn right": Mode.WALKING,
    "forward": Mode.WALKING,
    "backward": Mode.WALKING,
    "walk": Mode.WALKING,
    "sit from walking": Mode.SITTING,
    "lie down": Mode.LYING,
    "stand from lying": Mode.STANDING,
}


@pytest.mark.parametrize("name", MODES)
def test_a_blocking_call_returns_true_in_its_mode_with_what_was_measured(
    day: Day, name: str
) -> None:
    step = day[name]
    assert step.returned is True, step.outcome.reason
    assert step.mode is MODES[name]
    assert step.outcome.ok
    assert step.outcome.reason == "done"
    assert step.outcome.measured
    assert 0.0 < step.outcome.duration <= step.after.time - step.before.time + 1e-9


def test_a_call_that_only_commands_returns_nothing_and_only_waiting_takes_time(day: Day) -> None:
    for name in ("move", "wait", "stop"):
        assert day[name].returned is None
        assert day[name].mode is Mode.WALKING
    assert same(day["move"].before, day["move"].after)
    waited = day["wait"].after.time - day["wait"].before.time
    assert waited == pytest.approx(1.5, abs=PERIOD)
    assert np.abs(day["stop"].after.v[:3]).max() < 0.1, "at rest"


def test_a_robot_stands_level_sits_and_lies_on_its_belly(day: Day) -> None:
    for name in ("stand", "stand from sitting", "stand from lying"):
        state = day[name].after
        assert state.tilt < 0.1
        assert state.feet_in_contact.all()
        assert state.q[2] == pytest.approx(0.31, abs=0.02)
    # From walking, the rear legs once crossed a singularity, rattled, and never came to rest.
    for name in ("sit", "sit from walking"):
        state = day[name].after
        assert state.rpy[1] < np.radians(-30)
        assert state.feet_in_contact.all()
        assert np.abs(state.v).max() < 0.2
    # It once rested on its folded legs, 2 cm above the ground, and called it lying.
    state = day["lie down"].after
    assert state.q[2] < 0.09
    assert state.foot_forces.sum() < 50.0


@pytest.mark.parametrize(("name", "angle"), [("turn left", 0.4), ("turn right", -0.3)])
def test_a_turn_ends_on_the_heading_asked_for(day: Day, name: str, angle: float) -> None:
    step = day[name]
    turned = step.after.rpy[2] - step.before.rpy[2]
    assert turned == pytest.approx(angle, abs=ANGLE_TOLERANCE)
    assert np.linalg.norm((step.after.q - step.before.q)[:2]) < SIDE_TOLERANCE


@pytest.mark.parametrize(("name", "distance"), [("forward", 0.25), ("backward", -0.15)])
def test_a_walk_ends_at_the_distance_asked_for(day: Day, name: str, distance: float) -> None:
    step = day[name]
    way = (step.after.q - step.before.q)[:2]
    yaw = step.before.rpy[2]
    ahead = float(way @ [np.cos(yaw), np.sin(yaw)])
    assert ahead == pytest.approx(distance, abs=DISTANCE_TOLERANCE)
    assert step.outcome.measured["walked [m]"] == pytest.approx(ahead, abs=DISTANCE_TOLERANCE)


def test_a_velocity_command_moves_the_robot_that_way(day: Day) -> None:
    step = day["wait"]
    way = (step.after.q - step.before.q)[:2]
    yaw = (step.before.rpy[2] + step.after.rpy[2]) / 2
    ahead, left = way @ [np.cos(yaw), np.sin(yaw)], way @ [-np.sin(yaw), np.cos(yaw)]
    assert ahead == pytest.approx(0.3 * 1.5, rel=0.25)
    assert left == pytest.approx(0.1 * 1.5, rel=0.35)
    assert step.after.rpy[2] - step.before.rpy[2] == pytest.approx(0.2 * 1.5, rel=0.25)


def test_a_new_robot_lies_limp_at_time_zero_and_time_passes_in_calls_only() -> None:
    with GO2Controller(namespace="rex_2") as go2:
        assert go2.namespace == "rex_2"
        assert go2.state.time == 0.0
        assert go2.last_outcome.ok
        go2.wait(0.1)
        before = go2.state
        assert before.q[2] < 0.1
        assert go2.mode is Mode.LYING
        assert go2.command.is_zero
        assert go2.recording().duration > 0.0
        assert same(go2.state, before)


def test_waiting_for_no_time_lets_none_pass_and_a_robot_that_lies_lies_down_again(
    go2: GO2Controller,
) -> None:
    go2.wait(0.0)
    assert go2.state.time == 0.0
    assert go2.last_outcome.ok
    assert go2.lie_down()
    assert go2.mode is Mode.LYING


def test_the_same_script_twice_gives_the_same_states_bit_by_bit() -> None:
    def script() -> list[RobotState]:
        plant = MujocoPlant(control_period=PERIOD, sensors="noisy", seed=3)
        with GO2Controller(plant=plant) as go2:
            assert go2.stand()
            first = go2.state
            assert go2.walk()
            go2.move(0.4, 0.5)
            go2.wait(0.6)
            return [first, go2.state]

    assert all(same(a, b) for a, b in zip(script(), script(), strict=True))


def test_moving_needs_walking_mode(standing: GO2Controller) -> None:
    with pytest.raises(ModeError, match=r"not standing: call walk\(\) first"):
        standing.move(0.1)
    standing.stop()
    assert standing.mode is Mode.STANDING


def test_damping_makes_the_robot_limp_and_it_can_stand_up_again(go2: GO2Controller) -> None:
    assert go2.stand()
    go2.damp()
    assert go2.mode is Mode.DAMPED
    with pytest.raises(ModeError, match="not damped"):
        go2.move(0.1)
    go2.wait(1.0)
    assert go2.state.q[2] < 0.15
    assert go2.lie_down()
    assert go2.mode is Mode.LYING
    assert go2.stand()


def test_a_lying_robot_whose_walk_was_damped_does_not_take_commands(
    plant: WatchedPlant, go2: GO2Controller
) -> None:
    # The mode from before the damping once came back when the next behaviour began.
    assert go2.walk()
    go2.damp()
    q = go2.state.q.copy()
    q[2], q[3:7] = 0.15, [1.0, 0.0, 0.0, 0.0]
    plant.inner.place(q)
    assert not go2.lie_down()
    assert go2.mode in (Mode.DAMPED, Mode.FALLEN)
    with pytest.raises(ModeError):
        go2.move(0.1)


def test_a_command_beyond_the_envelope_is_clipped_and_logged(
    go2: GO2Controller, caplog: pytest.LogCaptureFixture
) -> None:
    assert go2.walk()
    slightly = 1.1 * trot_of().forward
    with caplog.at_level(logging.WARNING):
        go2.move(0.2, 0.1)
        assert not caplog.records
        for speed in (slightly, 9.0, 30.0, 30.0):
            go2.move(speed)
            assert go2.command.linear_x == trot_of().forward
        by_little, by_far = [record.message for record in caplog.records]
        for speed, told in ((slightly, by_little), (9.0, by_far)):
            assert f"clipped from VelocityCommand(linear_x={speed}" in told
            assert "the envelope of gait 'trot' is " in told
            units = "times what is followed: speeds are in m/s, turning rates in rad/s"
            assert (units in told) is (speed == 9.0)
        go2.move(0.2)
        go2.move(90.0)
        assert len(caplog.records) == 3
        go2.move(-90.0)  # another direction, or gait, is another thing to be told
        assert len(caplog.records) == 4
        assert go2.walk("pace")
        go2.move(-90.0)
        assert "gait 'pace'" in caplog.records[-1].message
        assert go2.walk()
    go2.move(-9.0, 9.0, linear_y=9.0)
    assert -3.0 < go2.command.linear_x < 0.0
    go2.stop()
    assert go2.command.is_zero
    assert go2.last_outcome.ok


def test_a_motion_from_another_stance_is_refused_and_nothing_happens() -> None:
    with GO2Controller() as go2:
        with pytest.raises(StanceMismatch, match="starts from stand, the robot is lying"):
            go2.play("high_five")
        assert go2.state.time == 0.0
        assert go2.mode is Mode.LYING
        assert not go2.last_outcome


def test_an_infeasible_plan_is_refused_with_its_findings(standing: GO2Controller) -> None:
    before = standing.state
    plan = with_joint_beyond_its_limit(compile_timeline(load_motion("high_five"), RobotModel()))
    with pytest.raises(MotionInfeasible) as caught:
        standing.play(plan)
    assert len(caught.value.findings) >= 1
    assert "FR_calf" in str(caught.value)
    assert same(standing.state, before)
    assert standing.mode is Mode.STANDING


@pytest.mark.slow
def test_a_high_five_plays_by_its_name_and_measures_how_high_the_paw_was_held(
    standing: GO2Controller,
) -> None:
    assert standing.play("high_five")
    assert standing.high_five("left", hold=0.5), standing.last_outcome.reason
    assert standing.last_outcome.measured["least paw height [m]"] > 0.5
    assert standing.mode is Mode.STANDING


def test_during_a_goal_move_is_refused_and_stop_ends_it(
    plant: WatchedPlant, go2: GO2Controller
) -> None:
    refused: list[str] = []

    def interfere() -> None:
        with pytest.raises(ModeError) as caught:
            go2.move(0.5)
        refused.append(str(caught.value))
        go2.stop()

    assert go2.walk()
    plant.once_at(go2.state.time + 2.0, interfere)
    assert go2.move_forward(2.0) is False
    assert go2.last_outcome.reason == "walk 2.000 m ended by stop()"
    assert 0.1 < go2.last_outcome.measured["walked [m]"] < 1.0
    assert refused == ["move() during a goal (walk 2.000 m): end it by stop()"]
    assert go2.mode is Mode.WALKING
    go2.move(0.2)
    assert go2.command.linear_x == 0.2


def test_a_gait_of_ones_own_walks(go2: GO2Controller) -> None:
    gait = Gait("slow trot", period=0.5, duty=0.6, offsets=(0.5, 0.0, 0.0, 0.5))
    assert go2.walk(gait)
    go2.move(0.3)
    go2.wait(4.0)
    assert go2.state.q[0] > 0.8
    go2.stop()
    assert go2.last_outcome.ok


def test_a_gait_that_is_named_stays_though_it_was_chosen_by_the_speed_before(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.walk("auto")
        assert go2.walk(LADDER[0])
        go2.move(9.0)
    assert f"the envelope of gait '{LADDER[0]}'" in caplog.text
