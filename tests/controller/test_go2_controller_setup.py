"""What a controller is made of may be missing, broken or unknown: the error says what and why."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
import qpsolvers

from controller import GO2Controller
from controller.assembly import build_pilot
from go2_wbc.config import Config
from go2_wbc.errors import (
    ClosedError,
    ConfigError,
    DescriptionError,
    ModelMismatch,
    SolverUnavailable,
)
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import Reference
from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import MOTORS
from go2_wbc.robot.profile import find_profile
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import Task
from tests.controller.plants import WatchedPlant

STAND_HEIGHT = find_profile().stand_height


def test_without_the_robots_files_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = [entry for entry in sys.path if "site-packages" not in entry]
    monkeypatch.setattr(sys, "path", here)
    with pytest.raises(DescriptionError, match="pip install example-robot-data"):
        GO2Controller()


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda text: text[: len(text) // 2], "not a valid URDF"),
        (lambda text: text.replace("FL_hip_joint", "front_left"), "lacks: joint FL_hip_joint"),
        (lambda text: text.replace("<robot", "<cow").replace("</robot", "</cow"), "root is <cow>"),
    ],
)
def test_a_broken_urdf_is_refused_with_the_reason(
    tmp_path: Path, edit: Callable[[str], str], message: str
) -> None:
    path = tmp_path / "mine.urdf"
    text = find_description().urdf_path.read_text(encoding="utf-8")
    path.write_text(edit(text), encoding="utf-8")
    with pytest.raises(DescriptionError, match=message):
        GO2Controller(plant=MujocoPlant(urdf=path))


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


def test_an_unknown_back_end_is_refused_with_the_valid_ones_and_the_plant_left_untouched(
    plant: WatchedPlant,
) -> None:
    with pytest.raises(ConfigError, match="valid: condensed, full, placo"):
        GO2Controller(plant=plant, config=Config(backend="magic"))
    assert not plant.commands


def test_a_plant_that_cannot_be_read_is_refused_at_once(plant: WatchedPlant) -> None:
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


# --- tasks of a user's own ------------------------------------------------------------------------


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


def test_a_task_of_ones_own_is_followed_while_the_robot_walks() -> None:
    task = SteadyTrunk()
    assert pitching(task) < 0.6 * pitching()
    assert len(task.asked) > 1500


def test_a_task_of_ones_own_is_asked_in_plans_with_few_feet_too(plant: WatchedPlant) -> None:
    task = SteadyTrunk()
    pilot = build_pilot(plant, Config(), extra_tasks=(task,))
    try:
        loop = pilot.runner.loop
        for wbc in (loop.wbc, loop._dynamic_wbc):
            assert wbc.tasks[-1] is task
    finally:
        pilot.close()


def test_placo_takes_no_tasks_of_ones_own(plant: WatchedPlant) -> None:
    with pytest.raises(ConfigError, match="the placo back end"):
        GO2Controller(plant=plant, config=Config(backend="placo"), extra_tasks=[SteadyTrunk()])


def test_a_robot_rises_and_walks_by_placo(plant: WatchedPlant) -> None:
    with GO2Controller(plant=plant, config=Config(backend="placo")) as go2:
        assert go2._runner.loop.wbc.backend_name == "placo"
        assert go2.walk()
        go2.move(0.3)
        go2.wait(0.5)
        assert go2.last_outcome.ok
        assert go2.telemetry.qp_failures == 0
