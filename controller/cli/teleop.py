"""``go2-wbc teleop``: drive the simulated robot with the keyboard or a gamepad."""

from __future__ import annotations

import os
import select
import shutil
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Annotated

from controller.cli.common import ExitCode, Mjcf, Numbers
from go2_wbc.errors import CommandError
from go2_wbc.world import SENSORS

if TYPE_CHECKING:
    from controller.teleop import Gamepad, Teleop

REFRESH = 0.1  #: Time [s] between two looks at the keyboard and the robot
_CLEAR_LINE = "\r\x1b[2K"


def run(
    *,
    viewer: Annotated[bool, "also open MuJoCo's window"] = False,
    keyboard: Annotated[bool, "look for no gamepad"] = False,
    sensors: Annotated[str, SENSORS, "what its state comes from"] = "ideal",
    mjcf: Mjcf = None,
    config: Numbers = None,
) -> int:
    """Drive the robot in MuJoCo with keyboard or gamepad, at the wall clock's pace.

    The last key, or Ctrl-C, ends it; the robot ends limp.

    Examples:
        go2-wbc teleop                 headless: a line tells what the robot does
        go2-wbc teleop --viewer        watch it in MuJoCo's window
        go2-wbc teleop --sensors imu   drive it on what a robot's own sensors tell
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise CommandError("teleop reads keys from a terminal; standard input or output is none")
    from controller.arguments import config as read_config
    from controller.go2_controller import GO2Controller
    from controller.teleop import LEGEND, Teleop, find_gamepad, keys_help
    from go2_wbc.plant import MujocoPlant

    pad, said = (None, "keys only") if keyboard else find_gamepad()
    print(keys_help(), said, *([] if pad is None else [LEGEND]), sep="\n")
    numbers = read_config(config).beside_hardware
    simulator = MujocoPlant(
        mjcf, robot=numbers.robot, motor=numbers.motor, sensors=sensors, estimator=numbers.estimator
    )
    with (
        closing(simulator) as plant,
        GO2Controller(plant=plant, realtime=True, viewer=viewer, config=numbers) as go2,
    ):
        teleop = Teleop(go2)
        try:
            with _single_keys():
                _drive(teleop, pad)
        except KeyboardInterrupt:
            pass
        finally:
            print()
            teleop.close()
            if pad is not None:
                pad.close()
    return ExitCode.OK


def _drive(teleop: Teleop, pad: Gamepad | None) -> None:
    goes_on = True
    while goes_on:
        width = shutil.get_terminal_size().columns - 1
        news = "".join(f"{_CLEAR_LINE}{line}\n" for line in teleop.news())
        sys.stdout.write(news + _CLEAR_LINE + teleop.status()[:width])
        sys.stdout.flush()
        for key in _pressed():
            goes_on = goes_on and teleop.press(key)
        if pad is not None:
            reading = pad.read()
            if reading is None:
                teleop.press(" ")
                print(f"{_CLEAR_LINE}the gamepad is gone: the robot stops; go on with keys")
                pad = None
            else:
                goes_on = teleop.follow(reading) and goes_on


def _pressed() -> str:
    """Keys that came within the next moment; the end of the input counts as the last key."""
    from controller.teleop import QUIT

    ready, _, _ = select.select([sys.stdin], [], [], REFRESH)
    if not ready:
        return ""
    return os.read(sys.stdin.fileno(), 64).decode(errors="ignore") or QUIT


@contextmanager
def _single_keys() -> Iterator[None]:
    """Keys come at once and unseen; the terminal is left as it was found."""
    import termios
    import tty

    handle = sys.stdin.fileno()
    before = termios.tcgetattr(handle)
    try:
        tty.setcbreak(handle)
        yield
    finally:
        termios.tcsetattr(handle, termios.TCSADRAIN, before)
