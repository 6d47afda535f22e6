"""Peer: Unitree's stock ``SportClient`` runs a script; prints one JSON line per call.

Runs in an environment of its own with ``unitree-sdk2py-dimos``, without this project. On CycloneDDS
0.10, which the robot speaks, the SDK is as it is. CycloneDDS 11 announces its octets as another
type; they are turned back there, so that the stock client meets types as on the robot.
"""

import importlib
import importlib.metadata
import json
import os
import sys
import time
from typing import Any

kinds: Any = importlib.import_module("cyclonedds.idl.types")
uint8 = kinds.uint8
IS_OF_THE_ROBOT = importlib.metadata.version("cyclonedds").startswith("0.10.")
if not IS_OF_THE_ROBOT:
    kinds.uint8 = kinds.byte
channel = importlib.import_module("unitree_sdk2py.core.channel")
sport = importlib.import_module("unitree_sdk2py.go2.sport.sport_client")
messages = importlib.import_module("unitree_sdk2py.idl.unitree_go.msg.dds_")
kinds.uint8 = uint8
states: list[Any] = []


def report(name: str, code: int) -> None:
    """Wait until the robot rests, then say what came of a call."""
    time.sleep(0.2)
    deadline = time.monotonic() + 60.0
    while states[-1].progress and time.monotonic() < deadline:
        time.sleep(0.05)
    state = states[-1]
    values = {
        "call": name,
        "code": code,
        "mode": state.mode,
        "position": list(state.position),
        "rpy": list(state.imu_state.rpy),
    }
    print(json.dumps(values), flush=True)


def robot_time() -> float:
    """The robot's own time [s]."""
    return states[-1].stamp.sec + 1e-9 * states[-1].stamp.nanosec


def main() -> None:
    """Find the robot, then run the script."""
    channel.ChannelFactoryInitialize(int(sys.argv[1]), "lo")
    subscriber = channel.ChannelSubscriber("rt/sportmodestate", messages.SportModeState_)
    subscriber.Init(states.append, 1)
    client = sport.SportClient()
    client.SetTimeout(float(sys.argv[2]))
    client.Init()
    deadline = time.monotonic() + 60.0
    while not states or client.GetServerApiVersion()[0]:
        if time.monotonic() > deadline:
            sys.exit("the robot was not found")
        time.sleep(0.2)
    deadline += 60.0
    report("StandUp", client.StandUp())
    report("BalanceStand", client.BalanceStand())
    codes, end = [], robot_time() + 3.0
    while robot_time() < end and time.monotonic() < deadline:
        codes.append(client.Move(0.5, 0.0, 0.0))
        time.sleep(0.05)
    report("Move", max(codes))
    report("StopMove", client.StopMove())
    time.sleep(1.0)
    report("Hello", client.Hello())
    report("Content", client.Content())
    report("Euler", client.Euler(0.1, 0.15, 0.1))
    report("FrontFlip", client.FrontFlip())
    report("StandDown", client.StandDown())
    # All is answered. Python's binding of CycloneDDS 0.10.2 crashes now and then while Python ends,
    # seen once in about 40 runs on 3.12 and once on 3.11: leave without that end.
    if IS_OF_THE_ROBOT:
        os._exit(0)


main()
