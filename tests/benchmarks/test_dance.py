"""The benchmark of dances judges with the beats that a song was made with, not with those heard."""

import numpy as np
import pytest

from benchmarks import dance
from benchmarks.dance import STUDIES, TEMPI, song_of
from motions.music import Beats, Song

SECONDS = 7.0


def test_a_seed_is_a_song_and_tempi_differ() -> None:
    assert song_of("song", 2).wav() == song_of("song", 2).wav()
    tempi = [60.0 / np.diff(song_of("clicks", seed).beats).mean() for seed in range(6)]
    assert len(np.unique(np.round(tempi, 1))) == 6
    assert TEMPI[0] < min(tempi) < max(tempi) < TEMPI[1]


@pytest.mark.parametrize(("late", "share"), [(0.0, 1.0), (0.1, 0.0)])
def test_a_dance_on_beats_that_were_heard_too_late_is_off_the_beat(
    late: float, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def heard(song: Song) -> Beats:
        return Beats(90.0, song.beats + late, np.ones(len(song.beats)), SECONDS, 1.0)

    monkeypatch.setattr(dance, "SECONDS", SECONDS)
    monkeypatch.setattr(dance, "heard", heard)
    values = STUDIES[0].run(3).values
    assert set(values) == {metric.name for metric in STUDIES[0].metrics}
    assert values["clicks.on_beat"] == share
    assert values["clicks.heard"] == pytest.approx(1000.0 * late, abs=1e-6)
    assert values["clicks.moves"] >= 4
