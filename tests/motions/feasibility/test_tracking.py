"""How far the trunk is off its plan, held to what MuJoCo's was in motions drawn for that alone."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from go2_wbc.world import World
from motions import FeasibilityChecker, FeasibilityReport, Timeline, deg
from motions.feasibility.tracking import resistance
from tests.motions.feasibility.cases import case_of


def to_and_fro(channel: str, size: float, over: float, times: int = 1) -> Timeline:
    line = Timeline()
    for _ in range(times):
        there, back = dict[str, Any]({channel: size}), dict[str, Any]({channel: -size})
        line = line.body(**there, over=over).body(**back, over=over)
    return line.home(over=0.5)


def tracked(report: FeasibilityReport) -> dict[str, float]:
    (series,) = (one for one in report.series if one.check == "tracking")
    return dict(zip(series.subjects, series.values.max(axis=0).tolist(), strict=True))


@pytest.mark.parametrize(
    ("channel", "size", "over", "times", "turned"),
    [
        ("roll", 0.54, 0.77, 1, 7.9),
        ("roll", 0.15, 0.45, 1, 5.1),
        ("roll", 0.51, 0.56, 1, 8.9),
        ("y", 0.07, 0.45, 1, 3.2),
        ("pitch", 0.41, 0.33, 2, 2.8),
        ("yaw", 0.31, 0.64, 2, 1.9),
        ("x", 0.11, 0.78, 2, 0.8),
    ],
)
def test_a_trunk_that_moves_fast_turns_behind_its_plan_by_the_friction_of_the_joints(
    checker: FeasibilityChecker, channel: str, size: float, over: float, times: int, turned: float
) -> None:
    report = checker.check(to_and_fro(channel, size, over, times))
    found = np.degrees(tracked(report)["trunk turning"])
    assert turned / 1.35 - 0.3 <= found <= turned  # in deg, of MuJoCo, which stands 0.3 off


@pytest.mark.parametrize(("angle", "is_refused"), [(17.0, False), (35.0, True)])
def test_a_roll_that_comes_late_is_refused_and_a_smaller_one_is_not(
    checker: FeasibilityChecker, angle: float, is_refused: bool
) -> None:
    # 7 and 11.5 deg off in MuJoCo, where 8 are too much; every other limit holds in both.
    report = checker.check(to_and_fro("roll", deg(angle), 0.31))
    assert [f.check for f in report.failures] == (["tracking"] if is_refused else [])


def test_stiff_joints_hold_the_trunk_back_more_and_four_feet_cannot_tip(
    checker: FeasibilityChecker,
) -> None:
    case = case_of(checker.evaluate(to_and_fro("roll", 0.4, 0.4)).path, checker.model)
    by_friction = [
        np.abs(resistance(replace(case, world=World(joint_friction=share)))[0]).max()
        for share in (0.5, 1.0, 2.0)
    ]
    assert by_friction == sorted(by_friction)
    assert by_friction[2] > 2.0 * by_friction[1]  # half of the nominal dry part is fed forward
    assert "tipping" not in checker.check(to_and_fro("y", 0.05, 0.5)).margins


@pytest.mark.parametrize(
    ("height", "over", "is_refused"), [(0.095, 0.58, False), (-0.097, 0.56, True)]
)
def test_a_bounce_that_tips_over_the_edge_of_three_feet_is_refused(
    checker: FeasibilityChecker, height: float, over: float, is_refused: bool
) -> None:
    # The first leaves the edge for a moment and is done; the second passed, and the robot fell.
    line = Timeline().foot("RL", z=0.09, over=0.7).body(z=height, over=over)
    line = line.body(z=-height, over=over).foot("RL", z=0.0, over=0.8).home(over=0.9)
    report = checker.check(line)
    assert report.margins["tipping"].value > 0.0
    assert [f.check for f in report.failures] == (["tipping"] if is_refused else [])
