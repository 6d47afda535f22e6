"""Export a motion as joint angles, speeds and torques for another program or a robot.

The check works out the whole trajectory; here it is written as CSV in the motor order of Unitree
(FR FL RR RL), 100 rows a second. `go2-wbc export wave --out wave.csv` writes one in our own order.
"""

import csv
from pathlib import Path

import numpy as np

from go2_wbc.legs import JOINT_NAMES
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, load_motion

UNITREE = np.r_[3:6, 0:3, 9:12, 6:9]  # from FL FR RL RR to FR FL RR RL

model = RobotModel()
checked = FeasibilityChecker(model).evaluate(load_motion("wave"))
checked.report.raise_if_infeasible()  # never export what the robot cannot do
q, dq = checked.path.q[:, 7:][:, UNITREE], checked.path.v[:, 6:][:, UNITREE]
tau = checked.forces.tau[:, UNITREE]

names = [JOINT_NAMES[i].removesuffix("_joint") for i in UNITREE]
header = ["time", *(f"{name}_{what}" for what in ("q", "dq", "tau") for name in names)]
file = Path("out/examples/wave.csv")
file.parent.mkdir(parents=True, exist_ok=True)
with file.open("w", newline="", encoding="utf-8") as stream:
    writer = csv.writer(stream)
    writer.writerow(header)
    writer.writerows(np.column_stack([checked.path.times, q, dq, tau]).round(5))

limits = model.torque_limits[UNITREE]
torque, speed = np.abs(tau / limits).max(), np.abs(dq / model.speed_limits[UNITREE]).max()
print(f"wrote {file}: {len(q)} rows of {len(header)} columns, {checked.path.times[-1]:.1f} s")
print(f"largest torque {torque:.0%} and speed {speed:.0%} of the limits; first motor {names[0]}")
if max(torque, speed) >= 1.0:
    raise SystemExit("the trajectory breaks a limit")
