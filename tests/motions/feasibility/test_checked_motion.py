"""What the check works out on its way, in the form of a recorded run."""

import numpy as np
import pytest

from go2_wbc.geometry import support_margin
from go2_wbc.legs import Leg
from motions import CheckedMotion, FeasibilityChecker, Timeline, load_motion

_WEIGHT_TOLERANCE = 1.0
"""[N] What the even share of the load takes away from the wrench, at rest."""
_UNLOADED = 1e-3
"""[N] Solver's tolerance at a bound."""


@pytest.fixture(scope="module")
def high_five(checker: FeasibilityChecker) -> CheckedMotion:
    return checker.evaluate(load_motion("high_five"))


def test_it_has_the_report_that_check_gives(
    checker: FeasibilityChecker, high_five: CheckedMotion
) -> None:
    assert high_five.report.as_dict() == checker.check("high_five").as_dict()


def test_at_rest_the_forces_point_up_and_carry_the_weight(
    checker: FeasibilityChecker, high_five: CheckedMotion
) -> None:
    run = high_five.recording()
    weight = checker.model.mass * checker.model.gravity
    held = run.labels.index("held") + 30
    for row in (0, held, -1):
        assert run.foot_forces[row].sum() == pytest.approx(weight, abs=_WEIGHT_TOLERANCE)
    assert run.foot_forces.min() > -_UNLOADED
    np.testing.assert_allclose(run.foot_forces[~run.stance], 0.0, atol=_UNLOADED)
    assert not run.stance[held, Leg.FR]
    assert run.stance[held].sum() == 3


def test_the_margin_is_that_of_the_com_over_the_standing_feet(
    checker: FeasibilityChecker, high_five: CheckedMotion
) -> None:
    run = high_five.recording()
    for row in (0, len(run.time) // 2, -1):
        com, feet = checker.model.forward_kinematics(run.q[row])
        expected = support_margin(feet[run.stance[row], :2], com[:2])
        assert run.support_margin[row] == pytest.approx(expected, abs=1e-4)
        assert expected > 0.0


def test_labels_are_the_names_of_holds_or_the_feet_in_the_air(high_five: CheckedMotion) -> None:
    assert set(high_five.recording().labels) == {"on four feet", "FR up", "held"}


def test_two_raised_feet_have_no_margin(checker: FeasibilityChecker) -> None:
    line = Timeline(balance=False).foot("FR", z=0.05, over=0.4).foot("RL", z=0.05, over=0.4)
    run = checker.evaluate(line.home(over=0.5)).recording()
    both = np.array([label == "FR and RL up" for label in run.labels])
    assert both.any()
    assert np.isnan(run.support_margin[both]).all()
    assert np.isfinite(run.support_margin[~both]).all()
