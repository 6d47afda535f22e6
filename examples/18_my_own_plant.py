"""A plant of your own: anything that can be read and commanded, here a robot with weak motors.

A plant needs control_period, read(), write() and close(); its clock is the controller's only clock.
"""

import logging
from dataclasses import replace
from pathlib import Path

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.robot.state import JointCommand, RobotState


class WeakMotors(Plant):
    """A simulated Go2 whose motors give ``share`` of the torque that they are told."""

    def __init__(self, share: float) -> None:
        self._inner, self._share = MujocoPlant(), share

    @property
    def control_period(self) -> float:
        """Seconds that pass in one write."""
        return self._inner.control_period

    def read(self) -> RobotState:
        """The measured state."""
        return self._inner.read()

    def write(self, command: JointCommand) -> None:
        """Apply the command, weakened."""
        self._inner.write(replace(command, tau=self._share * command.tau))

    def close(self) -> None:
        """Release the simulator."""
        self._inner.close()


log = Path("out/examples/my_own_plant.log")
log.parent.mkdir(parents=True, exist_ok=True)
logging.basicConfig(filename=log, filemode="w")  # failures are logged; here they are printed

stood = {}
for share in (1.0, 0.9, 0.8, 0.4):
    with GO2Controller(plant=WeakMotors(share)) as go2:
        stood[share] = go2.stand()
        height = go2.state.p_world_base[2]
        print(
            f"{share:4.0%} of the torque: stands {stood[share]!s:5} {height:.3f} m high;",
            go2.last_outcome.reason,
        )

if not stood[0.9] or stood[0.4]:
    raise SystemExit("the outcome of stand() is not what the motors can do")
