"""A motion of your own: a Timeline is read from left to right and played on the robot.

Places are offsets from standing [m, rad]: x ahead, y left, z up; pitch above 0 lowers the nose.
"""

import math

import numpy as np

from controller import GO2Controller
from motions import Timeline, deg

greet = (
    Timeline(name="greet")
    .body(pitch=deg(15), z=-0.04, over=0.8)  # bow
    .hold(0.3)
    .home(over=0.8)
    .foot("FR", z=0.06, over=0.4)  # the trunk moves over the other three feet by itself
    .down("FR", over=0.3)
    .home(over=0.8)
)

with GO2Controller() as go2:
    go2.stand()
    done = go2.play(greet)
    run = go2.recording()

rows = [row for row, label in enumerate(run.labels) if label == "greet"]
x, y, z, w = run.q[rows, 3:7].T
pitch = math.degrees(max(np.arcsin(2.0 * (w * y - z * x))))
print(f"played: {done}, {greet.end:.1f} s, {len(rows)} samples")
print(f"the nose went down by {pitch:.1f} deg (asked: 15.0)")
if not done or abs(pitch - 15.0) > 3.0:
    raise SystemExit("the motion was not done")
