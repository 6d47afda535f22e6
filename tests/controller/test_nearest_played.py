"""The nearest to a motion that cannot be done: played, and how far it had to go is told."""

from __future__ import annotations

import pytest

from controller import GO2Controller
from motions import FeasibilityChecker, Timeline
from tests.solver import needs_solver


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
