"""Put a load on the robot and make the floor slippery: the controller is told neither.

payload fixes a box of that mass on the trunk; friction is the floor's sliding coefficient.
"""

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant

WORLDS = ((0.0, 0.8), (3.0, 0.8), (0.0, 0.4), (3.0, 0.4))  # kg, friction

print("payload  friction  stood  walked  height    speed      peak torque")
failed = []
for payload, friction in WORLDS:
    with GO2Controller(plant=MujocoPlant(payload=payload, friction=friction)) as go2:
        stood = go2.stand()
        height = go2.state.p_world_base[2]
        go2.walk()
        go2.move(linear_x=0.4)
        go2.wait(1.0)
        start = go2.state.p_world_base[0]
        go2.wait(2.0)
        speed = (go2.state.p_world_base[0] - start) / 2.0
        walked = go2.mode.value == "walking" and abs(speed - 0.4) < 0.05
        torque = go2.telemetry.peak_torque_ratio
    print(f"{payload:4.1f} kg  {friction:8.1f}  {stood!s:5}  {walked!s:6}", end="  ")
    print(f"{height:.3f} m  {speed:.3f} m/s  {torque:.0%} of its limit")
    failed += [] if stood and walked else [(payload, friction)]

if failed:
    raise SystemExit(f"not done with {failed}")
