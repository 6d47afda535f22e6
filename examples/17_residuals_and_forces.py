"""Read what the QP decided: forces, friction used, and the residual of every task and constraint.

The residuals are computed from the snapshot, not taken from the solver, so they audit any back end.
A problem without a solution raises QpInfeasible, with the same table.
"""

from dataclasses import replace

import numpy as np

from controller import GO2Controller
from go2_wbc.errors import QpInfeasible
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController
from motions import Timeline, compile_timeline

model = RobotModel()
with GO2Controller() as go2:
    go2.stand()
    snapshot = model.snapshot(go2.state)

lower = compile_timeline(Timeline().body(z=-0.05, over=1.0), model).at(0.25)
reference = lower.placed(Anchor.of_feet(snapshot.p_world_feet, model.foot_radius))
solution = WholeBodyController(model).solve(snapshot, reference)
for leg, (fx, fy, fz) in zip(("FL", "FR", "RL", "RR"), solution.forces, strict=True):
    print(
        f"{leg}: force {fx:6.1f} {fy:6.1f} {fz:6.1f} N, friction used {np.hypot(fx, fy) / fz:.2f}"
    )
lift, weight = solution.forces[:, 2].sum(), model.mass * model.gravity
print(f"all feet {lift:.1f} N, weight {weight:.1f} N: the trunk is let down")
for row in solution.residuals:
    print(f"  {row.name:24} {row.norm:.2e} {row.unit}")

try:
    weak = WholeBodyController(model, config=WbcConfig(torque_share=0.05))
    weak.solve(snapshot, replace(reference, normal_force_min=np.full(4, 60.0)))
    refused = False
except QpInfeasible as error:
    refused = True
    print("60 N on every foot with 5 % of the torque:", str(error).splitlines()[0])

physics = ("base dynamics", "stance feet", "contact forces", "torque limits", "joint limits")
broken = [row.name for row in solution.residuals if row.name in physics and row.norm > 1e-6]
if broken or not refused or lift >= weight:
    raise SystemExit("the residuals do not bear the solution out")
