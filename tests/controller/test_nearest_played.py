"""The nearest to a motion that cannot be done: played, and how far it had to go is told."""

from __future__ import annotations

import pytest

from benchmarks.validation_set.physics import play
from controller import GO2Controller
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline
from tests.solver import needs_solver

STILL = 0.008
"""Distance [m] that a foot which stands may slide: less than the 10 mm that count as a slip."""


@needs_solver
def test_play_tells_how_far_the_plan_is_from_what_was_written() -> None:
    line = Timeline(physics="nearest").hold(0.2).body(y=0.06, over=0.2).body(y=-0.06, over=0.2)
    checked = FeasibilityChecker().evaluate(line.home(over=0.4).hold(0.2))
    (departed,) = checked.report.departures
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.play(checked), go2.last_outcome.reason
        measured = dict(go2.last_outcome.measured)
        assert measured["plan off what was written [m]"] == pytest.approx(departed.place)
        assert measured["the same, at [s]"] == pytest.approx(departed.place_time)
        assert measured["plan late [s]"] == pytest.approx(departed.lag)
        assert go2.play(Timeline().body(z=-0.02, over=0.4).home(over=0.4))
        assert not any("written" in name for name in go2.last_outcome.measured)


@needs_solver
def test_feet_stand_still_on_the_floor_that_a_quick_sway_was_solved_for() -> None:
    """Its forces lie in the cone of that floor; shared evenly they do not, and feet slid 20 mm."""
    model = RobotModel()
    line = Timeline(physics="nearest").body(y=0.085, over=0.45).body(y=-0.085, over=0.45)
    plan = FeasibilityChecker(model).plan(line.home(over=0.4))
    run = play(plan, model, seed=0)
    assert run.said, run.reason
    assert run.slip < STILL
