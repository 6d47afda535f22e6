"""A simulated robot whose state is watched, and what is thrown at it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

import numpy as np

from controller.bridges.unitree.low_level import low_cmd_message
from controller.bridges.unitree.messages import encode_message
from controller.bridges.unitree.sport_api import SWITCHER_SERVICE, Api, Code, SwitcherApi
from go2_wbc.robot.state import JointCommand
from tests.controller.bridges.processes import Process, wait_until
from tests.controller.bridges.unitree_processes import (
    LIMIT,
    Scene,
    client_of,
    own_domain,
    simulator,
    tilt_of,
)

FLOOD: Final = 5000.0  #: Samples per second
UPRIGHT: Final = 0.35  #: Tilt [rad] below which a robot that stands or lies is upright
STANDS, LIES = 0.25, 0.13
"""Height [m] of the base above which the robot stands, below which it lies."""
DAMPED: Final = encode_message(low_cmd_message(JointCommand.damping(3.0)))  #: A good ``rt/lowcmd``


def garbage() -> list[bytes]:
    """``rt/lowcmd`` that must move nothing: not finite, out of limits, damaged."""
    command = JointCommand.servo(np.zeros(12), np.zeros(12), 400.0, 1.0)
    damaged = low_cmd_message(JointCommand.torque(np.full(12, 20.0)))
    damaged["crc"] ^= 1
    return [
        encode_message(low_cmd_message(replace(command, tau=np.full(12, np.nan)))),
        encode_message(low_cmd_message(replace(command, q_des=np.full(12, 9.0)))),
        encode_message(damaged),
    ]


class WatchedScene(Scene):
    """A scene of which tests require something."""

    def stand_up(self) -> None:
        """Make the robot stand."""
        self.require_code(Api.RECOVERY_STAND)
        self.wait_for_rest()
        self.require_standing()

    def take_back(self) -> None:
        """Give the robot back to the sport service after low-level control."""
        switcher = client_of(self.bus, SWITCHER_SERVICE)
        code = switcher.call(SwitcherApi.SELECT_MODE, '{"name": "normal"}').code
        assert code == Code.OK, f"SelectMode was answered {code}"
        self.require_said("low-level control has ended")

    def flood(self, samples: list[bytes], seconds: float) -> None:
        """Write ``rt/lowcmd`` samples in turn, 5000 a second."""
        commands = self.bus.writer("rt/lowcmd")
        flood(lambda count: commands.write(samples[count % len(samples)]), seconds)

    def require_code(self, api: Api, code: Code = Code.OK) -> None:
        """Make sure that a call of the sport service is answered with ``code``."""
        answered = self.call(api)
        assert answered == code, f"{api.name} was answered {answered}"

    def require_standing(self) -> None:
        """Make sure that the robot stands."""
        height, tilt = self.height, tilt_of(self.now())
        stands = height > STANDS and tilt < UPRIGHT
        assert stands, f"the robot does not stand: {height:.2f} m, {np.degrees(tilt):.0f} deg"

    def require_lying(self) -> None:
        """Make sure that the robot comes to lie on its belly."""
        assert wait_until(lambda: self.height < LIES, LIMIT), "the robot is not limp"
        tilt = tilt_of(self.now())
        assert tilt < UPRIGHT, f"the robot lies tilted by {np.degrees(tilt):.0f} deg"

    def require_said(self, *texts: str) -> None:
        """Make sure that the simulator reports these."""
        for text in texts:
            is_said = wait_until(lambda text=text: text in self.process.text, LIMIT)
            assert is_said, f"the simulator did not say {text!r}"

    def require_walking(self, peer: Process) -> None:
        """Make sure that ``peer`` gets the robot to walk."""
        walks = wait_until(lambda: self.speed > 0.4 or peer.code is not None, LIMIT)
        assert walks, "the robot does not walk"
        assert peer.code is None, f"the robot does not walk: {peer.text}"


@contextmanager
def watched(*options: str) -> Iterator[WatchedScene]:
    """A simulator with these options, and what is needed to watch it."""
    with own_domain() as domain, simulator(domain, *options) as process:
        yield WatchedScene(process, domain)


def flood(write: Callable[[int], None], seconds: float) -> None:
    """Call ``write`` with 0, 1, ..., 5000 times a second."""
    start, count = time.monotonic(), 0
    while (now := time.monotonic() - start) < seconds:
        while count < now * FLOOD:
            write(count)
            count += 1
        time.sleep(0.0005)
