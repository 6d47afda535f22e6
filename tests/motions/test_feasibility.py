"""A plan that breaks a limit is refused, with the limit, the part, the time and the amount."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.errors import MotionInfeasible
from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from motions import Finding, HighFivePlan, check_plan, high_five_plan
from tests.motions.doctored import (
    STRETCHED,
    with_body_aside,
    with_joint_beyond_its_limit,
    with_joint_too_fast,
)


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="module")
def good(model: RobotModel) -> HighFivePlan:
    return high_five_plan(model, Leg.FR, 1.0)


def findings(plan: HighFivePlan, model: RobotModel) -> list[Finding]:
    with pytest.raises(MotionInfeasible, match="'high five' is infeasible") as caught:
        check_plan(plan, model)
    found = [finding for finding in caught.value.findings if isinstance(finding, Finding)]
    assert len(found) == len(caught.value.findings)
    assert all(str(finding) in str(caught.value) for finding in found)
    return found


def test_a_good_plan_passes(good: HighFivePlan, model: RobotModel) -> None:
    check_plan(good, model)


def test_a_joint_beyond_its_limit_is_found_at_its_worst_instant(
    good: HighFivePlan, model: RobotModel
) -> None:
    found = findings(with_joint_beyond_its_limit(good), model)
    (finding,) = [f for f in found if f.check == "joint position"]
    limit = model.q_upper[Leg.FR.joints.stop - 1]
    assert finding.subject == "FR_calf_joint"
    assert finding.unit == "rad"
    assert finding.limit == pytest.approx(limit)
    assert finding.value == pytest.approx(STRETCHED, abs=0.01)
    assert finding.margin == pytest.approx(limit - STRETCHED, abs=0.01)
    assert finding.time == pytest.approx(0.5 * (good.hold_start + good.hold_end), abs=0.02)


def test_a_joint_that_is_too_fast_is_found(good: HighFivePlan, model: RobotModel) -> None:
    found = findings(with_joint_too_fast(good), model)
    (finding,) = [f for f in found if f.check == "joint speed"]
    assert finding.subject == "FR_thigh_joint"
    assert finding.unit == "rad/s"
    assert finding.margin < 0.0
    assert abs(finding.value) > finding.limit == pytest.approx(30.1)


@pytest.mark.parametrize("aside", [0.3, -0.3])
def test_a_com_outside_the_support_is_found(
    good: HighFivePlan, model: RobotModel, aside: float
) -> None:
    (finding,) = [f for f in findings(with_body_aside(good, aside), model) if f.check == "support"]
    assert finding.subject == "CoM"
    assert finding.margin < -0.05
    assert finding.value < finding.limit


def test_a_com_between_the_feet_but_off_the_triangle_is_found_only_while_a_paw_is_up(
    good: HighFivePlan, model: RobotModel
) -> None:
    (finding,) = findings(with_body_aside(good, -0.08), model)
    assert finding.check == "support"
    assert not good.at(finding.time).stance.all()


def test_findings_come_in_the_order_of_their_time(good: HighFivePlan, model: RobotModel) -> None:
    times = [f.time for f in findings(with_body_aside(with_joint_too_fast(good), 0.3), model)]
    assert len(times) >= 2
    assert times == sorted(times)


def test_a_plan_that_is_not_a_number_is_infeasible(good: HighFivePlan, model: RobotModel) -> None:
    nans = findings(with_body_aside(good, float("nan")), model)
    assert [f.check for f in nans] == ["support"]
    assert np.isnan(nans[0].value)
