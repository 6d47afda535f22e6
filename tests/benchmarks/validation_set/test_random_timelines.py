"""Random sentences of the motion language: the same ones every time, and rows of a sweep."""

import json
from itertools import pairwise

import pytest

from benchmarks import probability_runs
from benchmarks.probability import FITTED
from benchmarks.probability_runs import DRAWN, runs, seeds, trial
from benchmarks.validation_set.random_timelines import (
    FACTORS,
    RandomTimeline,
    random_timelines,
    sizes_of,
)
from go2_wbc.errors import TimelineError
from motions import Timeline
from motions.language.keys import BodyKey


def test_a_sentence_is_the_same_every_time_and_grows_in_amplitudes_and_times_only() -> None:
    for number in range(30):
        sizes = list(sizes_of(number))
        assert [one.step for one in sizes] == list(range(len(FACTORS)))
        assert [one.line.keys for one in sizes] == [one.line.keys for one in sizes_of(number)]
        for one, next_one in pairwise(sizes):
            assert (one.amplitude, one.pace) < (next_one.amplitude, next_one.pace)
    small, large = RandomTimeline(3, 0, 0.5, 1.0).line, RandomTimeline(3, 1, 1.0, 2.0).line
    kinds = [[type(key) for key in line.keys] for line in (small, large)]
    assert kinds[0] == kinds[1]
    moves = [[key for key in line.keys if isinstance(key, BodyKey)] for line in (small, large)]
    for less, more in zip(*moves, strict=True):
        assert more.value == pytest.approx(2.0 * less.value)
        assert more.end - more.start == pytest.approx(0.5 * (less.end - less.start))


def test_what_cannot_be_written_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(_: RandomTimeline) -> Timeline:
        raise TimelineError("a joint beyond what it may be")

    assert len(random_timelines(2)) == 2 * len(FACTORS)
    monkeypatch.setattr(RandomTimeline, "line", property(refused))
    assert random_timelines(2) == []


def test_sentences_are_fitted_to_and_come_after_the_exam(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(probability_runs, "drawn", lambda: random_timelines(2))
    assert DRAWN in FITTED
    assert seeds() == len(runs()) + 2 * len(FACTORS)
    assert seeds(3) == len(runs(3))
    row = trial(len(runs()))
    assert (row["motion"], row["half"], row["done"]) == ("sentence 0 0", DRAWN, True)
    assert json.loads(str(row["margins"]))["slip"] > 0.0
