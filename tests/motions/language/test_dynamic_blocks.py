"""Calls whose motion is solved: what they write, and what they refuse."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import Posture
from motions import Timeline, deg
from motions.dynamics.phases import Phase
from motions.language.keys import PhaseKey

_TIE = 1e-9  #: [s] Rounding of sums


def blocks(line: Timeline) -> list[PhaseKey]:
    return line.in_order(PhaseKey)


def phases(line: Timeline) -> tuple[Phase, ...]:
    (block,) = blocks(line)
    return block.phases


def touchdowns(line: Timeline) -> list[float]:
    """When [s] feet come down."""
    found = []
    for block in blocks(line):
        ends = block.start + np.cumsum([phase.duration for phase in block.phases])
        for end, (before, after) in zip(ends, pairwise(block.phases), strict=False):
            if after.stance - before.stance:
                found.append(float(end))
    return found


def test_a_jump_flies_and_lands_where_it_says_and_time_goes_on() -> None:
    line = Timeline().jump(x=0.3, height=0.1).hold(0.5)
    (block,) = blocks(line)
    assert line.is_dynamic
    assert not Timeline().hold(1.0).is_dynamic
    assert block.end - block.start == pytest.approx(sum(one.duration for one in phases(line)))
    assert line.end == pytest.approx(block.end + 0.5)
    flown = [one for one in phases(line) if not one.stance]
    assert flown[-1].feet[Leg.FL] == pytest.approx((0.3, 0.0, 0.0))
    assert max(one.feet[Leg.RR][2] for one in flown) == pytest.approx(0.1)


def test_time_in_the_air_may_be_beats_and_hops_come_down_on_them() -> None:
    flown = [one for one in phases(Timeline().bpm(120).jump(flight=0.8)) if not one.stance]
    assert sum(one.duration for one in flown) == pytest.approx(0.4)
    for tempo in (90.0, 113.0, 120.0):
        beat = 60.0 / tempo
        line = Timeline().bpm(tempo).hold(3).hop(3, height=0.04, period=1)
        beats = np.array(touchdowns(line)) / beat
        assert beats == pytest.approx(np.round(beats), abs=_TIE)
        assert np.diff(beats) == pytest.approx([1.0, 1.0])
        assert line.end / beat == pytest.approx(round(line.end / beat), abs=_TIE)


def test_in_the_mirror_a_spin_turns_the_other_way_and_other_feet_are_lifted() -> None:
    left = phases(Timeline().spin_jump(deg(90)))
    right = phases(Timeline().spin_jump(deg(90)).mirror())
    assert left[-1].body is not None
    assert left[-1].body[5] == pytest.approx(deg(90))
    assert right == phases(Timeline().spin_jump(deg(-90)))
    line = Timeline().lift(("FL", "RR"))
    in_air = [frozenset(LEGS) - one.stance for one in phases(line)]
    assert {Leg.FL, Leg.RR} in in_air
    assert {Leg.FR, Leg.RL} in [frozenset(LEGS) - one.stance for one in phases(line.mirror())]


def test_phases_in_a_row_are_one_block_and_what_is_repeated_is_the_same_later() -> None:
    crouched = Timeline().phase(0.3, body={"z": -0.05}).phase(0.2)
    assert len(phases(crouched)) == 2
    assert len(blocks(crouched.hold(0.1).phase(0.2))) == 2
    assert len(blocks(Timeline().jump().phase(0.2))) == 2
    first, second = blocks(Timeline().jump(x=0.2).repeat(2))
    assert first.phases == second.phases
    assert second.start == pytest.approx(first.end)


def test_a_pounce_is_a_jump_from_a_low_crouch_and_what_follows_counts_from_its_landing() -> None:
    first, *others = phases(Timeline().pounce(0.3, crouch=0.8))
    assert first.duration == pytest.approx(0.8)
    assert first.body is not None
    assert first.body[2] < -0.06
    assert others[-1].body is not None
    assert others[-1].body[0] == pytest.approx(0.3)
    line = Timeline().jump(x=0.3, yaw=deg(90)).jump(x=0.2).walk(x=0.1)
    assert line.end_pose == pytest.approx((0.3, 0.3, deg(90)), abs=1e-6)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda: Timeline().jump(x=2.0), "a jump's x must be from -1 to 1, got 2"),
        (lambda: Timeline().jump(height=2.0), "a jump's height must be from -0.4 to 0.4, got 2"),
        (lambda: Timeline().jump(height=0.0), "height must be from 0.02 to 0.4, got 0"),
        (lambda: Timeline().jump(height=-0.1), "height must be from 0.02 to 0.4, got -0.1"),
        (lambda: Timeline().spin_jump(90.0), r"to 3.14 rad, got 90.0: did you mean deg\(90\)"),
        (lambda: Timeline().hop(0), "from 1 to 10, got 0"),
        (lambda: Timeline().hop(True), "from 1 to 10, got True"),
        (lambda: Timeline().hop(3, height=0.2, period=0.3), "the period of hops must be from 0.6"),
        (lambda: Timeline().rear(deg(25)), r"-1.05 to -0.0873 rad, got .* mean -0.436332\?"),
        (lambda: Timeline().rear(25), r"did you mean -deg\(25\)"),
        (lambda: Timeline().rear(deg(-80)), "pitch of rearing must be from -1.05 to -0.0873, got"),
        (lambda: Timeline().jump(yaw=90), r"did you mean deg\(90\)"),
        (lambda: Timeline().rear(hold=0.0), "hold must be a number above 0"),
        (lambda: Timeline().lift(("FL",)), "lift.. takes two feet"),
        (lambda: Timeline().lift("FL"), "takes two feet"),
        (lambda: Timeline().lift(("FL", "XX")), "unknown foot 'XX'"),
        (lambda: Timeline().phase(0.0), "duration must be a number above 0, got 0"),
        (lambda: Timeline().phase(9.0), "lasts 9 s; a dynamic phase lasts at most 5 s"),
        (
            lambda: Timeline().phase(0.3, stance=("FL",), feet={"RR": (0.0, 0.0, -0.1)}),
            "RR foot -0.1 m is under the ground",
        ),
        (lambda: Timeline().phase(0.3, feet={"RR": (0.0, 0.0, 0.1)}), "cannot stand and move"),
        (lambda: Timeline().phase(0.3, stance=(), feet={"RR": (0.0, 0.1)}), "must be x, y, z"),
        (lambda: Timeline().phase(0.3, body={"height": 0.1}), "unknown coordinate of the body"),
        (lambda: Timeline().body(z=-0.05, over=0.5).jump(), "standing at home.*away: body z"),
        (lambda: Timeline().foot("FR", z=0.05, over=0.5).jump(), "away: foot FR, balance"),
        (lambda: Timeline().jump().at(0.5).jump(), "the whole robot moves twice at once"),
        (lambda: Timeline(entry=Posture.SIT).jump(), "away: posture sit"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_words(
    write: Callable[[], object], message: str
) -> None:
    with pytest.raises(TimelineError, match=message):
        write()
