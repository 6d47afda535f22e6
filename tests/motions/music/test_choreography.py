"""Dances: on the beats of any song, different by seed, feasible, and never the same move twice."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from go2_wbc.curves import Ease
from go2_wbc.errors import CommandError, MotionInfeasible
from go2_wbc.legs import Leg
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from motions import FeasibilityChecker, Timeline
from motions.language.keys import BodyKey, LegKey
from motions.music import Accent, Beats, Dance, compose, danced, feasible_dance
from motions.music.choreography import LEAD, PlacedMove, pulses_of
from motions.music.dance_moves import MOVES, WALTZ, Strokes
from tests.go2_wbc.plant.helpers import empty_recording

CHECKER = FeasibilityChecker()
TEMPI = (55.0, 83.0, 110.0, 139.0, 176.0)
EXACT = 1e-9


def steady(
    bpm: float,
    seconds: float = 30.0,
    strengths: Sequence[float] = (1.0,),
    metre: int = 1,
    downbeat: int = 0,
) -> Beats:
    times = np.arange(0.4, seconds - 0.1, 60.0 / bpm)
    strong = np.resize(np.array(strengths), len(times))
    return Beats(bpm, times, strong, seconds, 1.0, metre, downbeat)


@pytest.mark.parametrize("metre", [1, 4])
@pytest.mark.parametrize("bpm", TEMPI)
def test_half_a_minute_has_twenty_moves_at_any_tempo(bpm: float, metre: int) -> None:
    for seed in range(5):
        dance = compose(steady(bpm, metre=metre), seed)
        assert len(dance.moves) >= 20
        assert dance.timeline.end <= 30.0 + 60.0 / bpm


@pytest.mark.parametrize("bpm", TEMPI)
def test_every_accent_is_written_on_a_beat(bpm: float) -> None:
    found = steady(bpm)
    dance = compose(found, 3)
    turns = {round(key.end, 6) for key in dance.timeline.keys if isinstance(key, BodyKey | LegKey)}
    for accent in dance.accents:
        instant = dance.time(accent)
        assert np.abs(found.times - instant).min() < EXACT
        assert round(instant - LEAD, 6) in turns


def test_a_foot_comes_down_with_speed_and_the_trunk_turns_back_without_a_rest() -> None:
    """What comes to rest on its beat has no instant of which one could say that it is the one."""
    dance = compose(steady(100.0), 0, ["tap_FL", "nod"])
    downs = [key for key in dance.timeline.in_order(LegKey) if key.target.is_on_ground]
    assert {key.ease for key in downs} == {Ease.IN}
    assert {key.ease for key in dance.timeline.in_order(BodyKey)} >= {Ease.CUBIC}


def test_a_seed_is_a_dance_without_the_same_move_twice_and_unknown_ones_are_refused() -> None:
    names = [[item.move.name for item in compose(steady(120.0), seed).moves] for seed in (1, 1, 2)]
    assert names[0] == names[1] != names[2]
    for seed in range(20):
        moves = compose(steady(97.0), seed).moves
        assert all(first.move is not second.move for first, second in pairwise(moves))
    with pytest.raises(CommandError, match=r"unknown move 'moonwalk'; valid: bob, bow"):
        compose(steady(100.0), 0, ["moonwalk"])
    with pytest.raises(CommandError, match="too short for a dance"):
        compose(steady(100.0, 2.2), 0)


def test_a_fast_song_is_danced_on_its_strong_beats_and_a_waltz_in_threes() -> None:
    """A song that was counted twice as fast as it is played is danced on its beats."""
    fast = steady(160.0, strengths=(0.2, 1.0))
    assert pulses_of(fast).times == pytest.approx(fast.times[1::2])
    slow = steady(90.0, strengths=(0.2, 1.0))
    assert pulses_of(slow).times == pytest.approx(slow.times)
    waltz, other = (compose(steady(90.0, metre=metre), 0).moves for metre in (3, 4))
    assert {item.move.name for item in waltz} >= set(WALTZ)
    assert not {item.move.name for item in other} & set(WALTZ)
    fast = steady(170.0, metre=3, downbeat=1)
    assert pulses_of(fast).times == pytest.approx(fast.times[1::3])
    twice = pulses_of(steady(140.0, metre=6, downbeat=1))  # counted twice as fast as it is played
    assert twice.times == pytest.approx(steady(140.0).times[1::2])
    assert (twice.bar, twice.downbeat) == (3, 0)


@pytest.mark.parametrize("downbeat", range(3))
@pytest.mark.parametrize("bpm", TEMPI)
@pytest.mark.parametrize("metre", [3, 4])
def test_moves_begin_with_the_bars(metre: int, bpm: float, downbeat: int) -> None:
    """A long one on the first beat of a bar; the others do not go across the end of theirs."""
    found = steady(bpm, metre=metre, downbeat=downbeat)
    pulses, firsts = pulses_of(found), found.times[downbeat::metre]
    assert pulses.times[pulses.downbeat :: pulses.bar][0] in firsts
    for seed in range(3):
        dance = compose(found, seed)
        begun = 0
        for item in dance.moves:
            start = dance.pulses[item.pulse]
            end = start + (item.move.pulses(pulses.usual) - 0.5) * pulses.usual
            begins = np.abs(firsts - start).min() < EXACT
            begun += begins
            assert begins or not np.any((firsts > start) & (firsts < end))
        assert begun >= 0.6 * (len(firsts) / max(pulses.usual * bpm / 60.0 / metre, 1.0) - 2)


def test_where_no_move_may_begin_is_a_rest_and_what_comes_too_soon_left_out() -> None:
    """Two beats of sway leave the third one of a waltz."""
    dance = compose(steady(90.0, metre=3), 0, ["sway"])
    starts = np.array([item.pulse for item in dance.moves])
    assert np.unique(np.diff(starts)).tolist() == [3]
    assert CHECKER.evaluate(dance.timeline).report.ok
    times = np.sort(np.append(np.arange(1.0, 20.0, 0.75), 5.9))
    found = Beats(80.0, times, np.ones(len(times)), 20.0, 1.0)
    assert len(pulses_of(found).times) == len(times) - 1


@pytest.mark.parametrize("metre", [1, 3, 4])
@pytest.mark.parametrize("bpm", TEMPI)
def test_a_dance_of_all_moves_is_feasible(bpm: float, metre: int) -> None:
    for seed in range(3 if metre == 1 else 1):
        _, checked = feasible_dance(steady(bpm, metre=metre), seed, CHECKER)
        assert checked.report.ok


def test_a_move_that_is_refused_is_replaced_by_another(monkeypatch: pytest.MonkeyPatch) -> None:
    wild = Strokes("wild", ({"y": 0.2},))
    monkeypatch.setattr("motions.music.choreography.MOVES", {**MOVES, "wild": wild})
    names = ["wild", "nod", "bob", "lunge"]
    assert wild in [item.move for item in compose(steady(80.0), 0, names).moves]
    dance, checked = feasible_dance(steady(80.0), 0, CHECKER, names)
    assert checked.report.ok
    assert wild not in [item.move for item in dance.moves]
    with pytest.raises(MotionInfeasible, match="dance 0"):
        feasible_dance(steady(80.0), 0, CHECKER, ["wild"])


def test_a_long_song_is_danced_for_three_minutes() -> None:
    assert 175.0 < compose(steady(90.0, 400.0), 0).timeline.end < 182.0


PERIOD = 0.002
PULSES = np.array([0.5, 1.5, 2.5])


def dance(*accents: Accent) -> Dance:
    return Dance(Timeline(), (PlacedMove(MOVES["nod"], 1),), accents, PULSES)


def run(turn: float, landing: float, yaw: float = 0.0) -> TruthRecording:
    """The trunk goes farthest to its left at ``turn``, and FR is down from ``landing`` on."""
    recorded = empty_recording(1500, np.zeros((1500, 4, 3)))
    time = 10.0 + PERIOD * np.arange(1500)
    q, forces = recorded.q.copy(), np.full((1500, 4), 30.0)
    left = 0.03 * np.exp(-(((time - 10.0 - turn) / 0.2) ** 2))
    q[:, 0], q[:, 1] = -np.sin(yaw) * left, np.cos(yaw) * left
    is_up = (time - 10.0 > landing - 0.3) & (time - 10.0 < landing)
    forces[is_up, Leg.FR] = 0.0
    rpy = np.zeros((1500, 3))
    rpy[:, 2] = yaw
    return replace(recorded, time=time, q=q, foot_forces=forces, rpy=rpy)


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_accents_are_found_where_they_happened(yaw: float) -> None:
    result = danced(run(1.53, 2.48, yaw), dance(Accent(1, "y", 1), Accent(2, "FR", 0)))
    assert result.wanted == pytest.approx([1.5, 2.5])
    assert result.happened == pytest.approx([1.53, 2.48], abs=2 * PERIOD)
    assert result.errors(PULSES) == pytest.approx([0.03, -0.02], abs=2 * PERIOD)
    assert result.share_on(PULSES) == 1.0


def test_an_accent_that_came_late_or_not_at_all_is_not_on_the_beat() -> None:
    accents = dance(Accent(1, "y", 1), Accent(2, "FR", 0), Accent(1, "FL", 0), Accent(2, "y", 1))
    result = danced(run(1.56, 2.5), accents)
    assert np.isnan(result.happened[2])  # FL never left the ground
    assert np.isnan(result.happened[3])  # the trunk only comes back: no turning point
    assert result.share_on(PULSES) == 0.25
