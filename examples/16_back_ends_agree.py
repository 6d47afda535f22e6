"""Solve the same ticks with three back ends of the whole-body controller: they agree.

"condensed" eliminates the equations of motion by hand, "full" leaves them to the solver, and
"placo" formulates the whole problem anew, in another library.
"""

import numpy as np

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.controller import WholeBodyController
from motions import FeasibilityChecker, load_motion

model = RobotModel()
checked = FeasibilityChecker(model).evaluate(load_motion("wave", times=1))
path = checked.path
controllers = {name: WholeBodyController(model, name) for name in ("condensed", "full", "placo")}

torques: dict[str, list[np.ndarray]] = {name: [] for name in controllers}
times: dict[str, list[float]] = {name: [] for name in controllers}
for row in range(0, len(path.times), 10):
    stance, t = path.stance[row], float(path.times[row])
    state = RobotState(t, path.q[row], path.v[row], np.zeros(12), np.zeros(4), stance)
    snapshot, reference = model.snapshot(state), checked.plan.at(t)
    for name, wbc in controllers.items():
        solution = wbc.solve(snapshot, reference)
        torques[name].append(solution.tau)
        times[name].append(solution.solve_time)

print(f"{len(torques['full'])} instants of 'wave', on four and on three feet")
worst = 0.0
for name in controllers:
    off = np.abs(np.array(torques[name]) - np.array(torques["full"])).max()
    worst = max(worst, off)
    tick = 1e6 * np.median(times[name])
    print(f"{name:9} {tick:5.0f} us a tick, torques within {off:.1e} N m of 'full'")

if worst > 1e-3:
    raise SystemExit(f"the back ends differ by {worst:.1e} N m")
