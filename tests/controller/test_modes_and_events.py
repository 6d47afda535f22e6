"""In every mode something notices a fall, a foot without ground, a broken part, a second thread."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller, Mode
from controller.modes import (
    Limited,
    are_within,
    lying,
    posture_measurements,
    sitting,
    standing,
    told,
)
from go2_wbc.errors import ModeError
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import Posture
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.state import Snapshot
from motions.batch_kinematics import configurations
from motions.postures import home_poses
from tests.controller.plants import HANG_GUARD, PERIOD, in_thread
from tests.engine_helpers import state_of

# N, s: it throws over a robot that stands, and lifts a foot that carries 40 N.
SHOVE, SHOVE_TIME = np.array([0.0, 900.0, 300.0]), 0.15
LIFT, LIFT_TIME = np.array([0.0, 0.0, 60.0]), 0.4
MOTOR = "FR_calf_joint"
DOWN = (Mode.FALLEN, Mode.DAMPED)


class Robot:
    """A robot, what brings it into a mode, and what it is told there."""

    def __init__(self) -> None:
        self.plant = MujocoPlant(control_period=PERIOD)
        self.truth = GroundTruth(self.plant)
        self.go2 = GO2Controller(plant=self.truth)

    def fall(self) -> None:
        self.go2.stand()
        self.plant.push(SHOVE, SHOVE_TIME)
        self.go2.wait(2.0)
        assert self.go2.mode is Mode.FALLEN

    def go_limp(self) -> None:
        self.go2.stand()
        self.go2.damp()
        self.go2.wait(1.0)

    def trot(self) -> None:
        self.go2.walk()
        self.go2.move(0.5)
        self.go2.wait(1.0)

    def is_down(self) -> bool:
        return self.truth.fall() is not None


def wait(robot: Robot) -> None:
    robot.go2.wait(2.5)


# How the robot comes into each mode, what is called there, and after how long [s] of that the
# event comes.
MODES: dict[str, tuple[Callable[[Robot], object], Callable[[Robot], object], float]] = {
    "standing": (lambda r: r.go2.stand(), wait, 0.1),
    "walking": (Robot.trot, wait, 0.1),
    "playing": (lambda r: r.go2.stand(), lambda r: r.go2.play("bow"), 0.8),
    "jumping": (lambda r: r.go2.stand(), lambda r: r.go2.play("jump_up"), 1.2),
    "sitting": (lambda r: r.go2.sit(), wait, 0.1),
    "lying": (lambda _: None, wait, 0.1),
    "limp": (Robot.go_limp, wait, 0.1),
    "fallen": (Robot.fall, wait, 0.1),
    "recovering": (Robot.fall, lambda r: r.go2.recover(), 0.7),
}
ON_THE_GROUND = ("lying", "limp", "fallen")


@pytest.fixture
def robot() -> Iterator[Robot]:
    robot = Robot()
    yield robot
    robot.go2.close()
    robot.plant.close()


def met(robot: Robot, mode: str, event: Callable[[], object]) -> object:
    """What the call says in which ``event`` comes."""
    prepare, call, moment = MODES[mode]
    prepare(robot)
    start = robot.plant.time + moment

    def look() -> None:
        if robot.plant.time >= start:
            robot.truth.on_tick = None
            event()

    robot.truth.on_tick = look
    return call(robot)


@pytest.mark.parametrize("mode", MODES)
def test_a_fall_is_noticed_in_every_mode(robot: Robot, mode: str) -> None:
    said = met(robot, mode, lambda: robot.plant.push(SHOVE, SHOVE_TIME))
    robot.go2.wait(0.5)
    if mode not in ("lying", "limp", "recovering"):  # these may end on the belly again
        assert robot.go2.mode is Mode.FALLEN
    assert robot.go2.mode in DOWN or not robot.is_down() or mode == "lying"
    assert said is not True or robot.go2.mode is Mode.STANDING
    assert robot.go2.health.is_sound  # tumbling limply was taken for broken motors


@pytest.mark.parametrize("mode", MODES)
def test_a_foot_without_ground_ends_well_or_is_told(robot: Robot, mode: str) -> None:
    said = met(robot, mode, lambda: robot.plant.push(LIFT, LIFT_TIME, "FR_foot"))
    robot.go2.wait(0.5)
    assert robot.go2.mode in DOWN or not robot.is_down() or mode in ON_THE_GROUND
    assert said is not True or robot.go2.mode is Mode.STANDING


@pytest.mark.parametrize("mode", MODES)
def test_a_dead_motor_is_named_in_every_mode(robot: Robot, mode: str) -> None:
    said = met(robot, mode, lambda: robot.plant.fault("motor", MOTOR))
    if mode in ON_THE_GROUND:  # nothing is asked of the motors there
        go2 = robot.go2
        said = go2.recover() if go2.mode is Mode.FALLEN else go2.stand()
    assert not said
    assert robot.go2.mode in DOWN
    assert MOTOR in str(robot.go2.health)
    assert MOTOR in robot.go2.last_outcome.reason or mode in ("fallen", "recovering", "walking")


@pytest.mark.parametrize("mode", MODES)
def test_a_second_thread_is_refused_but_for_damp(robot: Robot, mode: str) -> None:
    refused: list[Exception | None] = []
    damped: list[Future[None]] = []

    def call_twice() -> None:
        refused.append(in_thread(robot.go2.sit).exception(HANG_GUARD))  # type: ignore[arg-type]
        damped.append(in_thread(robot.go2.damp))

    said = met(robot, mode, call_twice)
    damped[0].result(HANG_GUARD)
    assert isinstance(refused[0], ModeError)
    assert not said
    assert robot.go2.mode in DOWN


MODEL = RobotModel()
HOME = home_poses(MODEL)
LYING = 0.085  # m; of the base over the ground, on its belly
ASKED: dict[Posture, Callable[[Snapshot], Limited]] = {
    Posture.STAND: standing,
    Posture.SIT: sitting,
    Posture.LIE: lying,
}


def at_rest(posture: Posture, ground: float = 0.0, slope: float = 0.0) -> Snapshot:
    """In ``posture`` with the feet below the hips, the ground at a height, or rising ahead."""
    pose = HOME[posture].copy()
    pose[2] = LYING if posture is Posture.LIE else pose[2]
    feet = MODEL.p_base_feet_nominal.copy()
    feet[:, 2] = MODEL.foot_radius + slope * feet[:, 0]
    p_base_feet = (feet - pose[:3]) @ rotation_from_rpy(*pose[3:])
    joints = [leg_angles(LegGeometry.of(MODEL, leg), p_base_feet[leg][None]).q[0] for leg in LEGS]
    pose[2] += ground
    state = state_of(configurations(pose[None], np.concatenate(joints)[None])[0])
    return MODEL.snapshot(replace(state, feet_in_contact=np.ones(4, dtype=bool)))


@pytest.mark.parametrize("ground", [0.0, 0.4, -1.3])
@pytest.mark.parametrize("posture", Posture)
def test_a_posture_is_known_whatever_the_height_of_the_ground(
    posture: Posture, ground: float
) -> None:
    snapshot = at_rest(posture, ground)
    assert [name for name, asked in ASKED.items() if are_within(asked(snapshot))] == [posture]
    level = posture_measurements(at_rest(posture))
    assert posture_measurements(snapshot) == pytest.approx(level, abs=1e-9)


def test_the_speed_that_is_told_is_how_fast_the_base_moves_not_how_it_turns() -> None:
    state = replace(at_rest(Posture.STAND).state, v=np.array([0.3, 0.0, 0.4, *np.ones(15)]))
    told = posture_measurements(MODEL.snapshot(state))
    assert told["base speed [m/s]"] == pytest.approx(0.5)


@pytest.mark.parametrize("slope", [-0.14, 0.14])
@pytest.mark.parametrize("posture", [Posture.STAND, Posture.SIT])
def test_on_a_slope_a_posture_has_its_height_over_the_ground_below_it(
    posture: Posture, slope: float
) -> None:
    # The lowest foot of a robot that sat on 8 deg was 27 mm lower: it sat still, and `sit` said no.
    assert are_within(ASKED[posture](at_rest(posture, slope=slope)))


@pytest.mark.parametrize(("part", "speed"), [(0, 0.06), (8, 0.6)])  # the base, a joint
@pytest.mark.parametrize("posture", Posture)
def test_a_robot_that_still_moves_is_in_no_posture(
    posture: Posture, part: int, speed: float
) -> None:
    snapshot, v = at_rest(posture), np.zeros(18)
    v[part] = speed
    moving = MODEL.snapshot(replace(snapshot.state, v=v))
    assert not any(are_within(asked(moving)) for asked in ASKED.values())


@pytest.mark.parametrize("posture", [Posture.STAND, Posture.SIT])
def test_a_foot_in_the_air_is_no_posture_on_four_feet(posture: Posture) -> None:
    snapshot = at_rest(posture)
    touching = np.array([True, True, False, True])
    raised = snapshot.replaced(state=replace(snapshot.state, feet_in_contact=touching))
    assert told(ASKED[posture](raised)) == "feet in the air 1, limit 1"
