"""Ask why the robot does no better: which limit is in its way, and what more of it would give.

go2.explain() answers for the last tick; with go2.telemetry.explains the recording keeps the limits
of all ticks. The second half weakens a motor and gives it back what it is told to lack.
"""

from dataclasses import replace

import numpy as np

from controller import GO2Controller
from go2_wbc import Explanation, MujocoPlant, RobotModel, WholeBodyController
from go2_wbc.reference import Anchor
from motions import Timeline, compile_timeline

plant, said = MujocoPlant(), list[Explanation]()
with GO2Controller(plant=plant) as go2:
    go2.stand()
    print("standing:", go2.explain())
    snapshot = RobotModel().snapshot(go2.state)
    go2.telemetry.explains = True
    go2.walk()
    go2.move(0.8)
    plant.push(np.array([0.0, 250.0, 0.0]), 0.1)
    for _ in range(100):
        go2.wait(0.01)
        said.append(go2.explain())
    run = go2.recording()
worst = max(said, key=lambda one: max((limit.cost for limit in one.binding), default=0.0))
print(f"pushed: {worst}\n{worst.table()}")
times = dict.fromkeys((span.label for span in run.binding()), 0.0)
for span in run.binding():
    times[span.label] += span.end - span.start
longest = sorted(times, key=lambda name: -times[name])[:3]
print("longest in the way:", ", ".join(f"{name} {times[name]:.2f} s" for name in longest))


def rising(peak: float, least: float) -> Explanation:
    """Of a robot whose calf RL gives ``peak`` [N m], with a least force [N] of each foot."""
    model = RobotModel()
    model.motor = model.motor.with_peak(np.where(np.arange(12) == 8, peak, model.motor.peak))
    up = compile_timeline(Timeline().body(z=0.06, over=0.5), model).at(0.12)
    reference = up.placed(Anchor.of_feet(snapshot.p_world_feet, model.foot_radius))
    asked = replace(reference, normal_force_min=np.full(4, least))
    return WholeBodyController(model).explain(snapshot, asked)


weak = rising(peak=2.5, least=35.0)
print("\na weak calf:", weak)
limit = weak.binding[0]
saved = weak.cost - rising(peak=2.5 + 0.01, least=35.0).cost
print(f"0.01 N m more saves {saved:.5f}, as told {0.01 * limit.multiplier:.5f}")
torn = rising(peak=1.0, least=150.0)
print("\nweaker, and told to press harder:", torn.table(), sep="\n")

as_told = limit.multiplier > 0 and abs(saved / (0.01 * limit.multiplier) - 1.0) < 0.05
if not (as_told and torn.contradiction and torn.first == "torque limit of RL_calf"):
    raise SystemExit("an explanation does not bear out")
