"""Walk with a task of your own in the whole-body QP: a trunk that carries a camera nods less.

GO2Controller(extra_tasks=[...]) takes tasks beside the built-in ones, whatever the robot does.
"""

from dataclasses import dataclass

import numpy as np

from controller import GO2Controller
from go2_wbc import Reference, Snapshot, Task
from go2_wbc.wbc.problem import SIZE, Rows


@dataclass(frozen=True, slots=True)
class SteadyTrunk(Task):
    """Slow rolling and pitching of the trunk down at ``rate`` [1/s]."""

    rate: float = 50.0
    weight: float = 30.0
    name: str = "steady trunk"
    unit: str = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Two rows: the angular acceleration about the trunk's first two axes."""
        return Rows(np.eye(2, SIZE, 3), -self.rate * snapshot.v[3:5])


def pitching(tasks: list[Task]) -> float:
    """How fast the trunk pitches at a trot, root mean square [rad/s]."""
    with GO2Controller(extra_tasks=tasks) as go2:
        go2.stand()
        go2.walk("trot")
        go2.move(0.6)
        go2.wait(5.0)
        run = go2.recording()
        walking = run.time > run.time[-1] - 4.0
        print(f"{len(tasks)} tasks of my own: {go2.state.q[0]:.1f} m ahead", end=", ")
        return float(np.sqrt(np.mean(run.v[walking, 4] ** 2)))


usual = pitching([])
print(f"the trunk pitches at {usual:.3f} rad/s")
steady = pitching([SteadyTrunk()])
print(f"the trunk pitches at {steady:.3f} rad/s, {100 * steady / usual:.0f}%")

if not steady < 0.6 * usual:
    raise SystemExit("the trunk is not steadier")
