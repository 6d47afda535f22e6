"""A gait of your own: a period, a share of it on the ground, and four phases.

The gains were tuned for the trot and need not carry over: measure, as this script does.
"""

import numpy as np

from controller import GO2Controller
from go2_wbc.contacts import GAITS, Gait

# offsets: the phase at which FL, FR, RL and RR touch down; diagonal legs together are a trot
QUICK = Gait("quick trot", period=0.28, duty=0.5, offsets=(0.5, 0.0, 0.0, 0.5))
GROUNDED = Gait("grounded trot", period=0.40, duty=0.6, offsets=(0.5, 0.0, 0.0, 0.5))

worst = 0.0
for gait in (GAITS["trot"], QUICK, GROUNDED):
    with GO2Controller() as go2:
        go2.walk(gait)
        go2.move(linear_x=0.5)
        go2.wait(4.0)
        run = go2.recording(rate=200.0)
        peak = go2.telemetry.peak_speed_ratio
    walking = run.time > run.time[-1] - 3.0
    speed = np.mean(run.v[walking, 0])
    on_ground = run.stance[walking].mean()
    steps = np.sum(run.stance[walking][1:, 0] & ~run.stance[walking][:-1, 0]) / 3.0
    worst = max(worst, abs(speed - 0.5))
    print(f"{gait.name:14} {speed:.3f} m/s, {steps:.1f} steps/s of a foot,", end=" ")
    print(f"{on_ground:.0%} of the time on the ground, peak joint speed {peak:.0%}")

if worst > 0.05:
    raise SystemExit(f"a gait is {worst:.2f} m/s off the 0.5 m/s that were asked")
