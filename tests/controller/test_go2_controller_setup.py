"""What a controller is made of may be missing, broken or unknown: the error says what and why."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
import qpsolvers

from controller import GO2Controller, Mode
from controller.assembly import build_pilot
from go2_wbc.config import Config
from go2_wbc.errors import (
    ClosedError,
    CommandError,
    ConfigError,
    DescriptionError,
    Go2WbcError,
    ModelMismatch,
    SolverUnavailable,
)
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import Reference
from go2_wbc.robot.description import find_description, find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import MOTORS
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import Task
from motions import Timeline
from tests.controller.plants import StillPlant, WatchedPlant
from tests.pages import run_python

STAND_HEIGHT = find_profile().stand_height


def test_without_the_robots_files_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = [entry for entry in sys.path if "site-packages" not in entry]
    monkeypatch.setattr(sys, "path", here)
    with pytest.raises(DescriptionError, match="pip install example-robot-data"):
        GO2Controller()


def test_a_missing_urdf_or_mjcf_is_named(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match=r"nowhere\.urdf: No such file"):
        GO2Controller(plant=MujocoPlant(urdf=tmp_path / "nowhere.urdf"))
    with pytest.raises(DescriptionError, match=r"nowhere\.urdf"):
        GO2Controller(urdf=tmp_path / "nowhere.urdf")
    with pytest.raises(ModelMismatch, match=r"nowhere\.xml: no such file"):
        GO2Controller(plant=MujocoPlant(tmp_path / "nowhere.xml"))


@pytest.mark.parametrize(
    ("solver", "told"),
    [
        ("gurobi9000", "unknown QP solver 'gurobi9000'; valid: active_set, daqp"),
        ("proxqp", "pip install proxsuite; installed: active_set, daqp"),
    ],
)
def test_a_solver_that_is_unknown_or_not_installed_is_refused_with_what_helps(
    monkeypatch: pytest.MonkeyPatch, solver: str, told: str
) -> None:
    monkeypatch.setattr(qpsolvers, "available_solvers", ["daqp"])
    with pytest.raises(SolverUnavailable, match=told):
        GO2Controller(config=Config(wbc=replace(WbcConfig(), solver=solver)))


def test_an_unknown_back_end_and_a_plant_that_cannot_be_read_are_refused(
    plant: WatchedPlant,
) -> None:
    with pytest.raises(ConfigError, match="valid: condensed, full, placo"):
        GO2Controller(plant=plant, config=Config(backend="magic"))
    with pytest.raises(ConfigError, match="of which robot"):
        GO2Controller(plant=plant, config=Config.of_robot("a1"))
    assert not plant.commands
    plant.close()
    with pytest.raises(ClosedError, match="plant is closed"):
        GO2Controller(plant=plant)


def test_a_urdf_of_ones_own_makes_the_model_and_the_robot(tmp_path: Path) -> None:
    path = tmp_path / "heavier.urdf"
    text = find_description().urdf_path.read_text(encoding="utf-8")
    rotor, heavier = '<mass value="0.089"/>', '<mass value="0.589"/>'
    path.write_text(text.replace(rotor, heavier), encoding="utf-8")
    with GO2Controller(urdf=path) as go2:
        plant = go2.plant
        assert isinstance(plant, MujocoPlant)
        model = RobotModel(find_description(path))
        assert model.mass == pytest.approx(RobotModel().mass + 0.5 * text.count(rotor))
        assert plant.total_mass == pytest.approx(model.mass)
        assert go2.stand()
        height = go2.last_outcome.measured["CoM height [m]"]
        assert height == pytest.approx(STAND_HEIGHT, abs=0.005)


@pytest.mark.parametrize("motor", MOTORS)
def test_the_motor_is_the_same_for_robot_controller_and_check(motor: str) -> None:
    expected = RobotModel(motor=motor).motor.no_load_speed
    with GO2Controller(config=Config(motor=motor)) as go2:
        assert isinstance(go2._plant, MujocoPlant)
        models = (go2._runner.loop.model, go2._checker.model)
        for found in (go2._plant.motor, *(model.motor for model in models)):
            assert np.array_equal(found.no_load_speed, expected)


@dataclass(frozen=True, slots=True)
class SteadyTrunk(Task):
    """Slow the trunk's turning down, and note which robots were asked."""

    asked: list[float] = field(default_factory=list)
    weight: float = 30.0
    name: str = "steady trunk"
    unit: str = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        self.asked.append(snapshot.state.time)
        return Rows(np.eye(2, SIZE, 3), -50.0 * snapshot.v[3:5])


def pitching(*tasks: Task) -> float:
    """How fast the trunk pitches at a trot, root mean square [rad/s]."""
    with GO2Controller(extra_tasks=tasks) as go2:
        assert go2.stand()
        go2.walk("trot")
        go2.move(0.5)
        go2.wait(3.0)
        run = go2.recording()
        return float(np.sqrt(np.mean(run.v[run.time > run.time[-1] - 2.0, 4] ** 2)))


def test_a_task_of_ones_own_is_followed_on_the_way_and_in_plans_with_few_feet(
    plant: WatchedPlant,
) -> None:
    task = SteadyTrunk()
    assert pitching(task) < 0.6 * pitching()
    assert len(task.asked) > 1500
    pilot = build_pilot(plant, Config(), extra_tasks=(task,))
    try:
        loop = pilot.runner.loop
        for wbc in (loop.wbc, loop._dynamic_wbc):
            assert wbc.tasks[-1] is task
    finally:
        pilot.close()


def test_a_robot_rises_and_walks_by_placo_without_tasks_of_ones_own(plant: WatchedPlant) -> None:
    with pytest.raises(ConfigError, match="the placo back end"):
        GO2Controller(plant=plant, config=Config(backend="placo"), extra_tasks=[SteadyTrunk()])
    with GO2Controller(plant=plant, config=Config(backend="placo")) as go2:
        assert go2._runner.loop.wbc.backend_name == "placo"
        assert go2.walk()
        go2.move(0.3)
        go2.wait(0.5)
        assert go2.last_outcome.ok
        assert go2.telemetry.qp_failures == 0


Call = Callable[[GO2Controller], object]


@pytest.fixture(scope="module")
def lying() -> Iterator[GO2Controller]:
    """A lying robot; no time may pass in these tests."""
    with GO2Controller() as go2:
        yield go2
        assert go2.state.time == 0.0
        assert go2.mode is Mode.LYING


ANGLES: dict[str, Callable[[GO2Controller, float], object]] = {
    "turn_left": lambda go2, angle: go2.turn_left(angle),
    "turn_right": lambda go2, angle: go2.turn_right(angle),
    "initial_yaw": lambda _, angle: MujocoPlant(initial_yaw=angle),
    "turn": lambda _, angle: Timeline().turn(angle),
    "walk": lambda _, angle: Timeline().walk(turn=angle),
    "path": lambda _, angle: Timeline().path([(0.2, 0.0, angle)]),
    "body": lambda _, angle: Timeline().body(yaw=angle, over=1.0),
    "spin_jump": lambda _, angle: Timeline().spin_jump(angle),
}


@pytest.mark.parametrize("way", ANGLES)
def test_degrees_are_asked_back_wherever_an_angle_is_taken(way: str, lying: GO2Controller) -> None:
    for angle in (30.0, 45.0, 60.0, 90.0, -90.0, 180.0, 270.0, 360.0, 720.0):
        with pytest.raises(Go2WbcError, match=r"deg\(|from -3.14 to 3.14"):
            ANGLES[way](lying, angle)
    assert lying.mode is Mode.LYING


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda go2: go2.high_five(hold=0.4), "hold must be 0.5 to 30 s, got 0.4"),
        (lambda go2: go2.high_five(hold=31.0), "hold must be 0.5 to 30 s, got 31.0"),
        (lambda go2: go2.wait(-0.1), r"seconds must be from 0 to 1e\+06 s, got -0.1"),
        (lambda go2: go2.turn_right(90), r"^angle of 90 rad .* write deg\(90\)"),
        (lambda go2: go2.move_forward(1e9), r"distance must be within \+-100 m, got 1"),
        (lambda go2: go2.high_five("up"), "unknown side 'up'; valid: left, right"),
        (lambda go2: go2.walk("canter"), "unknown gait 'canter'; valid: .*trot"),
        (lambda go2: go2.play("nod", times=0), "times must be a whole number of 1 or more, got 0"),
        (lambda go2: go2.play("levitate"), "unknown motion 'levitate'; valid: .*high_five"),
        (lambda go2: go2.recording(rate=0.0), "rate must be positive, got 0.0"),
    ],
)
def test_a_value_out_of_range_or_an_unknown_name_is_refused_with_what_is_valid(
    lying: GO2Controller, call: Call, message: str
) -> None:
    with pytest.raises(CommandError, match=message):
        call(lying)


def test_a_plant_in_the_place_of_the_namespace_is_told_where_it_goes() -> None:
    # In a process of its own: tests check types themselves.
    line = "import go2_wbc, controller; controller.GO2Controller(go2_wbc.MujocoPlant())"
    ended = subprocess.run(
        [sys.executable, "-c", line], capture_output=True, text=True, check=False
    )
    assert "ConfigError: namespace must be letters" in ended.stderr
    assert "a plant is given as plant=" in ended.stderr


@pytest.mark.parametrize("name", ["", " ", "2nd", "robot 1", "robot1\n", "a/b", "roböt", "a-b"])
def test_a_namespace_that_is_not_a_name_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="letters, digits and underscores, a letter first"):
        GO2Controller(namespace=name, plant=StillPlant())


def test_a_plant_whose_time_does_not_wait_is_refused_without_realtime(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plant = StillPlant()
    with GO2Controller(plant=plant):
        pass
    monkeypatch.setattr(StillPlant, "is_live", True)
    with pytest.raises(ConfigError, match=r"StillPlant must get commands.*realtime=True"):
        GO2Controller(plant=plant)
    with GO2Controller(plant=plant, realtime=True) as go2:
        assert go2.mode is Mode.LYING


def test_a_refused_call_is_the_last_outcome() -> None:
    with GO2Controller(plant=StillPlant()) as go2:
        with pytest.raises(CommandError):
            go2.walk("canter")
        assert not go2.last_outcome
        assert "canter" in go2.last_outcome.reason


WRONG_TASKS = """
from controller import GO2Controller
from go2_wbc import Task
from go2_wbc.errors import ConfigError

for tasks in (Task, [Task], None, "tasks"):
    try:
        GO2Controller(extra_tasks=tasks)
    except ConfigError as error:
        assert "got" in str(error), error
    else:
        raise SystemExit(f"{tasks} was accepted")
"""


def test_what_are_no_tasks_is_refused_by_an_error_of_our_own(tmp_path: Path) -> None:
    # In a process of its own: under pytest the run-time type checks would refuse them first.
    done = run_python(WRONG_TASKS, tmp_path)
    assert done.returncode == 0, done.stderr


FRACTIONS = """
from fractions import Fraction
from controller.navigation import DriveStraight, TurnInPlace

print(DriveStraight(Fraction(1, 3)).name, TurnInPlace(Fraction(1, 3), -1.0).name, sep=", ")
"""


def test_a_fraction_is_a_distance_and_an_angle(tmp_path: Path) -> None:
    # Again without the run-time type checks. It ended in a TypeError, and the robot went limp.
    assert run_python(FRACTIONS, tmp_path).stdout == "walk 0.333 m, turn by -19.1 deg\n"
