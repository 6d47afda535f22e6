"""Plans made from good ones by breaking one thing."""

from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.legs import Leg
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.reference import Reference
from motions import CompiledPlan

STRETCHED = -0.5  # rad; beyond the upper limit of a calf, -0.838
BUMP = 0.3  # s; half the time in which a joint leaves its way and comes back


@dataclass(frozen=True, slots=True)
class DoctoredPlan(MotionPlan):
    """A plan whose joints and body are bent by ``joints(t)`` (12,) and ``body(t)`` (3,)."""

    inner: CompiledPlan
    joint: int = 0
    angle: float = 0.0
    centre: float = 0.0
    width: float = BUMP
    aside: float = 0.0

    @property
    def name(self) -> str:  # type: ignore[override]
        return self.inner.name

    @property
    def entry(self) -> Posture:  # type: ignore[override]
        return self.inner.entry

    @property
    def exit(self) -> Posture:  # type: ignore[override]
        return self.inner.exit

    @property
    def duration(self) -> float:  # type: ignore[override]
        return self.inner.duration

    def at(self, t: float) -> Reference:
        good = self.inner.at(t)
        joints = good.q_joints.copy()
        joints[self.joint] += self.angle * max(0.0, 1.0 - abs(t - self.centre) / self.width)
        body = replace(good.body, p_world=good.body.p_world + np.array([0.0, self.aside, 0.0]))
        return replace(good, q_joints=joints, body=body)


def middle(plan: CompiledPlan) -> float:
    """The middle [s] of the time for which the paw is held."""
    return float(np.mean(plan.spans["held"]))


def with_joint_beyond_its_limit(plan: CompiledPlan) -> DoctoredPlan:
    """``plan`` with the raised calf stretched beyond its limit while the paw is held."""
    calf = Leg.FR.joints.stop - 1
    bend = STRETCHED - float(plan.at(middle(plan)).q_joints[calf])
    return DoctoredPlan(plan, calf, bend, middle(plan))


def with_joint_too_fast(plan: CompiledPlan) -> DoctoredPlan:
    """``plan`` with the raised thigh swung by 1 rad within 20 ms."""
    return DoctoredPlan(plan, Leg.FR.joints.start + 1, 1.0, middle(plan), width=0.02)


def with_body_aside(plan: CompiledPlan, aside: float) -> DoctoredPlan:
    """``plan`` with the CoM ``aside`` metres to the left for the whole time."""
    return DoctoredPlan(plan, aside=aside)
