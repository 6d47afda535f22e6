"""Push the walking robot from the side and watch it catch itself by steps.

push() lets a force in the world frame act from now on; the controller knows nothing of it.
"""

import math

import numpy as np

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant

FORCE, DURATION = 120.0, 0.1  # N, s: 12 N s

plant = MujocoPlant()
with GO2Controller(plant=plant) as go2:
    go2.walk()
    go2.move(linear_x=0.4)
    go2.wait(2.0)
    before = go2.state.p_world_base.copy()
    plant.push(np.array([0.0, FORCE, 0.0]), DURATION)
    print(f"pushed to the left with {FORCE * DURATION:.0f} N s at 0.4 m/s")
    tilts = []
    for step in range(20):
        go2.wait(0.1)
        tilts.append(math.degrees(go2.state.tilt))
        if step % 4 == 0:
            vy = go2.state.v[1]
            print(f"  {0.1 * (step + 1):.1f} s: sideways {vy:+.2f} m/s, tilt {tilts[-1]:.1f} deg")
    aside = go2.state.p_world_base[1] - before[1]
    print(f"largest tilt {max(tilts):.1f} deg, {aside:+.2f} m aside, still {go2.mode.value}")
    walks_on = go2.mode.value == "walking" and abs(go2.state.v[0] - 0.4) < 0.15

if not walks_on:
    raise SystemExit(f"the robot did not walk on: {go2.last_outcome.reason}")
