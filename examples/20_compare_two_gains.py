"""Compare gains: how far does a push move the standing trunk, for several stiffnesses?

All numbers of the controller are frozen dataclasses; replace() makes a variant of them. A push that
gives a critically damped mass the speed v moves it by v / (e sqrt(kp)): that is the prediction.
"""

import math
from dataclasses import replace

import numpy as np

from controller import GO2Controller
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant
from go2_wbc.wbc.config import Gains

FORCE, DURATION = 60.0, 0.1  # N to the left, s


def yielding(stiffness: float) -> tuple[float, float]:
    """Farthest way of the trunk [m] with a sideways stiffness [1/s^2], and the prediction."""
    damping = 2.0 * math.sqrt(stiffness)  # critical
    gains = Gains(kp=(30.0, stiffness, 100.0), kd=(12.0, damping, 20.0))
    config = Config()
    config = replace(config, wbc=replace(config.wbc, body_position=gains))
    plant = MujocoPlant()
    with GO2Controller(plant=plant, config=config) as go2:
        go2.stand()
        start, way = go2.state.q[1], 0.0
        plant.push(np.array([0.0, FORCE, 0.0]), DURATION)
        for _ in range(100):
            go2.wait(0.01)
            way = max(way, go2.state.q[1] - start)
        speed = FORCE * DURATION / plant.total_mass
    return way, speed / (math.e * math.sqrt(stiffness))


print("kp [1/s^2]   measured   predicted")
ways, fits = [], []
for stiffness in (15.0, 30.0, 60.0, 120.0):
    way, predicted = yielding(stiffness)
    ways.append(way)
    fits.append(abs(way - predicted) < 0.3 * predicted)
    bar = "#" * round(1e3 * way)
    print(f"{stiffness:10.0f}   {1e3 * way:5.1f} mm    {1e3 * predicted:5.1f} mm  {bar}")

if ways != sorted(ways, reverse=True) or not all(fits):
    raise SystemExit("the trunk does not yield as predicted")
