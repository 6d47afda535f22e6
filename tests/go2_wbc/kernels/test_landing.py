"""The kernel that lets a plan's feet land is held to the readable form, tick by tick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.contacts import ContactSchedule
from go2_wbc.legs import Leg
from go2_wbc.planning.playback import Playback, ReadablePlayback
from go2_wbc.reference import Anchor
from go2_wbc.robot import rotations
from go2_wbc.robot.model import RobotModel
from motions.plan.compiled_plan import CompiledPlan
from tests.engine_helpers import random_state
from tests.stepping_plans import hop_plan, step_plan

MODEL = RobotModel()
ROUNDING = 1e-10
TICK = 0.005


def _mixed() -> CompiledPlan:
    """A hop in which one leg follows its joints, lands, and steps later on."""
    hop = hop_plan(MODEL, 0.1, 2)
    swings = hop.swings.copy()
    swings[1, 1] = False
    return replace(hop, swings=swings)


def _staggered() -> CompiledPlan:
    """Feet that come and go one by one, faster than they can be missed."""
    rng = np.random.default_rng(8)
    modes = rng.random((30, 4)) < 0.5
    modes[0] = True
    schedule = ContactSchedule(tuple(np.linspace(0.0, 1.9, 30).tolist()), modes)
    return replace(hop_plan(MODEL, 0.2, 2), contacts=schedule, swings=~modes)


PLANS = {
    "step": step_plan(MODEL, Leg.RR, 0.05, -0.02),
    "hops": hop_plan(MODEL, 0.1, 2),
    "mixed": _mixed(),
    "staggered": _staggered(),
}


@pytest.mark.parametrize("contact", [0.0, 0.02, 0.5])
@pytest.mark.parametrize("name", PLANS)
def test_feet_land_as_in_the_readable_form(name: str, contact: float) -> None:
    plan, rng = PLANS[name], np.random.default_rng(9)
    steps, anchor = plan.footsteps, Anchor(np.array([0.31, -0.17, 0.043]), 1.3)
    ours, theirs = Playback(anchor, steps), ReadablePlayback(anchor, steps)
    turn, changed = rotations.yaw_rotation(anchor.yaw), 0
    for t in np.arange(0.0, plan.duration + 0.1, TICK).tolist():
        row, state = plan.row_at(t), random_state(rng, tilt=0.2)
        planned = plan.at(t)
        q = state.q.copy()
        q[:3] = anchor.p_world + turn @ planned.body.p_world + rng.normal(scale=0.03, size=3)
        feet = rng.random(4) < contact
        snapshot = MODEL.snapshot(replace(state, q=q, feet_in_contact=feet))
        tracked = ours.follow(row, snapshot, t, TICK)
        expected = theirs.follow(row, snapshot, t, TICK)
        np.testing.assert_allclose(tracked.row, expected.row, atol=ROUNDING, rtol=0, err_msg=str(t))
        assert ours.landings.missed == theirs.landings.missed
        assert ours.landings.error == pytest.approx(theirs.landings.error, abs=ROUNDING)
        changed += tracked.legs != planned.legs
    assert changed > 0, "nothing landed early or late"
