"""Ask for what cannot be done: a call then returns False, and last_outcome says why.

Nothing is True on hope. Here a strong push makes the robot fall; recover() gets it up again.
"""

import logging
from pathlib import Path

import numpy as np

from controller import GO2Controller
from go2_wbc.errors import ModeError
from go2_wbc.plant import MujocoPlant

log = Path("out/examples/honest_outcomes.log")
log.parent.mkdir(parents=True, exist_ok=True)
logging.basicConfig(filename=log, filemode="w")  # what the library says beside the outcomes

plant = MujocoPlant()
with GO2Controller(plant=plant) as go2:
    go2.stand()
    plant.push(np.array([0.0, 400.0, 0.0]), duration=0.3)  # 120 N s, far more than it can take
    fell = not go2.high_five()
    outcome = go2.last_outcome
    print(f"high five: {outcome.ok}, after {outcome.duration:.2f} s: {outcome.reason}")
    print("mode:", go2.mode.value)
    try:
        go2.stand()
        refused = False
    except ModeError as error:
        refused = True
        print("stand() is refused:", error)
    recovered = go2.recover()
    print(f"recovered: {recovered} ({go2.last_outcome.reason}), mode {go2.mode.value}")

if not (fell and refused and recovered):
    raise SystemExit("an outcome was not what was measured")
