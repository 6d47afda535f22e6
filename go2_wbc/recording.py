"""A recorded run: what was measured and asked at each sample, as arrays.

The loop's telemetry fills it, the viewers replay it, the benchmarks measure it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True, slots=True)
class Recording:
    """Samples of one run, all of the same length n.

    Attributes:
        time: (n,) plant time [s], increasing.
        q: (n, 19) measured configuration (base position, quaternion x y z w, joints).
        v: (n, 18) measured velocity (base frame).
        tau: (n, 12) applied joint torques [N m].
        foot_forces: (n, 4) measured normal foot forces [N].
        stance: (n, 4) feet that the controller planned to be in contact.
        p_world_com: (n, 3) centre of mass [m].
        support_margin: (n,) distance [m] of the CoM's ground projection to the edge of the
            support polygon of the planned stance feet, positive inside; nan with fewer than three.
        labels: what the robot was doing at each sample ("stand", "walk", ...), length n.
    """

    time: Float[np.ndarray, " n"]
    q: Float[np.ndarray, "n 19"]
    v: Float[np.ndarray, "n 18"]
    tau: Float[np.ndarray, "n 12"]
    foot_forces: Float[np.ndarray, "n 4"]
    stance: Bool[np.ndarray, "n 4"]
    p_world_com: Float[np.ndarray, "n 3"]
    support_margin: Float[np.ndarray, " n"]
    labels: tuple[str, ...]

    @property
    def duration(self) -> float:
        """Seconds between the first and the last sample."""
        return float(self.time[-1] - self.time[0]) if len(self.time) else 0.0
