"""Give the controller noisy measurements and compare with the simulator's truth.

sensors="noisy" adds white noise to everything that is measured; noise= sets how much. What the
robot really did is in plant.data, MuJoCo's own state.
"""

import numpy as np

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.sensors import SensorNoise

HARSH = SensorNoise(orientation=0.01, gyro=0.05, joint_velocity=0.15)

worst = 0.0
for name, noise in (("ideal", None), ("noisy", SensorNoise()), ("harsh", HARSH)):
    sensors = "ideal" if noise is None else "noisy"
    plant = MujocoPlant(sensors=sensors, noise=noise, seed=1)
    with GO2Controller(plant=plant) as go2:
        done = go2.stand() and go2.walk()
        go2.move(linear_x=0.5)
        go2.wait(1.0)
        start, errors = plant.data.qpos[0], []
        for _ in range(200):
            go2.wait(0.01)
            errors.append(go2.state.v[5] - plant.data.qvel[5])
        speed = (plant.data.qpos[0] - start) / 2.0
    spread = np.std(errors)
    worst = max(worst, abs(speed - 0.5) if done else np.inf)
    print(f"{name}: true speed {speed:.3f} m/s, asked 0.500; gyro noise {spread:.3f} rad/s")

if worst > 0.05:
    raise SystemExit(f"the true speed is {worst:.2f} m/s off")
