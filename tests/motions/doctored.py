"""Plans made from good ones by breaking one thing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from go2_wbc.curves import keyframes
from go2_wbc.legs import Leg
from motions import HighFivePlan

# rad; beyond the upper limit of a calf, -0.838.
STRETCHED = -0.5


def with_joint_beyond_its_limit(plan: HighFivePlan) -> HighFivePlan:
    """``plan`` with the raised calf stretched beyond its limit while the paw is held."""
    middle = 0.5 * (plan.hold_start + plan.hold_end)
    stretched = plan.joints.at(middle).value.copy()
    stretched[Leg(plan.leg).joints.stop - 1] = STRETCHED
    ends = plan.joints.at(0.0).value
    times = (0.0, middle, plan.duration)
    return replace(plan, joints=keyframes(times, (ends, stretched, ends)))


def with_joint_too_fast(plan: HighFivePlan) -> HighFivePlan:
    """``plan`` with the raised thigh swung by 1 rad within 20 ms."""
    middle = 0.5 * (plan.hold_start + plan.hold_end)
    before = plan.joints.at(middle).value
    after = before.copy()
    after[plan.leg.joints.start + 1] += 1.0
    values = (before, before, after, after)
    times = (0.0, middle, middle + 0.02, plan.duration)
    return replace(plan, joints=keyframes(times, values))


def with_body_aside(plan: HighFivePlan, aside: float) -> HighFivePlan:
    """``plan`` with the CoM ``aside`` metres to the left for the whole time."""
    pose = plan.body.at(0.0).value + np.array([0.0, aside, 0.0, 0.0, 0.0, 0.0])
    return replace(plan, body=keyframes((0.0, plan.duration), (pose, pose)))
