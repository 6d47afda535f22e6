"""Climb stairs by sight: with a lidar the robot puts its feet beside the edges of each step.

MujocoPlant(lidar=True) scans the ground ahead; go2.terrain is what the robot has seen of it.
"""

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import Stairs

stairs = Stairs(height=0.16, count=3, depth=0.31, start=0.6)
with GO2Controller(plant=MujocoPlant(terrain=stairs, lidar=True, sensors="imu")) as go2:
    go2.stand()
    go2.walk()
    print("at first:", go2.terrain)
    go2.move(linear_x=0.3)
    go2.wait(8.5)
    go2.stop()
    print("at last:", go2.terrain)
    rise = go2.terrain.height(*go2.state.p_world_base[:2]) - go2.terrain.height(0.3, 0.0)
    print(f"climbed {100 * rise:.0f} cm in three steps of 16")
    climbs = go2.mode.value == "walking" and rise > 0.44

if not climbs:
    raise SystemExit(f"the robot did not climb: {go2.last_outcome.reason}")
