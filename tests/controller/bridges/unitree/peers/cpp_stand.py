"""Peer: the C++ SDK (wheel ``far-unitree-sdk``) reads the robot and stands it up by joint servos.

Runs in an environment of its own, without this project. Prints one JSON line.
"""

import importlib
import json
import sys
import time

unitree = importlib.import_module("unitree_interface")

LYING = [0.0, 1.36, -2.65] * 4
STANDING = [0.0, 0.67, -1.3] * 4
RISE, HOLD, PERIOD, LIMIT = 2.0, 1.0, 0.002, 30.0
SAG = 0.18  # rad; joint servos of 60 N m/rad sag by about 0.12 under the robot's weight


def main() -> None:
    """Rise over two seconds, hold for one or until the joints are there, then go limp."""
    robot = unitree.UnitreeInterface.create_go2(sys.argv[1])
    deadline = time.monotonic() + 60.0
    while robot.read_low_state().imu.accel[2] < 1.0 and time.monotonic() < deadline:
        time.sleep(0.01)
    first = robot.read_low_state()
    start = list(first.motor.q)
    command = unitree.MotorCommand(12)
    command.kp, command.kd = [60.0] * 12, [5.0] * 12
    command.dq_target, command.tau_ff = [0.0] * 12, [0.0] * 12
    began, sent, error = time.monotonic(), 0, 9.9
    while (now := time.monotonic() - began) < RISE + HOLD or (error > SAG and now < LIMIT):
        share = min(1.0, now / RISE)
        command.q_target = [a + share * (b - a) for a, b in zip(start, STANDING, strict=True)]
        robot.write_low_command(command)
        sent += 1
        time.sleep(PERIOD)
        last = robot.read_low_state()
        error = max(abs(a - b) for a, b in zip(last.motor.q, STANDING, strict=True))
    print(
        json.dumps(
            {"start": start, "accelerometer": first.imu.accel[2], "error": error, "sent": sent}
        ),
        flush=True,
    )


main()
