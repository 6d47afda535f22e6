"""A standing robot that its feet in place cannot hold steps, and stands again where it is."""

import numpy as np
import pytest

from controller import GO2Controller, Mode
from controller.behaviours.standing import (
    KEPT_SPEED,
    SLOW,
    Standing,
    going_on,
    must_step,
    trot_against,
)
from controller.behaviours.walking import Walking
from controller.modes import is_standing
from go2_wbc.contacts import GAITS
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from tests.controller.plants import PERIOD
from tests.engine_helpers import standing_q, state_of

# s, and N s: at 16 N s aside, or 20 ahead, feet in place are at their end.
PUSH_TIME = 0.1
HARD, HARD_ASIDE = 30.0, 22.0
# N s; 3 m/s ahead, 2.3 m/s aside, where it fell, though not at 37.
HARDEST, HARDEST_ASIDE = 45.0, 36.0
HARDEST_SENSED, HARDEST_TROTTING, ASIDE_TROTTING = 42.0, 50.0, 26.0
SOFT = 6.0
LIFT = 60.0  # N; a foot bears 37
# s; in which it stands again.
LIMIT = 3.0
SNAPSHOT = RobotModel().snapshot(state_of(standing_q()))


def pushed(impulse: float, angle: float) -> GO2Controller:
    """A robot that stands and has just been pushed."""
    plant = MujocoPlant(control_period=PERIOD)
    go2 = GO2Controller(plant=plant)
    assert go2.stand()
    force = impulse / PUSH_TIME * np.array([np.cos(angle), np.sin(angle), 0.0])
    plant.push(force, PUSH_TIME)
    go2.wait(0.15)
    return go2


@pytest.mark.parametrize(
    ("impulse", "angle"),
    [
        (HARD, 0.0),
        (HARD, np.pi / 4),
        (HARD_ASIDE, -np.pi / 2),
        (HARDEST, np.pi),
        (HARDEST_ASIDE, np.pi / 2),
    ],
)
def test_a_push_that_feet_in_place_cannot_hold_starts_steps(impulse: float, angle: float) -> None:
    # It fell.
    with pushed(impulse, angle) as go2:
        assert go2.mode is Mode.MOVING
        loop = go2._runner.loop
        assert not loop.behaviour.is_finished(loop.snapshot), "though the posture's time is over"
        for _ in range(round(LIMIT / 0.1)):
            go2.wait(0.1)
            if go2.mode is Mode.STANDING:
                break
        go2.wait(1.0)  # it still moves over its feet, at up to 0.05 m/s
        assert go2.mode is Mode.STANDING
        assert is_standing(loop.snapshot)
        go2.wait(loop.behaviour.duration)
        assert loop.behaviour.is_finished(loop.snapshot)
        assert np.linalg.norm(go2.state.q[:2]) > 0.1, "it was pushed away and stands there"


def test_a_harder_push_aside_is_held_on_its_own_sensors() -> None:
    # At 2 m/s it counted as going as told, its feet came down too late, and it fell.
    plant = MujocoPlant(seed=5, sensors="imu")
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        plant.push(np.array([0.0, HARDEST_SENSED / PUSH_TIME, 0.0]), PUSH_TIME)
        go2.wait(PUSH_TIME)
        assert go2.state.v[1] > 2.0
        go2.wait(LIMIT)
        assert go2.mode is Mode.STANDING
        assert is_standing(RobotModel().snapshot(plant.truth()))


@pytest.mark.parametrize("phase", [3, 5, 11])
def test_a_trot_withstands_a_hard_push_ahead(phase: int) -> None:
    # It stood on its feet for as long as at 0.5 m/s, and swung them too late: 4 of 16 phases.
    plant = MujocoPlant(control_period=PERIOD)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        assert go2.walk()
        go2.move(0.5)
        go2.wait(1.5 + phase * GAITS["trot"].period / 16)
        plant.push(np.array([HARDEST_TROTTING / PUSH_TIME, 0.0, 0.0]), PUSH_TIME)
        go2.wait(PUSH_TIME)
        assert go2.state.v[0] > 3.0
        go2.wait(2.0)
        assert go2.mode is Mode.WALKING
        assert go2.state.v[0] == pytest.approx(0.5, abs=0.25)


def test_a_trot_that_is_pushed_aside_does_not_take_the_floor_for_rough_ground() -> None:
    plant = MujocoPlant(seed=0, sensors="imu")
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        assert go2.walk()
        go2.move(0.5)
        go2.wait(1.5 + 10 * GAITS["trot"].period / 16)
        plant.push(np.array([0.0, ASIDE_TROTTING / PUSH_TIME, 0.0]), PUSH_TIME)
        for _ in range(10):
            go2.wait(0.1)
            walking = go2._runner.loop.behaviour
            assert isinstance(walking, Walking)
            assert not walking.is_on_rough_ground
        assert go2.mode is Mode.WALKING


def test_a_push_that_feet_in_place_hold_starts_no_step() -> None:
    with pushed(SOFT, np.pi / 2) as go2:
        assert go2.mode is Mode.STANDING
        feet = go2._runner.loop.snapshot.p_world_feet
        go2.wait(1.0)
        assert np.abs(go2._runner.loop.snapshot.p_world_feet - feet).max() < 0.01


@pytest.mark.parametrize(("foot", "time"), [("FL_foot", 0.3), ("RR_foot", 1.0)])
def test_a_foot_that_is_lifted_presses_back_and_is_named(foot: str, time: float) -> None:
    # It fell: the leg was pushed up to the trunk by what it was to stand on.
    plant = MujocoPlant(control_period=PERIOD, sensors="imu")
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        plant.push(np.array([0.0, 0.0, LIFT]), time, at=foot)
        begun, tilts = plant.time, []
        while plant.time < begun + time + 1.0:
            go2.wait(0.05)
            tilts.append(plant.truth().tilt)
        assert max(tilts) < np.radians(10.0)
        assert [fault.part for fault in go2.health.faults] == [foot]
        assert go2.health.faults[0].since < begun + 0.25
        assert go2.stand()
        assert plant.p_world_feet[:, 2].max() < 0.03


def test_it_carries_a_load_over_its_feet_wherever_the_estimate_takes_them() -> None:
    with GO2Controller(plant=MujocoPlant(control_period=PERIOD, payload=6.0)) as go2:
        assert go2.stand()
        go2.wait(2.5)
        loop = go2._runner.loop
        assert isinstance(loop.behaviour, Standing)
        tracker = loop.behaviour._tracker
        assert loop.snapshot.payload is not None
        assert loop.snapshot.payload[0] > 4.0
        tracker._state.landing.anchor.p_world[2] -= 0.01  # as after a trot
        go2.wait(2.0)
        feet = loop.snapshot.p_world_feet[:, 2].mean()
        assert tracker.anchor.p_world[2] == pytest.approx(
            feet - loop.snapshot.foot_radius, abs=5e-4
        )
        assert loop.behaviour.sag_and_lean is not None
        assert loop.behaviour.sag_and_lean[0] < 0.002


@pytest.mark.parametrize("what", ["stand", "sit", "lie_down", "high_five", "bow"])
def test_what_is_asked_for_while_it_steps_waits_until_it_stands(what: str) -> None:
    # Begun at once it ended in a fall.
    with pushed(HARD, 0.0) as go2:
        assert go2.mode is Mode.MOVING
        if what == "bow":
            assert go2.play("bow"), go2.last_outcome.reason
        else:
            assert getattr(go2, what)(), go2.last_outcome.reason


def test_it_also_steps_after_a_motion() -> None:
    plant = MujocoPlant(control_period=PERIOD)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        assert go2.play("bow")
        plant.push(np.array([HARD / PUSH_TIME, 0.0, 0.0]), PUSH_TIME)
        go2.wait(LIMIT)
        assert go2.mode is Mode.STANDING


@pytest.mark.parametrize(
    ("offset", "steps"),
    [((0.0, 0.0), False), ((0.1, 0.0), False), ((0.3, 0.0), True), ((0.0, -0.13), True)],
)
def test_it_steps_where_the_capture_point_is_near_the_edge_of_the_feet(
    offset: tuple[float, float], *, steps: bool
) -> None:
    assert must_step(SNAPSHOT, offset) is steps


@pytest.mark.parametrize("ground", [0.0, 1.0])
def test_a_robot_that_has_sunk_does_not_step_wherever_its_ground_is(ground: float) -> None:
    for sunk, steps in ((0.0, True), (0.2, False)):
        com = SNAPSHOT.p_world_com + [0.0, 0.0, ground - sunk]
        feet = SNAPSHOT.p_world_feet + [0.0, 0.0, ground]
        now = SNAPSHOT.replaced(p_world_com=com, p_world_feet=feet)
        assert must_step(now, (0.3, 0.0)) is steps


def test_it_begins_on_the_feet_along_whose_line_it_falls() -> None:
    left_ahead, right_ahead = (
        trot_against(SNAPSHOT, (0.2, 0.1)),
        trot_against(SNAPSHOT, (0.2, -0.1)),
    )
    assert left_ahead.schedule().at(0.0).stance.tolist() == [True, False, False, True]
    assert right_ahead.schedule().at(0.0).stance.tolist() == [False, True, True, False]


def test_it_walks_on_at_a_little_less_than_its_speed_until_it_is_slow() -> None:
    yaw = 0.7
    q, v = standing_q(), np.zeros(18)
    q[3:7] = 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)
    v[:2] = 2.0, -1.0
    command = going_on(RobotModel().snapshot(state_of(q, v)))
    assert command.linear_x == pytest.approx(2.0 * KEPT_SPEED)
    assert command.linear_y == pytest.approx(-1.0 * KEPT_SPEED)
    assert command.angular_z == 0.0
    v[:2] = 0.9 * SLOW, 0.0
    assert going_on(RobotModel().snapshot(state_of(q, v))).is_zero


def test_a_robot_on_its_way_up_does_not_step() -> None:
    plant = MujocoPlant(control_period=PERIOD)
    with GO2Controller(plant=plant) as go2:
        stepping: list[bool] = []

        def note() -> None:
            behaviour = go2._runner.loop.behaviour
            stepping.append(isinstance(behaviour, Standing) and behaviour.is_stepping)

        go2._runner._after_tick = note
        assert go2.stand()
        assert stepping
        assert not any(stepping)
