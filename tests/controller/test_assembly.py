"""A controller is put together whole or not at all."""

import threading

import pytest

from controller import GO2Controller, assembly
from controller.assembly import build_pilot
from go2_wbc.config import Config
from go2_wbc.errors import ConfigError, PlantError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco import viewer
from tests.controller.plants import StillPlant, failing
from tests.script_server import python


class Window:
    """Stands in for MuJoCo's window, which needs a display."""

    def __init__(self) -> None:
        self.frames = 0
        self.is_closed = False

    def sync(self) -> None:
        assert not self.is_closed
        self.frames += 1

    def close(self) -> None:
        self.is_closed = True


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Window:
    window = Window()
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(viewer.mujoco.viewer, "launch_passive", lambda _model, _data: window)
    return window


def test_a_plant_that_another_pilot_drives_leaves_no_window_open(window: Window) -> None:
    # The window was opened before the runner refused the plant, and nobody closed it.
    plant = MujocoPlant()
    first = build_pilot(plant, Config())
    try:
        with pytest.raises(PlantError, match="another controller drives this plant"):
            GO2Controller(plant=plant, viewer=True)
    finally:
        first.close()
        plant.close()
    assert window.is_closed


def test_a_pilot_that_cannot_be_made_leaves_no_thread_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = threading.active_count()
    monkeypatch.setattr(assembly, "Pilot", failing(RuntimeError("no pilot")))
    with pytest.raises(RuntimeError, match="no pilot"):
        build_pilot(StillPlant(), Config(), realtime=True)
    assert threading.active_count() == before


def test_a_refused_configuration_closes_the_robot_that_was_made_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    closed: list[MujocoPlant] = []
    monkeypatch.setattr(MujocoPlant, "close", lambda plant: closed.append(plant))

    def refuse(*_: object, **__: object) -> None:
        raise ConfigError("no")

    monkeypatch.setattr("controller.go2_controller.build_pilot", refuse)
    with pytest.raises(ConfigError):
        GO2Controller()
    assert len(closed) == 1


def test_the_window_shows_fifty_frames_a_second_and_is_closed_in_the_end(window: Window) -> None:
    with GO2Controller(viewer=True) as go2:
        go2.wait(0.5)
        assert window.frames == pytest.approx(0.5 * viewer.FRAME_RATE, abs=1)
        assert not window.is_closed
    assert window.is_closed


def test_what_is_asked_to_follow_a_tick_follows_the_window(window: Window) -> None:
    seen: list[int] = []
    plant = MujocoPlant(control_period=1.0 / viewer.FRAME_RATE)
    note = lambda: seen.append(window.frames)  # noqa: E731
    pilot = build_pilot(plant, Config(), viewer=True, after_tick=note)
    pilot.runner.advance_until(lambda: len(seen) == 3, 1.0)
    pilot.close()
    plant.close()
    assert seen == [0, 1, 2]  # the first tick is the state that the window opened with


def test_the_last_ticks_are_recorded_for_as_long_as_is_asked() -> None:
    plant = StillPlant()
    pilot = build_pilot(plant, Config(), recorded_time=10 * plant.control_period)
    pilot.wait(30 * plant.control_period)
    pilot.close()
    assert len(pilot.runner.loop.telemetry.samples(1e6).unfinished.time) == 10


def test_nothing_is_left_to_compile_when_the_robot_has_been_taken_over() -> None:
    """A loop that waited for a compiler in the middle of standing up would be taken for dead."""
    script = (
        "import sys\n"
        "from controller import GO2Controller\n"
        "go2 = GO2Controller()\n"
        "from go2_wbc.compilation import Kernel\n"
        "def loaded():\n"
        "    every = [v for m in list(sys.modules.values()) for v in vars(m).values()]\n"
        "    return {v.name for v in every if isinstance(v, Kernel) and 'compiled' in vars(v)}\n"
        "before = loaded()\n"
        "assert go2.stand() and go2.walk() and go2.sit()\n"
        "print(sorted(loaded() - before), len(before) > 20)\n"
    )
    assert python("-c", script).stdout.strip() == "[] True"
