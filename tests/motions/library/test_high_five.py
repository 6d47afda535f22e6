"""The high five leads back the way it came."""

import pytest

from go2_wbc.errors import TimelineError
from go2_wbc.legs import Leg
from motions import Timeline, compile_timeline, load_motion
from motions.language.keys import BODY_CHANNELS, BodyKey
from tests.motions.plans import MODEL


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_trunk_comes_back_through_the_poses_by_which_it_went(side: str) -> None:
    keys = load_motion("high_five", side=side).in_order(BodyKey)
    for channel in BODY_CHANNELS:
        goals = [0.0, *(key.value for key in keys if key.channel == channel)]
        assert goals == goals[::-1], channel


@pytest.mark.parametrize(("side", "leg"), [("right", Leg.FR), ("left", Leg.FL)])
def test_it_counts_as_done_only_if_the_paw_is_held_at_its_height(side: str, leg: Leg) -> None:
    plan = compile_timeline(load_motion("high_five", side=side, height=0.6), MODEL)
    (held,) = plan.held_feet
    assert (held.name, held.leg) == ("held", leg)
    assert held.height == pytest.approx(0.6, abs=1e-6)
    assert (held.start, held.end) == plan.spans["held"]
    assert held.end - held.start == pytest.approx(2.0)
    for t in (held.start, held.end):
        assert not plan.at(t).stance[leg]


def test_a_foot_on_the_ground_is_not_held_up() -> None:
    with pytest.raises(TimelineError, match="foot FL must be raised"):
        Timeline().foot("FR", z=0.05, over=0.5).hold(0.5, name="held", foot="FL")
