"""Our own low level, writing ``rt/lowcmd`` and ``rt/lowstate`` and reading the peer's states.

    python own_low_level.py COUNT MASK

Ends when it has written and heard ``COUNT`` messages, or after a minute. ``MASK`` is XORed into the
checksums: 0 leaves them right. Prints one JSON line.
"""

import json
import sys
import time

import numpy as np

from controller.bridges.unitree import messages
from controller.bridges.unitree.bus import Bus
from controller.bridges.unitree.low_level import low_cmd_message
from controller.bridges.unitree.messages import decode_message, encode_message, is_intact, seal
from go2_wbc.robot.state import JointCommand

LIMIT, PERIOD = 60.0, 0.002
ANGLES = np.linspace(0.1, 1.2, 12)


def main() -> None:
    """Write both messages at 500 Hz, count the states that came."""
    wanted, mask = int(sys.argv[1]), int(sys.argv[2])
    bus = Bus(0, "lo")
    reader = bus.reader("rt/lowstate", depth=64)
    commands = bus.writer("rt/lowcmd")
    states = bus.writer("rt/lowstate")
    command = low_cmd_message(JointCommand.servo(ANGLES, np.zeros(12), 20.0, 1.0))
    state = np.zeros(1, messages.LOW_STATE)
    state["head"], state["foot_force"] = messages.HEAD, 77
    seal(state)
    for message in (command, state):
        message["crc"] ^= mask
    counts, written = {"intact": 0, "broken": 0}, 0
    deadline = time.monotonic() + LIMIT
    while min(written, sum(counts.values())) < wanted and time.monotonic() < deadline:
        written += 1
        commands.write(encode_message(command))
        states.write(encode_message(state))
        for data in reader.take():
            message = decode_message(messages.LOW_STATE, data)
            if message["foot_force"][0, 0] != 77:  # the peer's, not our own
                counts["intact" if is_intact(message) else "broken"] += 1
        time.sleep(PERIOD)
    print(json.dumps(counts), flush=True)


main()
