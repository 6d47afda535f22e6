"""Before a foot is raised, the trunk moves until the CoM is over the others."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.geometry import support_margins
from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline
from motions.plan.balance import INSIDE, MARGINS, OFF_LINE, Stepping, SwayProblem
from motions.plan.trajectory import trajectory_of
from motions.postures import standing_feet

# m; the CoM's place by the inverse kinematics, which has the trunk's attitude as written, and by
# the trajectory's.
AGREEMENT = 0.002


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.04, 0.0), (-0.03, 0.03)])
def test_a_trunk_that_has_moved_away_is_balanced_from_where_it_is(x: float, y: float) -> None:
    model = RobotModel()
    line = Timeline().body(x=x, y=y, over=0.8).foot("FR", z=0.06, over=0.8)
    path = trajectory_of(compile_timeline(line.home(over=1.0), model), model)
    raised = ~path.stance.all(axis=1)
    standing = path.p_feet[0, path.stance[raised][0], :2]
    margins = support_margins(standing, path.p_com[raised, :2])
    assert raised.sum() > 50
    assert margins.min() > MARGINS[0] - AGREEMENT  # the best is possible here


NOMINAL = standing_feet(RobotModel())
TIMES = np.linspace(0.0, 3.0, 301)
LEFT_OVER = 1e-3  # m; what the finite weight of a broken margin leaves
PAIR = [Leg.FL, Leg.RR]


def stepping(raised: dict[Leg, tuple[float, float]]) -> Stepping:
    """A CoM that rests 29 cm above the middle of four feet, of which some are off for a while."""
    stance = np.ones((len(TIMES), 4), dtype=bool)
    for leg, (start, end) in raised.items():
        stance[(start <= TIMES) & (end > TIMES), leg] = False
    return Stepping(
        times=TIMES,
        p_com=np.tile([0.0, 0.0, 0.29], (len(TIMES), 1)),
        stance=stance,
        p_feet=np.tile(NOMINAL, (len(TIMES), 1, 1)),
        gravity=9.81,
        bias=np.zeros((len(TIMES), 2)),
    )


def sway(asked: Stepping) -> np.ndarray:
    return SwayProblem(asked).solve(asked)


def test_nothing_moves_where_nothing_must_and_a_bias_counts_as_if_made_with_it() -> None:
    asked = stepping({Leg.FL: (1.0, 1.3), Leg.RR: (1.5, 1.9)})
    biased = replace(asked, bias=np.full((len(TIMES), 2), 0.01))
    assert np.array_equal(SwayProblem(asked).solve(biased), sway(biased))
    assert not np.array_equal(sway(asked), sway(biased))
    assert not sway(stepping({})).any()


def test_the_zero_moment_point_is_that_of_a_pendulum_that_rises_and_falls() -> None:
    """x - x'' z / (g + z''), Vukobratovic, of a CoM that goes to and fro and up and down."""
    asked, rate = stepping({}), 4.0 * np.pi / TIMES[-1]
    way = 0.03 * np.cos(rate * TIMES)
    height = 0.29 + 0.05 * np.cos(rate * TIMES)
    asked.p_com[:, 2] = height
    expected = way + rate**2 * way * height / (9.81 - rate**2 * (height - 0.29))
    found = asked.zmp(np.column_stack([way, np.zeros(len(TIMES))]))
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-5)
    np.testing.assert_array_equal(found[:, 1], 0.0)


def test_com_and_zero_moment_point_stay_inside_of_three_feet_and_it_begins_and_ends_at_rest() -> (
    None
):
    asked = stepping({Leg.FL: (1.0, 1.5), Leg.RR: (1.8, 2.2)})
    way = sway(asked)
    for leg, (start, end) in {Leg.FL: (1.0, 1.5), Leg.RR: (1.8, 2.2)}.items():
        rows, others = (start <= TIMES) & (end > TIMES), [k for k in range(4) if k != leg]
        for points in (way, asked.zmp(way)):
            margins = support_margins(NOMINAL[others, :2], points[rows])
            assert margins.min() > INSIDE - LEFT_OVER
    assert not way[[0, -1]].any()
    assert np.abs(np.diff(way, axis=0)[[0, -1]]).max() < 1e-6


def test_the_zero_moment_point_stays_on_the_line_of_two_feet() -> None:
    asked = stepping(dict.fromkeys(PAIR, (1.4, 1.6)))
    asked = replace(asked, p_com=asked.p_com + np.array([0.0, 0.02, 0.0]))
    rows, others = ~asked.stance.all(axis=1), [k for k in range(4) if k not in PAIR]
    off = -support_margins(NOMINAL[others, :2], asked.zmp(sway(asked))[rows])
    assert off.max() < OFF_LINE + LEFT_OVER
    still = -support_margins(NOMINAL[others, :2], asked.zmp()[rows])
    assert still.max() > 0.01


def test_what_the_pendulum_leaves_out_is_made_up_for_or_the_least_bad_way_taken() -> None:
    asked = stepping({Leg.FL: (1.0, 1.5)})
    biased = replace(asked, bias=np.tile([0.0, 0.01], (len(TIMES), 1)))
    rows = ~asked.stance.all(axis=1)
    margins = support_margins(NOMINAL[1:, :2], biased.zmp(sway(biased))[rows])
    assert margins.min() > INSIDE - LEFT_OVER
    asked = stepping(dict.fromkeys([Leg.FL, Leg.RL], (1.0, 2.0)))  # on the right feet alone
    short = replace(asked, times=TIMES / 10.0)
    way = sway(short)
    assert np.isfinite(way).all()
    assert way[:, 1].min() == pytest.approx(NOMINAL[Leg.FR, 1], abs=0.2)
