"""Command a velocity and read the measured state while the robot walks.

move() returns at once; wait() lets robot time pass. The state holds the base pose q[:7] (position,
quaternion x y z w), the joint angles q[7:], and velocities in the base frame v.
"""

import numpy as np

from controller import GO2Controller

with GO2Controller() as go2:
    go2.walk()
    go2.move(linear_x=0.4, angular_z=0.3)
    go2.wait(1.5)  # the robot gets up to speed
    speeds, rates = [], []
    for _ in range(200):
        go2.wait(0.01)
        speeds.append(go2.state.v[0])
        rates.append(go2.state.v[5])
    state = go2.state
    print(f"speed: {np.mean(speeds):.3f} m/s on the average (asked: 0.400)")
    print(f"turning: {np.mean(rates):.3f} rad/s on the average (asked: 0.300)")
    print(
        "feet on the ground now:",
        state.feet_in_contact,
        "with forces",
        state.foot_forces.round(),
        "N",
    )
    print("joints of the front left leg:", state.joint_positions[:3].round(2), "rad")
    go2.stop()

if abs(np.mean(speeds) - 0.4) > 0.04 or abs(np.mean(rates) - 0.3) > 0.05:
    raise SystemExit("the robot did not do what was asked")
