"""Peer: the C++ SDK plays the robot; it publishes states and says what was commanded.

It checks the checksums of what it hears, and complains on its output. Runs in an environment of
its own, without this project. Prints one JSON line.
"""

import importlib
import json
import signal
import sys
import time

unitree = importlib.import_module("unitree_interface")
LIMIT, PERIOD = 60.0, 0.002


def main() -> None:
    """Publish at 500 Hz until SIGTERM comes, then tell the newest command."""
    # No Event: set() in a handler waits for ever for the lock of a wait() that it broke into.
    ends: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _frame: ends.append(number))
    robot = unitree.UnitreeInterface.create_go2(sys.argv[1])
    state = unitree.LowState(12)
    state.motor.q = [0.1 * joint for joint in range(12)]
    while state.tick < 1000 * LIMIT and not ends:
        time.sleep(PERIOD)
        state.tick += 2
        robot.publish_low_state(state)
    print(json.dumps({"q_target": list(robot.read_incoming_command().q_target)}), flush=True)


main()
