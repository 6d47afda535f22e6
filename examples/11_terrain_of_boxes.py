"""Walk over boxes that the robot cannot see: the gait is the same, only the feet land higher.

Boxes(height=...) strews boxes over the floor, from a seed; nothing tells the controller of them.
"""

import math

import numpy as np

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import Boxes

terrain = Boxes(height=0.04, count=300, seed=3)
print(f"{len(terrain.layout())} boxes, up to {100 * terrain.layout()[:, 3].max():.1f} cm high")
with GO2Controller(plant=MujocoPlant(terrain=terrain)) as go2:
    go2.stand()
    go2.walk()
    go2.move(linear_x=0.4)
    heights, tilts = [], []
    for _ in range(60):
        go2.wait(0.1)
        heights.append(go2.state.p_world_base[2])
        tilts.append(math.degrees(go2.state.tilt))
    x, y, _ = go2.state.p_world_base
    print(f"walked to x = {x:.2f} m, y = {y:+.2f} m in 6 s")
    print(f"height of the base {min(heights):.3f} to {max(heights):.3f} m")
    print(f"tilt {np.mean(tilts):.1f} deg on the average, {max(tilts):.1f} at most")
    walks = go2.mode.value == "walking" and x > 1.8

if not walks:
    raise SystemExit(f"the robot did not get over the boxes: {go2.last_outcome.reason}")
