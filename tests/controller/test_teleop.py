"""Driving by keys: what each key does, that long calls do not block, and a real terminal."""

import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from controller import GO2Controller, Mode
from controller.cli import main as cli
from controller.cli.common import ExitCode
from controller.teleop import ACTIONS, STEPS, Teleop, keys_help

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


def test_the_help_names_every_key_within_80_columns() -> None:
    text = keys_help()
    assert max(map(len, text.splitlines())) <= 80
    for table in (STEPS, ACTIONS):
        assert all(f"{key} {label}" in text for key, (label, _) in table.items())


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
