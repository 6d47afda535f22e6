"""The controller drives other plants, in realtime too, and leaves every one of them limp."""

from inspect import isfunction
from pathlib import Path
from unittest.mock import Mock

import pytest

from controller import GO2Controller, Mode
from go2_wbc.errors import ClosedError, ConfigError, PlantError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics, build_spec
from go2_wbc.robot.description import find_description
from tests.controller.plants import HANG_GUARD, PERIOD, StillPlant, WatchedPlant, in_thread, is_limp
from tests.pages import run_python


def test_in_realtime_the_robot_stands_and_walks_while_the_script_waits() -> None:
    plant = WatchedPlant(MujocoPlant(control_period=2 * PERIOD))
    with GO2Controller(plant=plant, realtime=True) as go2:

        def script() -> bool:
            ok = go2.stand() and go2.walk()
            go2.move(0.2)
            go2.wait(0.2)
            go2.stop()
            return ok

        assert in_thread(script).result(HANG_GUARD), go2.last_outcome.reason
        assert go2.mode is Mode.WALKING
    assert is_limp(plant.commands[-1])


def test_in_realtime_stop_does_not_wait() -> None:
    with GO2Controller(plant=StillPlant(), realtime=True) as go2:
        go2.stop()
        assert go2.last_outcome.reason == "lying, nothing asked yet"


def test_a_users_mjcf_stands_under_the_same_controller(tmp_path: Path) -> None:
    spec = build_spec(find_description(), JointDynamics(), friction=0.8)
    spec.compile()
    path = tmp_path / "mine.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    with GO2Controller(plant=MujocoPlant(path, control_period=PERIOD)) as go2:
        assert go2.stand(), go2.last_outcome.reason
        run = go2.recording()
    assert (run.robot, run.model_file) == ("go2", str(path))


def test_a_recording_says_which_robot_it_holds() -> None:
    with GO2Controller(robot="a1") as a1:
        a1.wait(0.1)
        run = a1.recording()
    assert (run.robot, run.model_file) == ("a1", "")


def test_with_noisy_sensors_the_robot_stands_and_trots() -> None:
    plant = MujocoPlant(sensors="noisy", seed=5)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand(), go2.last_outcome.reason
        assert go2.walk()
        start = go2.state.q[0]
        go2.move(0.4)
        go2.wait(3.0)
        assert go2.last_outcome.ok, go2.last_outcome.reason
        assert go2.mode is Mode.WALKING
        assert go2.state.q[0] - start == pytest.approx(0.4 * 3.0, rel=0.2)


def test_no_viewer_where_there_is_no_display_or_another_plant(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with GO2Controller(plant=MujocoPlant(), viewer=True) as go2:
        go2.wait(0.1)
    assert "no viewer: cannot open the viewer: there is no display" in caplog.text
    with GO2Controller(plant=StillPlant(), viewer=True):
        assert "the viewer shows MuJoCo plants only" in caplog.text


ARGUMENTS = {
    **dict.fromkeys(("wait", "move_forward", "turn_left", "turn_right"), (1.0,)),
    "play": ("high_five",),
}
ALLOWED = {"close", "destroy_node", "explain", "prepare", "recording"}  #: What may still be called
CALLS = [
    name
    for name, member in vars(GO2Controller).items()
    if isfunction(member) and not name.startswith("_") and name not in ALLOWED
]


@pytest.fixture(scope="module")
def closed() -> GO2Controller:
    go2 = GO2Controller()
    go2.close()
    return go2


@pytest.mark.parametrize("name", CALLS)
def test_every_call_after_close_is_refused(closed: GO2Controller, name: str) -> None:
    with pytest.raises(ClosedError, match="closed"):
        getattr(closed, name)(*ARGUMENTS.get(name, ()))


def test_a_closed_controller_can_still_be_looked_at(closed: GO2Controller) -> None:
    assert closed.mode is Mode.CLOSED
    assert closed.state.time == 0.0
    assert closed.command.is_zero
    assert closed.namespace == "robot1"
    assert closed.recording().duration == 0.0


def test_leaving_the_with_block_by_an_error_closes_the_robot_that_it_made_once() -> None:
    with pytest.raises(ZeroDivisionError), GO2Controller() as go2:
        _ = 1 / 0
    for _ in range(2):
        assert go2.mode is Mode.CLOSED
        with pytest.raises(ClosedError):
            go2.plant.read()
        go2.destroy_node()
        go2.close()


def test_a_plant_that_was_given_is_left_open_and_limp() -> None:
    plant = WatchedPlant()
    with GO2Controller(plant=plant) as go2:
        go2.wait(2 * PERIOD)
    assert is_limp(plant.commands[-1])
    assert plant.read().time > 0.0


def test_a_plant_obeys_one_controller_at_a_time() -> None:
    plant = MujocoPlant()
    with (
        GO2Controller(plant=plant),
        pytest.raises(PlantError, match="another controller drives this plant"),
    ):
        GO2Controller("robot2", plant=plant)
    with GO2Controller("robot2", plant=plant) as go2:
        assert go2.stand()


@pytest.mark.parametrize("period", [0.0, -0.002, float("nan"), "2 ms", None, 0.2])
def test_a_period_in_which_nothing_can_be_controlled_is_refused(period: object) -> None:
    plant = Mock(spec=MujocoPlant, control_period=period, is_live=False, robot="go2")
    with pytest.raises(ConfigError, match=r"control_period must be above 0, at most 0.1 s; got"):
        GO2Controller(plant=plant)


NO_STATES = """
from dataclasses import replace
from controller import GO2Controller
from go2_wbc.errors import PlantError
from tests.controller.plants import WatchedPlant

for wrong in (
    lambda state: None,
    lambda state: replace(state, q=state.q[:18]),
    lambda state: replace(state, v=state.v.astype("f4")),
    lambda state: replace(state, tau=[0.0] * 12),
    lambda state: replace(state, feet_in_contact=state.foot_forces),
):
    plant = WatchedPlant()
    with GO2Controller(plant=plant) as go2:
        for plant.on_read in (lambda state: state, wrong):
            try:
                go2.wait(0.01)
            except PlantError as error:
                print(go2.mode.value, error)
    try:
        GO2Controller(plant=plant)
    except PlantError as error:
        print(error)
"""


def test_what_is_no_state_is_told_with_the_plant_that_gave_it(tmp_path: Path) -> None:
    # In a process of its own: under pytest the run-time type checks would refuse it first.
    done = run_python(NO_STATES, tmp_path)
    told = [
        ", got None",
        " with q of shape (19,) of float64, got (18,) of float64",
        " with v of shape (18,) of float64, got (18,) of float32",
        " with tau of shape (12,) of float64, got (12,) of list",
        " with feet_in_contact of shape (4,) of bool, got (4,) of float64",
    ]
    lines = done.stdout.splitlines()
    assert [line.split("WatchedPlant.read() must give a RobotState") for line in lines] == [
        [where, what] for what in told for where in ("damped ", "")
    ], done.stderr
