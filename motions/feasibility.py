"""Whether a plan stays inside the limits that can be told without simulating it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from go2_wbc.errors import MotionInfeasible
from go2_wbc.geometry import support_margin
from go2_wbc.legs import JOINT_NAMES, LEGS, Leg
from go2_wbc.reference import LegTask, MotionPlan, Reference, TrackedPoint
from go2_wbc.robot.model import RobotModel

SAMPLE_PERIOD = 0.01
"""Time [s] between the instants that are looked at."""
LEAST_SUPPORT = 0.0
"""Least distance [m] of the CoM to the edges of the support polygon."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One broken limit at its worst instant; ``margin`` is negative.

    Attributes:
        check: which limit.
        time: when [s] it is worst.
        subject: joint or body part.
        value, limit, margin: in ``unit``.
    """

    check: str
    time: float
    subject: str
    value: float
    limit: float
    margin: float
    unit: str

    def __str__(self) -> str:
        """One line for a person."""
        return (
            f"{self.check}: {self.subject} at {self.time:.2f} s is {self.value:.3f} {self.unit}, "
            f"limit {self.limit:.3f}"
        )


def check_plan(plan: MotionPlan, model: RobotModel) -> None:
    """Check joint angles and speeds of the legs in the air, and the support of the CoM.

    Raises:
        MotionInfeasible: with the worst instant of every broken limit.
    """
    worst: dict[tuple[str, str], Finding] = {}
    for t in np.arange(0.0, plan.duration + SAMPLE_PERIOD, SAMPLE_PERIOD):
        for finding in _broken(plan.at(float(t)), float(t), model):
            key = (finding.check, finding.subject)
            if key not in worst or finding.margin < worst[key].margin:
                worst[key] = finding
    if worst:
        findings = sorted(worst.values(), key=lambda finding: finding.time)
        raise MotionInfeasible(plan.name, findings)


def _broken(reference: Reference, t: float, model: RobotModel) -> list[Finding]:
    legs = [leg for leg in LEGS if reference.legs[leg] is LegTask.JOINTS]
    found = [f for leg in legs for f in _joint_findings(reference, leg, t, model)]
    stance = reference.stance
    if reference.body.point is TrackedPoint.COM and stance.sum() >= 3:
        feet = model.p_base_feet_nominal[stance, :2]
        margin = support_margin(feet, reference.body.p_world[:2])
        if not margin >= LEAST_SUPPORT:
            short = margin - LEAST_SUPPORT
            found.append(Finding("support", t, "CoM", margin, LEAST_SUPPORT, short, "m"))
    return found


def _joint_findings(reference: Reference, leg: Leg, t: float, model: RobotModel) -> list[Finding]:
    found = []
    for joint in range(leg.joints.start, leg.joints.stop):
        q, v, name = reference.q_joints[joint], reference.v_joints[joint], JOINT_NAMES[joint]
        low, high, fastest = model.q_lower[joint], model.q_upper[joint], model.speed_limits[joint]
        limit = low if q < low else high
        margin = float(min(q - low, high - q))
        if not margin >= 0.0:
            found.append(Finding("joint position", t, name, float(q), limit, margin, "rad"))
        if not abs(v) <= fastest:
            slack = float(fastest - abs(v))
            found.append(Finding("joint speed", t, name, float(v), fastest, slack, "rad/s"))
    return found
