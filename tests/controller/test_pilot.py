"""Modes after calls that failed, and calls that may only say yes to what was measured."""

import numpy as np
import pytest

from controller import GO2Controller, Mode
from controller.behaviours.standing import Standing
from controller.behaviours.walking import Walking
from controller.navigation import DriveStraight, Goal, TurnInPlace
from go2_wbc.contacts import GAITS
from go2_wbc.errors import DynamicMotionRefused, ModeError, StanceMismatch
from go2_wbc.planning.command import ZERO_COMMAND
from go2_wbc.planning.slip import MOST_FRICTION
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import Blocks
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline, load_motion
from motions.postures import standing_feet, standing_on
from tests.controller.plants import MID_RISE, PERIOD, StillPlant, WatchedPlant, is_limp


@pytest.mark.parametrize("call", ["stand", "sit", "walk"])
def test_a_robot_that_does_not_move_never_gets_a_yes(call: str) -> None:
    with GO2Controller(plant=StillPlant()) as go2:
        assert getattr(go2, call)() is False
        assert go2.last_outcome.reason.startswith("stand not done within 3.0 s: height error [m]")
        assert go2.mode is Mode.MOVING
        assert f"{go2.mode}" == go2.mode == "moving"
        assert go2.last_outcome.measured["base speed [m/s]"] == 0.0


def test_a_robot_that_is_lifted_is_not_standing(go2: GO2Controller, plant: WatchedPlant) -> None:
    def lift() -> None:
        q = go2.state.q.copy()
        q[2] += 0.5
        plant.inner.place(q)

    plant.from_time(2.0, lift)
    assert go2.stand() is False
    assert go2.mode is not Mode.STANDING


@pytest.mark.parametrize("is_rough", [True, False])
def test_a_robot_whose_calves_lie_on_an_edge_steps_off_on_rough_ground(
    caplog: pytest.LogCaptureFixture, model: RobotModel, *, is_rough: bool
) -> None:
    """``stand()`` gave up with feet in the air: 5 of 80 walks over boxes of 12 cm ended so."""
    feet = standing_feet(model)
    p_base, q_joints = standing_on(feet, np.array([0.0, 0.0, 0.35]), np.eye(3), model)
    block = Blocks(0.1, count=1)
    p_base[0] += block.end + 0.05 - feet[2, 0]  # where the hind feet are so far ahead of its edge
    plant = MujocoPlant(terrain=block)
    plant.place(np.concatenate([p_base, [0.0, 0.0, 0.0, 1.0], q_joints]))
    with GO2Controller(plant=plant) as go2:
        go2._pilot._walker.walking._planner.ground.rough_way = float(is_rough)
        go2._pilot._mode = Mode.WALKING  # and has come to rest
        assert go2.stand() is is_rough
        assert ("it goes on for a step" in caplog.text) is is_rough
        if is_rough:
            assert plant.truth().q[0] - p_base[0] > 0.04
        else:
            assert "feet in the air" in go2.last_outcome.reason


def test_who_stops_before_any_time_has_passed_is_told_so_once(
    go2: GO2Controller, caplog: pytest.LogCaptureFixture
) -> None:
    assert go2.walk()
    go2.move(0.2)
    go2.wait(0.1)
    go2.move(0.1)  # as at the end of a loop
    go2.stop()
    assert "time.sleep" not in caplog.text
    for _ in range(2):
        go2.move(0.2)
        go2.stop()
    assert caplog.text.count("Time passes in wait(2.0), not in time.sleep(2)") == 1


@pytest.mark.parametrize(
    ("goal", "name", "said", "reason"),
    [
        (TurnInPlace, "command", ZERO_COMMAND, "turn by 17.2 deg not done within 8.9 s: asked"),
        (DriveStraight, "is_done", True, "walk 0.500 m missed: distance from the goal [m] 0."),
    ],
)
def test_a_goal_that_is_not_reached_is_not_done_and_says_how_far_it_got(
    go2: GO2Controller,
    monkeypatch: pytest.MonkeyPatch,
    goal: type[Goal],
    name: str,
    said: object,
    reason: str,
) -> None:
    assert go2.walk()
    monkeypatch.setattr(goal, name, lambda _self, _state: said)
    assert (go2.turn_left(0.3) if goal is TurnInPlace else go2.move_forward(0.5)) is False
    assert go2.last_outcome.reason.startswith(reason)
    assert go2.mode is Mode.WALKING


@pytest.mark.parametrize(("has_slid", "counted_on"), [(True, 0.15), (False, MOST_FRICTION)])
def test_the_steps_of_a_standing_robot_count_on_what_walks_have_shown_of_ice(
    standing: GO2Controller, has_slid: bool, counted_on: float
) -> None:
    pilot = standing._pilot
    config = pilot._config.locomotion
    walked = Walking(pilot._loop.model, GAITS["trot"], config, 0.15, has_slid)
    pilot._walker.walking = walked
    assert standing.stand()
    stands = pilot._loop.behaviour
    assert isinstance(stands, Standing)
    assert stands._friction_of_steps == pytest.approx(counted_on)


def test_after_a_stand_that_timed_out_the_robot_can_try_again(
    go2: GO2Controller, plant: WatchedPlant
) -> None:
    force = np.array([0.0, 30.0, -250.0])
    plant.once_at(MID_RISE, lambda: plant.inner.push(force, 7.4))
    assert go2.stand() is False
    assert go2.last_outcome.reason.startswith("stand not done")
    assert go2.mode is Mode.MOVING
    go2.wait(1.0)
    assert go2.stand(), go2.last_outcome.reason
    assert go2.mode is Mode.STANDING


def test_a_call_that_is_damped_from_within_a_tick_ends_and_the_next_one_works(
    go2: GO2Controller, plant: WatchedPlant
) -> None:
    plant.once_at(MID_RISE, go2.damp)
    assert go2.walk() is False
    assert go2.last_outcome.reason == "damped by damp()"
    assert go2.mode is Mode.DAMPED
    assert go2.walk()
    assert go2.mode is Mode.WALKING


def test_while_getting_up_after_a_damped_walk_no_command_is_taken(
    go2: GO2Controller, plant: WatchedPlant
) -> None:
    # The mode fell back to walking as soon as the first behaviour after the damping began.
    assert go2.walk()
    go2.damp()
    go2.wait(1.0)
    seen: set[Mode] = set()
    plant.on_write = lambda: seen.add(go2.mode)
    assert go2.stand()
    assert seen == {Mode.MOVING}


def test_a_high_five_whose_robot_does_not_come_to_rest_is_not_standing_in_the_end() -> None:
    plan = compile_timeline(load_motion("high_five", hold=0.5), RobotModel())
    plant = WatchedPlant(MujocoPlant(control_period=2 * PERIOD))
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()

        def shake() -> None:
            side = 1.0 if round(plant.inner.time * 10) % 2 else -1.0
            plant.inner.push(np.array([0.0, 60.0 * side, 0.0]), 2 * PERIOD)

        plant.from_time(go2.state.time + plan.duration + 0.5, shake)
        assert go2.play(plan) is False
        assert go2.mode is not Mode.STANDING


def test_a_dynamic_motion_is_for_a_robot_only_if_that_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(StillPlant, "is_hardware", True)
    line = Timeline(balance=False).foot("FL", z=0.03, over=0.4).foot("RR", z=0.03, over=0.4)
    with GO2Controller(plant=StillPlant()) as go2:
        plan = compile_timeline(line.home(over=0.4), go2._pilot._loop.model)
        with pytest.raises(DynamicMotionRefused):
            go2._pilot.play(plan)
        with pytest.raises(StanceMismatch):
            go2._pilot.play(plan, allow_dynamic=True)


def turn_over(plant: WatchedPlant) -> None:
    q = plant.inner.read().q.copy()
    q[2], q[3:7] = 0.12, [1.0, 0.0, 0.0, 0.0]
    plant.inner.place(q)


def test_a_robot_on_its_back_does_not_try_to_stand(go2: GO2Controller, plant: WatchedPlant) -> None:
    turn_over(plant)
    go2.wait(0.5)
    assert go2.mode is Mode.FALLEN
    with pytest.raises(ModeError, match=r"call recover\(\) first"):
        go2.stand()
    assert go2.recover()


def test_a_robot_that_is_found_on_its_back_says_so_when_it_shall_stand() -> None:
    # It went on moving its legs there, and recover() then said again to call recover().
    plant = WatchedPlant()
    turn_over(plant)
    with GO2Controller(plant=plant) as go2:
        go2.wait(0.5)
        assert go2.mode is Mode.LYING
        assert go2.stand() is False
        assert "cannot stand up from roll" in go2.last_outcome.reason
        assert "call recover()" in go2.last_outcome.reason
        assert go2.mode is Mode.FALLEN
        assert is_limp(plant.commands[-1])
        assert go2.recover()


def test_a_robot_that_lies_down_on_its_back_has_fallen(
    go2: GO2Controller, plant: WatchedPlant
) -> None:
    # It was limp and said to move, for ever; so was one that a push had thrown up on its way down.
    go2.damp()
    turn_over(plant)
    assert go2.lie_down() is False
    assert go2.mode is Mode.FALLEN
    assert go2.recover()
