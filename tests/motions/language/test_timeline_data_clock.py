"""Beats as a measure of time: a steady tempo, and the beats of a song."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.errors import TimelineError
from motions import Timeline
from motions.language.keys import BalanceShift, LegKey
from motions.language.timeline_data import BeatClock

EXACT = 1e-9
SONG = (0.5, 1.0, 1.6, 2.4)
COUNTED = Timeline().on_beats(SONG)


@pytest.mark.parametrize(
    ("line", "instants"),
    [
        (COUNTED.at(1).body(z=-0.05, over=1).hold(1).home(over=1), (1.0, 1.6, 2.4, 3.2)),
        (COUNTED.at(0.5).body(z=-0.05, over=1.0), (0.75, 1.3)),  # evenly between two beats
        (COUNTED.body(z=-0.05, over=1.0), (0.0, 0.5)),  # before the first, as the first two
    ],
)
def test_moves_start_and_end_on_the_beats_of_a_song(
    line: Timeline, instants: tuple[float, ...]
) -> None:
    assert [t for key in line.keys for t in (key.start, key.end)] == pytest.approx(instants)


def test_before_a_raise_the_trunk_moves_aside_in_whole_beats() -> None:
    line = COUNTED.at(0).foot("FR", z=0.05, over=1)
    (shift,), (up,) = line.in_order(BalanceShift), line.in_order(LegKey)
    assert (shift.start, shift.end) == pytest.approx((0.5, 1.6))
    assert up.end == pytest.approx(2.4)


@given(st.floats(20.0, 300.0), st.floats(0.0, 50.0), st.floats(0.01, 20.0))
def test_even_beats_are_a_tempo(bpm: float, start: float, over: float) -> None:
    interval = 60.0 / bpm
    steady, song = BeatClock.steady(interval), BeatClock.of(interval * np.arange(12))
    assert song.at(start) == pytest.approx(steady.at(start), abs=1e-6)
    assert song.after(start, over) == pytest.approx(start + over * interval, abs=1e-6)


@given(st.lists(st.floats(0.05, 2.0), min_size=2, max_size=8), st.floats(0.0, 12.0))
def test_beats_that_pass_one_after_the_other_pass_together(gaps: list[float], over: float) -> None:
    clock = BeatClock.of(np.cumsum(gaps))
    halfway = clock.after(0.0, over / 2)
    assert clock.after(halfway, over / 2) == pytest.approx(clock.after(0.0, over), abs=1e-6)
    assert clock.at(len(gaps) - 1) == pytest.approx(clock.instants[-1])


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ((), "2 beats or more, got 0"),
        ((1.0,), "2 beats or more, got 1"),
        ((0.0, 1.0, 1.0), "beat 1 is at 1 s, beat 2 at 1 s"),
        ((-0.1, 1.0), "beat 0 must be at a time of 0 s or later"),
        ((0.0, float("nan")), "beat 1 must be"),
    ],
)
def test_beats_that_are_none_are_refused(times: tuple[float, ...], words: str) -> None:
    with pytest.raises(TimelineError, match=words):
        Timeline().on_beats(times)


@pytest.mark.parametrize(
    ("line", "beats"),
    [
        (COUNTED.at(1).body(z=-0.05, over=1).hold(1).home(over=1), (0.5, 1.0, 1.6, 2.4, 3.2)),
        (Timeline().body(z=-0.05, over=1.0), ()),
        (Timeline().hold(0.7).bpm(120).hold(2).bpm(60).hold(2), (0.7, 1.2, 1.7, 2.7, 3.7)),
        (Timeline().on_beats((0.0, 0.01)).hold(10), ()),  # nobody counts so fast
    ],
)
def test_a_motion_knows_its_beats_from_where_a_tempo_was_set(
    line: Timeline, beats: tuple[float, ...]
) -> None:
    assert line.beats == pytest.approx(beats)


def test_a_motion_that_follows_keeps_its_own_beats() -> None:
    slow, fast = Timeline().bpm(60).hold(1), Timeline().bpm(120).hold(2)
    line = slow.then(Timeline().hold(0.4), fast).hold(1)
    assert line.beats == pytest.approx([0.0, 1.0, 1.4, 1.9, 2.4, 3.4])
    assert line.scale_time(2.0).beats == pytest.approx([2.0 * beat for beat in line.beats])
    assert line.reverse().beats == pytest.approx([0.0, 1.0, 1.5, 2.0, 2.4, 3.4])
