"""Peer: the C++ SDK plays the robot; it publishes states and says what was commanded.

It checks the checksums of what it hears, and complains on its output. Runs in an environment of
its own, without this project. Prints one JSON line.
"""

import importlib
import json
import sys
import time

unitree = importlib.import_module("unitree_interface")
PERIOD = 0.002


def main() -> None:
    """Publish at 500 Hz for some seconds, then tell the newest command."""
    robot = unitree.UnitreeInterface.create_go2(sys.argv[1])
    state = unitree.LowState(12)
    state.motor.q = [0.1 * joint for joint in range(12)]
    deadline = time.monotonic() + float(sys.argv[2])
    while time.monotonic() < deadline:
        state.tick += 2
        robot.publish_low_state(state)
        time.sleep(PERIOD)
    print(json.dumps({"q_target": list(robot.read_incoming_command().q_target)}), flush=True)


main()
