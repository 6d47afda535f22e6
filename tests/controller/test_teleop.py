"""Driving by keys: what each key does, that long calls do not block, and a real terminal."""

import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from controller import GO2Controller, Mode
from controller.cli import main as cli
from controller.cli.common import ExitCode
from controller.teleop import (
    ACTIONS,
    AHEAD,
    ASIDE,
    BUTTONS,
    DAMP,
    DEAD_ZONE,
    LEGEND,
    STEPS,
    STOP,
    TURNING,
    PadReading,
    Teleop,
    find_gamepad,
    keys_help,
)
from go2_wbc.errors import ModeError
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from tests.controller.fake_go2 import FakeGo2

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 60.0  # s; a time-out, not a measurement


@pytest.fixture
def driven() -> Iterator[Teleop]:
    with GO2Controller(realtime=True) as go2:
        yield Teleop(go2)


def until_idle(teleop: Teleop) -> list[str]:
    end = time.monotonic() + LONGEST
    while teleop.is_busy and time.monotonic() < end:
        time.sleep(0.05)
    assert not teleop.is_busy
    return teleop.news()


def test_keys_walk_turn_and_stop_the_robot(driven: Teleop) -> None:
    assert driven.press("4")
    assert driven.is_busy
    driven.press("2")
    assert driven.status().startswith("walk ...")
    assert until_idle(driven) == ["walk is still running: k ends it", "walk: done"]
    for key in "wwad":
        assert driven.press(key)
    assert "asked +0.2 +0.0 m/s +0.0 rad/s" in driven.status()
    driven.press("e")
    assert "asked +0.2 -0.1 m/s" in driven.status()
    driven.press(" ")
    assert "asked +0.0 +0.0 m/s" in driven.status()
    assert len(driven.status()) <= 79


def test_a_key_that_makes_no_sense_now_says_why(driven: Teleop) -> None:
    driven.press("w")
    (told,) = driven.news()
    assert "walk()" in told
    driven.press("?")
    assert driven.news() == []
    assert driven.status().startswith("lying")


def test_going_limp_ends_a_call_that_runs() -> None:
    with GO2Controller(realtime=True) as go2:
        driven = Teleop(go2)
        driven.press("1")
        end = time.monotonic() + LONGEST
        while go2.mode is not Mode.MOVING and time.monotonic() < end:
            time.sleep(0.01)
        driven.press("k")
        assert "stand: damped by damp()" in until_idle(driven)
        assert driven.status().startswith("damped")


def test_the_last_key_ends_it_and_the_robot_is_limp() -> None:
    with GO2Controller(realtime=True) as go2:
        teleop = Teleop(go2)
        teleop.press("1")
        until_idle(teleop)
        assert not teleop.press("x")
        teleop.close()
        assert go2.mode is Mode.DAMPED


def test_the_help_names_every_key_and_every_button_stands_for_one() -> None:
    text = keys_help()
    assert max(map(len, text.splitlines())) <= 80
    for table in (STEPS, ACTIONS):
        assert all(f"{key} {label}" in text for key, (label, _) in table.items())
    assert set(BUTTONS.values()) <= {*ACTIONS, STOP, DAMP}
    assert PadReading((), (0, 6, 99)).keys == "4k"
    assert max(map(len, LEGEND.splitlines())) <= 80


def test_without_a_terminal_it_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["teleop"]) == ExitCode.USAGE
    assert "terminal" in capsys.readouterr().err


@pytest.mark.slow
def test_in_a_real_terminal_keys_drive_it_and_the_terminal_is_left_as_it_was() -> None:
    import pty
    import termios

    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    command = [sys.executable, "-m", "controller.cli.main", "teleop", "--sensors", "imu"]
    process = subprocess.Popen(command, cwd=ROOT, stdin=theirs, stdout=theirs, stderr=theirs)
    try:
        assert "high five" in read_until(ours, "lying")
        os.write(ours, b"1")
        assert "stand: done" in read_until(ours, "stand: done")
        os.write(ours, b"x")
        assert process.wait(LONGEST) == ExitCode.OK
        assert termios.tcgetattr(theirs) == before
    finally:
        process.kill()
        process.wait()
        os.close(ours)
        os.close(theirs)


def read_until(handle: int, word: str) -> str:
    text, end = "", time.monotonic() + LONGEST
    while word not in text and time.monotonic() < end:
        if select.select([handle], [], [], 0.5)[0]:
            text += os.read(handle, 4096).decode(errors="ignore")
    return text


class FakePygame:
    """As much of pygame as is used; ``axes`` and ``held`` are what the pad says."""

    error = RuntimeError

    def __init__(self, count: int = 1) -> None:
        self.count, self.axes, self.held, self.has_quit = count, [0.0] * 4, set[int](), False
        pad = SimpleNamespace(
            init=lambda: None,
            get_name=lambda: "A pad",
            get_numaxes=lambda: len(self.axes),
            get_axis=lambda n: self.axes[n],
            get_numbuttons=lambda: 8,
            get_button=lambda n: n in self.held,
        )
        self.display = SimpleNamespace(init=lambda: None)
        self.event = SimpleNamespace(pump=lambda: None)
        self.joystick = SimpleNamespace(
            init=lambda: None, get_count=lambda: self.count, Joystick=lambda _n: pad
        )

    def quit(self) -> None:
        self.has_quit = True


def with_library(monkeypatch: pytest.MonkeyPatch, library: object) -> None:
    monkeypatch.setitem(sys.modules, "pygame", library)


def test_sticks_are_a_velocity_and_a_worn_one_asks_for_nothing() -> None:
    assert PadReading((0.0, -1.0, 0.0, 0.0)).command == VelocityCommand(AHEAD)
    assert PadReading((1.0, 0.0, 0.0, 0.0)).command == VelocityCommand(0.0, -ASIDE)
    assert PadReading((0.0, 0.0, 0.0, -1.0)).command == VelocityCommand(0.0, 0.0, TURNING)
    half = PadReading((0.0, -(1.0 + DEAD_ZONE) / 2, 0.0, 0.0)).command
    assert half.linear_x == pytest.approx(AHEAD / 2, abs=1e-3)
    assert PadReading((DEAD_ZONE, -DEAD_ZONE, 1.0)).command == ZERO_COMMAND


def test_a_gamepad_is_found_read_and_missed_when_it_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    library = FakePygame()
    with_library(monkeypatch, library)
    pad, said = find_gamepad()
    assert pad is not None
    assert said == "gamepad: A pad"
    library.held = {0}
    first, second = pad.read(), pad.read()
    assert first is not None
    assert second is not None
    assert first.pressed == (0,)
    assert second.pressed == ()  # it is still held, not pressed again
    library.count = 0
    assert pad.read() is None
    pad.close()
    assert library.has_quit


@pytest.mark.parametrize(
    ("library", "told"), [(None, "pip install"), (FakePygame(0), "no gamepad is plugged in")]
)
def test_without_a_gamepad_it_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, library: object, told: str
) -> None:
    with_library(monkeypatch, library)
    pad, said = find_gamepad()
    assert pad is None
    assert told in said


def test_a_gamepad_drives_only_while_its_sticks_say_something() -> None:
    go2 = FakeGo2()
    teleop = Teleop(go2)
    ahead, rest = PadReading((0.0, -1.0, 0.0, 0.0)), PadReading((0.0, 0.0, 0.0, 0.0))
    assert teleop.follow(ahead)
    assert "move" not in go2.calls, "it does not walk yet"
    go2.walk()
    for reading in (rest, ahead, ahead, rest, rest):
        teleop.follow(reading)
    assert go2.calls.count("move") == 3, "ahead twice, then once to stop; keys are left alone"
    teleop.follow(PadReading((), (1,)))
    assert go2.calls[-1] == "stop"


def test_a_robot_that_falls_just_when_the_sticks_move_does_not_end_the_drive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    go2 = FakeGo2()
    teleop = Teleop(go2)
    go2.walk()

    def move(*_: float, **__: float) -> None:
        raise ModeError("move() needs walking mode, not fallen: call walk() first")

    monkeypatch.setattr(go2, "move", move)
    assert teleop.follow(PadReading((0.0, -1.0, 0.0, 0.0)))
    (told,) = teleop.news()
    assert "not fallen" in told


def test_the_state_line_of_a_limp_robot_says_what_helps() -> None:
    with GO2Controller() as go2:
        teleop = Teleop(go2)
        assert go2.stand()
        go2.damp()
        assert go2.mode is Mode.DAMPED
        line = teleop.status()
        assert "r recovers" in line
        assert len(line) <= 79
