"""A motion that a caller has compiled and checked is played without doing either again."""

from __future__ import annotations

from importlib import import_module

import pytest

import motions
from controller import GO2Controller
from go2_wbc.errors import MotionInfeasible
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline, compile_timeline, load_motion


def test_a_checked_motion_is_played_or_refused_by_the_report_that_it_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    checker = FeasibilityChecker()
    good = checker.evaluate("nod")
    bad = checker.evaluate(Timeline().body(z=0.18, over=1.0).home(over=1.0))
    for module, name in (("check", "trajectory_of"), ("checked_motion", "compile_timeline")):
        found = import_module(f"motions.feasibility.{module}")
        monkeypatch.setattr(found, name, lambda *_: pytest.fail("done twice"))
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.play(good), go2.last_outcome.reason
        with pytest.raises(MotionInfeasible, match="way of a foot"):
            go2.play(bad)


@pytest.mark.slow
def test_a_high_five_takes_the_plan_of_a_caller_who_has_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plan = compile_timeline(load_motion("high_five", side="left", hold=0.5), RobotModel())
    monkeypatch.setattr(motions, "compile_timeline", lambda *_: pytest.fail("done twice"))
    with GO2Controller() as go2:
        assert go2.stand()
        assert go2.high_five("left", hold=0.5, plan=plan), go2.last_outcome.reason
