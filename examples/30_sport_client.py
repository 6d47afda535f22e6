"""Drive the robot as Unitree's SportClient does: remote calls over DDS, on the loopback.

Needs the extra [unitree]. The script starts the simulated robot (`go2-wbc unitree-sim`) by itself;
Unitree's own SDK can make the same calls, see docs/unitree.md.
"""

import json
import subprocess
import sys
import time

try:
    from controller.bridges.unitree.bus import Bus
    from controller.bridges.unitree.rpc import Client
    from controller.bridges.unitree.sport_api import Api
except ImportError as error:
    print(f'this example needs CycloneDDS ({error}): python -m pip install -e ".[unitree]"')
    raise SystemExit(0) from None

DOMAIN = 77

command = [sys.executable, "-m", "controller.cli.main", "unitree-sim", "--domain", str(DOMAIN)]
simulator = subprocess.Popen(command, stdout=sys.stderr)  # what is printed here is ours
try:
    sport = Client(Bus(DOMAIN, "lo"), "sport")
    if not sport.wait_for_server(60.0):
        raise SystemExit("no robot on the domain")
    print("version:", sport.ask(Api.VERSION).data)
    codes = {}
    for api in (Api.STAND_UP, Api.BALANCE_STAND):
        codes[api.name] = sport.call(api, timeout=5.0).code
        time.sleep(3.0)  # an answer after 0.8 s means: it has begun
    for _ in range(4):  # a Move counts for one second and has no answer
        sport.send(Api.MOVE, json.dumps({"x": 0.3, "y": 0.0, "z": 0.0}))
        time.sleep(0.5)
    for api in (Api.STOP_MOVE, Api.HELLO):
        codes[api.name] = sport.call(api, timeout=5.0).code
    print("answers:", codes, "(0: done, or begun)")
finally:
    simulator.terminate()
    simulator.wait(20.0)
if any(codes.values()):
    raise SystemExit("a call was refused")
