"""A recorded run: what was measured and asked at each sample, as arrays.

The loop's telemetry fills it, the viewers replay it, the benchmarks measure it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import groupby, pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.brief import cut


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time with one label.

    Attributes:
        start, end: seconds after the start of the recording.
        label: what the robot was doing.
    """

    start: float
    end: float
    label: str


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

    def __repr__(self) -> str:
        """How long, and what was done."""
        done = " ".join(label for label, _ in groupby(self.labels))
        return cut(f"Recording({len(self.time)} samples, {self.duration:.2f} s: {done})")

    @property
    def duration(self) -> float:
        """Seconds between the first and the last sample."""
        return float(self.time[-1] - self.time[0]) if len(self.time) else 0.0

    def part(self, rows: slice | Int[np.ndarray, " k"]) -> Recording:
        """Some of the samples, with their times unchanged.

        Args:
            rows: of the samples to keep, in increasing order.
        """
        labels = np.array(self.labels, dtype=object)[rows]
        arrays = (getattr(self, field.name)[rows] for field in fields(self)[:-1])
        return Recording(*arrays, labels=tuple(labels))

    def spans(self) -> tuple[Span, ...]:
        """Stretches of equal labels, in order; each ends where the next begins."""
        labels, time = self.labels, self.time - self.time[0]
        starts = [next(rows) for _, rows in groupby(range(len(labels)), labels.__getitem__)]
        return tuple(
            Span(float(time[start]), float(time[end]), labels[start])
            for start, end in pairwise([*starts, len(labels) - 1])
        )
