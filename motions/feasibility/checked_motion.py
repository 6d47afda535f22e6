"""A motion as the check saw it: its report, the movement, and the forces that it needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from go2_wbc.geometry import support_margins
from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording
from go2_wbc.reference import MotionPlan
from motions.compiler import CompiledPlan
from motions.feasibility.dynamic import Forces
from motions.feasibility.report import FeasibilityReport
from motions.trajectory import Trajectory

_LEAST_FEET = 3
"""Standing feet that span an area."""


@dataclass(frozen=True, slots=True)
class CheckedMotion:
    """A checked motion, with what the check worked out on its way.

    Attributes:
        plan: what was checked.
        report: what the check says.
        path: the movement of the whole robot, in the frame of the motion.
        forces: contact forces and torques along it.
    """

    plan: MotionPlan
    report: FeasibilityReport
    path: Trajectory
    forces: Forces

    def recording(self) -> Recording:
        """The plan in the form of a recorded run, for viewers: 100 samples a second.

        Labels are the names of the plan's holds, elsewhere the feet that are in the air.
        """
        path = self.path
        margin = np.full(len(path.times), np.nan)
        for stands in np.unique(path.stance, axis=0):
            if stands.sum() >= _LEAST_FEET:
                rows = (path.stance == stands).all(axis=1)
                margin[rows] = support_margins(path.p_feet[stands, :2], path.p_com[rows, :2])
        spans = self.plan.spans if isinstance(self.plan, CompiledPlan) else {}
        return Recording(
            time=path.times,
            q=path.q,
            v=path.v,
            tau=self.forces.tau,
            foot_forces=self.forces.contact[:, :, 2],
            stance=path.stance,
            p_world_com=path.p_com,
            support_margin=margin,
            labels=tuple(
                _label(float(t), stands, spans)
                for t, stands in zip(path.times, path.stance, strict=True)
            ),
        )


def _label(
    time: float, stance: Bool[np.ndarray, "4"], spans: Mapping[str, tuple[float, float]]
) -> str:
    for name, (start, end) in spans.items():
        if start <= time < end:
            return name
    raised = [leg.name for leg in LEGS if not stance[leg]]
    return f"{' and '.join(raised)} up" if raised else "on four feet"
