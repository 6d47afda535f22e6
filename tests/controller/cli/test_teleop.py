"""``go2-wbc teleop`` in a terminal that is none: what it drives, tells and closes."""

import sys
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

import controller.go2_controller
import go2_wbc.plant
from controller import teleop as driving
from controller.cli import teleop
from controller.cli.common import ExitCode
from controller.teleop import LEGEND, PadReading


@pytest.mark.parametrize("has_pad", [False, True])
@pytest.mark.parametrize("keyboard", [False, True])
@pytest.mark.parametrize("error", [None, KeyboardInterrupt])
def test_a_gamepad_is_told_and_all_is_closed(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: type[BaseException] | None,
    *,
    has_pad: bool,
    keyboard: bool,
) -> None:
    did = list[object]()
    pad = SimpleNamespace(close=lambda: did.append("pad")) if has_pad else None
    plant = SimpleNamespace(close=lambda: did.append("plant"))
    driver = SimpleNamespace(close=lambda: did.append("driver"))

    def drive(*given: object) -> None:
        did.append(given)
        if error is not None:
            raise error

    def robot(**given: object) -> object:
        assert given["plant"] is plant
        assert given["realtime"] is True
        return nullcontext()

    for where, name, value in (
        (sys, "stdin", SimpleNamespace(isatty=lambda: True)),
        (sys.stdout, "isatty", lambda: True),
        (driving, "find_gamepad", lambda: (pad, "looked for")),
        (driving, "Teleop", lambda _: driver),
        (controller.go2_controller, "GO2Controller", robot),
        (go2_wbc.plant, "MujocoPlant", lambda *_, **__: plant),
        (teleop, "_single_keys", nullcontext),
        (teleop, "_drive", drive),
    ):
        monkeypatch.setattr(where, name, value)
    assert teleop.run(keyboard=keyboard) == ExitCode.OK
    used = None if keyboard else pad
    assert did == [(driver, used), "driver", *["pad"] * (used is not None), "plant"]
    said = capsys.readouterr().out
    assert (LEGEND in said) is (used is not None)
    assert ("keys only" if keyboard else "looked for") in said


@pytest.mark.parametrize("has_pad", [False, True])
def test_keys_drive_until_one_ends_and_a_gamepad_that_is_lost_stops_the_robot(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *, has_pad: bool
) -> None:
    monkeypatch.setattr(teleop.shutil, "get_terminal_size", lambda: SimpleNamespace(columns=8))
    keys, readings, did = ["", "4w", "x", "never"], [PadReading((0.0,)), None], list[object]()
    monkeypatch.setattr(teleop, "_pressed", lambda: keys.pop(0))
    driver: Any = SimpleNamespace(
        news=lambda: ["done"],
        status=lambda: "123456789",
        press=lambda key: did.append(key) or key != "x",
        follow=lambda reading: did.append(reading) or True,
    )
    pad: Any = SimpleNamespace(read=lambda: readings.pop(0)) if has_pad else None
    teleop._drive(driver, pad)
    assert did == ([PadReading((0.0,)), "4", "w", " ", "x"] if has_pad else ["4", "w", "x"])
    said = capsys.readouterr().out
    assert said.count("done\n") == 3
    assert ("1234567" in said, "12345678" in said) == (True, False)
    assert ("the gamepad is gone" in said) is has_pad


def test_a_gamepad_may_end_the_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(teleop, "_pressed", lambda: "")
    driver: Any = SimpleNamespace(news=list, status=lambda: "", follow=lambda _: False)
    pad: Any = SimpleNamespace(read=lambda: PadReading((0.0,)))
    teleop._drive(driver, pad)
