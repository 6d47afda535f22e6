"""Songs made by code: their beats are where they sound, and the same seed is the same song."""

import io
import wave
from pathlib import Path

import numpy as np
import pytest

from go2_wbc.errors import ConfigError, TimelineError
from motions.music import Song, click_track, made_song

LOOK = 0.02  # s, before and after a beat


def test_a_song_has_its_clicks_its_tempo_and_is_that_of_its_seed() -> None:
    song = click_track(100.0, 10.0)
    assert np.diff(song.beats) == pytest.approx(0.6)
    for beat in song.beats:
        assert _loudness(song, beat, beat + LOOK) > 0.1
        assert _loudness(song, beat - LOOK, beat - 0.001) < 1e-3
    for seed in range(3):
        tempo = 60.0 / np.diff(made_song(120.0, 30.0, seed).beats)
        assert np.abs(tempo / 120.0 - 1.0).max() < 0.011
    first, again, other = (made_song(110.0, 5.0, seed).wav() for seed in (3, 3, 4))
    assert first == again
    assert first != other


@pytest.mark.parametrize("seed", range(6))
def test_a_made_song_has_a_stroke_on_its_beats(seed: int) -> None:
    """Not on each, and no note is played exactly; but with every bar's first one."""
    song = made_song(96.0, 20.0, seed)
    first_of_bars = song.beats[:-4:4]
    louder = [
        _loudness(song, beat, beat + LOOK) > _loudness(song, beat - 2 * LOOK, beat - LOOK)
        for beat in first_of_bars
    ]
    assert np.mean(louder) > 0.8


def test_a_song_is_a_wav_file_of_its_length(tmp_path: Path) -> None:
    song = made_song(120.0, 5.0, 1)
    with wave.open(io.BytesIO(song.save(tmp_path / "song.wav").read_bytes())) as file:
        assert file.getnframes() / file.getframerate() == pytest.approx(song.duration)
    assert np.abs(song.samples).max() <= 1.0
    with pytest.raises(ConfigError, match=r"valid: \.wav"):
        song.save(tmp_path / "song.mp3")


@pytest.mark.parametrize(("bpm", "seconds"), [(0.0, 10.0), (120.0, -1.0), (float("nan"), 10.0)])
def test_songs_without_tempo_or_length_are_refused(bpm: float, seconds: float) -> None:
    for make in (click_track, lambda b, s: made_song(b, s, 0)):
        with pytest.raises(TimelineError, match="must be a number above 0"):
            make(bpm, seconds)


def _loudness(song: Song, start: float, end: float) -> float:
    part = song.samples[round(start * song.rate) : round(end * song.rate)]
    return float(np.sqrt((part**2).mean()))
