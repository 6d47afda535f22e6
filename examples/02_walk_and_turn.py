"""Walk a square: move_forward() and turn_left() end when the measured pose says so.

Both are closed on odometry: metres and radians, not seconds of some speed.
"""

import math

from controller import GO2Controller

SIDE = 0.5  # m

with GO2Controller() as go2:
    go2.stand()
    start = go2.state.p_world_base.copy()
    done = []
    for corner in range(1, 5):
        done += [go2.move_forward(SIDE), go2.turn_left(math.pi / 2)]
        x, y, _ = go2.state.p_world_base - start
        heading = math.degrees(go2.state.yaw)
        print(f"corner {corner}: x {x:+.2f} m, y {y:+.2f} m, heading {heading:+.0f} deg")
    gap = math.dist(start[:2], go2.state.p_world_base[:2])
    print(f"back at the start to within {1000 * gap:.0f} mm")

if not all(done) or gap > 0.15:
    raise SystemExit("the square does not close")
