"""Peer: Unitree's stock ``SportClient`` runs a script; prints one JSON line per call.

Runs in an environment of its own with ``unitree-sdk2py-dimos`` and CycloneDDS 11, without this
project. CycloneDDS 11 announces the SDK's octets as another type than the robot's CycloneDDS 0.10
does; they are turned back here, so that the stock client meets types as on the robot.
"""

import json
import sys
import time

from cyclonedds.idl import types

uint8, types.uint8 = types.uint8, types.byte
from unitree_sdk2py.core.channel import ChannelFactoryInitialize, ChannelSubscriber  # noqa: E402
from unitree_sdk2py.go2.sport.sport_client import SportClient  # noqa: E402
from unitree_sdk2py.idl.unitree_go.msg.dds_ import SportModeState_  # noqa: E402

types.uint8 = uint8
state = None


def listen(message):
    global state
    state = message


def report(name, code):
    time.sleep(0.2)
    deadline = time.monotonic() + 60.0
    while state.progress and time.monotonic() < deadline:
        time.sleep(0.05)
    values = {
        "call": name,
        "code": code,
        "mode": state.mode,
        "position": list(state.position),
        "rpy": list(state.imu_state.rpy),
    }
    print(json.dumps(values), flush=True)


ChannelFactoryInitialize(int(sys.argv[1]), "lo")
subscriber = ChannelSubscriber("rt/sportmodestate", SportModeState_)
subscriber.Init(listen, 1)
client = SportClient()
client.SetTimeout(float(sys.argv[2]))
client.Init()
deadline = time.monotonic() + 10.0
while (state is None or client.GetServerApiVersion()[0]) and time.monotonic() < deadline:
    time.sleep(0.2)
report("StandUp", client.StandUp())
report("BalanceStand", client.BalanceStand())
end = time.monotonic() + 3.0
codes = []
while time.monotonic() < end:
    codes.append(client.Move(0.5, 0.0, 0.0))
    time.sleep(0.05)
report("Move", max(codes))
report("StopMove", client.StopMove())
time.sleep(1.0)
report("Hello", client.Hello())
report("Euler", client.Euler(0.1, 0.15, 0.1))
report("FrontFlip", client.FrontFlip())
report("StandDown", client.StandDown())
