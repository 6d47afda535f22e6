"""Let the robot live at the pace of the wall clock, so that time.sleep() works as on a robot.

With realtime=True a thread of its own runs the control loop; calls return when they are done, and
between two calls the robot goes on by itself. Add viewer=True where there is a display.
"""

import time

from controller import GO2Controller

with GO2Controller(realtime=True) as go2:
    go2.walk()
    go2.move(linear_x=0.3)
    wall, robot = time.monotonic(), go2.state.time
    x = go2.state.p_world_base[0]
    time.sleep(2.0)
    wall, robot = time.monotonic() - wall, go2.state.time - robot
    way = go2.state.p_world_base[0] - x
    go2.stop()
    print(f"{wall:.2f} s on the wall, {robot:.2f} s for the robot, which walked {way:.2f} m")
    if robot < 0.9 * wall:
        print("this machine is too slow for real time: the robot lives more slowly, and safely")

if not (0.0 < robot < 1.1 * wall and way > 0.15 * robot):
    raise SystemExit("the robot did not walk in its own time")
