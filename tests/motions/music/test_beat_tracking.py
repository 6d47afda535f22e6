"""The beats of songs whose beats are known, and files that are no songs.

Tempi and seeds are others than those on which the beat finder was tuned.
"""

import sys
import wave
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from go2_wbc.errors import CommandError, MissingDependency
from motions import beats
from motions.music import Song, click_track, made_song
from motions.music.songs import RATE

NEAR = 0.012  # s; half of a frame of the analysis, and what the judged songs keep
SECONDS = 12.0


@pytest.fixture(autouse=True)
def _needs_the_extra(request: pytest.FixtureRequest) -> None:
    if "without_the_extra" not in request.fixturenames:
        pytest.importorskip("librosa", reason="needs the extra [music]")


@pytest.fixture
def without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "librosa", None)


def saved(song: Song, folder: Path) -> Path:
    return song.save(folder / "song.wav")


@pytest.mark.parametrize(("bpm", "loudness"), [(73.0, 1.0), (101.0, 0.03), (133.0, 1.0)])
def test_the_clicks_of_a_metronome_are_its_beats_however_loud(
    bpm: float, loudness: float, tmp_path: Path
) -> None:
    song = click_track(bpm, SECONDS)
    found = beats(saved(replace(song, samples=loudness * song.samples), tmp_path))
    assert found.tempo == pytest.approx(bpm, rel=0.01)
    assert found.times == pytest.approx(song.beats, abs=NEAR)
    assert found.duration == pytest.approx(SECONDS)
    assert found.strengths.max() == 1.0


@pytest.mark.parametrize("seed", [7001, 7002, 7003, 7004])
def test_every_beat_of_a_made_song_is_found(seed: int, tmp_path: Path) -> None:
    """From the first to the last: dynamic programming alone loses those at the ends."""
    song = made_song(float(np.random.default_rng(seed).uniform(85.0, 140.0)), 30.0, seed)
    found = beats(saved(song, tmp_path))
    distances = np.abs(song.beats[:, None] - found.times).min(axis=1)
    assert distances.max() < NEAR
    assert len(found.times) - len(song.beats) in (0, 1)  # one may be counted as the song dies away


@pytest.mark.parametrize("metre", [3, 4])
@pytest.mark.parametrize("seed", [7101, 7102])
def test_a_waltz_is_a_waltz(metre: int, seed: int, tmp_path: Path) -> None:
    """Its bars are found, and where they begin; and it can be said what they are."""
    song = made_song(96.0, 20.0, seed, metre)
    found = beats(saved(song, tmp_path))
    assert found.metre == metre
    firsts = found.times[found.downbeat :: metre]
    assert np.abs(song.beats[::metre][:, None] - firsts).min(axis=0).max() < NEAR
    assert beats(saved(song, tmp_path), 7 - metre).metre == 7 - metre
    cut = song.samples[round((song.beats[1] - 0.2) * RATE) :]  # it begins on the second beat
    assert beats(sound(cut, tmp_path)).downbeat == metre - 1


@pytest.mark.parametrize("missing", [1, 2, 3])
def test_the_bars_of_a_click_track_begin_on_its_accents_behind_a_pick_up(
    missing: int, tmp_path: Path
) -> None:
    """It has no bass, by which the bars of music are told."""
    song = click_track(100.0, SECONDS)
    cut = song.samples[round((song.beats[missing] - 0.2) * RATE) :]
    found = beats(sound(cut, tmp_path))
    assert (found.metre, found.downbeat) == (4, 4 - missing)


def test_a_file_of_two_channels_at_another_rate_is_read(tmp_path: Path) -> None:
    song, rate = click_track(90.0, SECONDS), 48000
    times = np.arange(round(SECONDS * rate)) / rate
    samples = np.interp(times, np.arange(len(song.samples)) / RATE, song.samples)
    path = tmp_path / "stereo.wav"
    with wave.open(str(path), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(np.repeat(32767 * samples, 2).astype("<i2").tobytes())
    assert beats(path).times == pytest.approx(song.beats, abs=NEAR)


def sound(samples: np.ndarray, folder: Path) -> Path:
    return saved(Song("sound", samples, RATE, np.zeros(0)), folder)


def a_tone() -> np.ndarray:
    return 0.5 * np.sin(0.1 * np.arange(5 * RATE))


def noise() -> np.ndarray:
    return 0.1 * np.random.default_rng(0).standard_normal(10 * RATE)


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        (np.zeros(5 * RATE), "song.wav is silent"),
        (np.zeros(0), "song.wav is silent"),
        (a_tone(), "song.wav has no steady beat"),
        (noise(), "song.wav has no steady beat"),
        (click_track(120.0, 1.3).samples, "no steady beat"),
        (click_track(60.0, 3.3).samples, "song.wav has"),
    ],
)
def test_a_sound_without_a_beat_is_refused(samples: np.ndarray, words: str, tmp_path: Path) -> None:
    with pytest.raises(CommandError, match=words):
        beats(sound(samples, tmp_path))


def test_what_is_no_song_or_lasts_hours_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "words.wav"
    path.write_text("la la la", encoding="utf-8")
    with pytest.raises(CommandError, match=r"words.wav is no song that can be read; valid: WAV"):
        beats(path)
    for missing in (tmp_path / "none.wav", tmp_path):
        with pytest.raises(CommandError, match="there is no such file"):
            beats(missing)
    monkeypatch.setattr("motions.music.songs.LONGEST", 5.0)
    with pytest.raises(CommandError, match="is 12 s long, 5 s at most"):
        beats(saved(click_track(90.0, SECONDS), tmp_path))


@pytest.mark.usefixtures("without_the_extra")
def test_without_the_extra_the_error_names_it(tmp_path: Path) -> None:
    with pytest.raises(MissingDependency, match=r'install "go2-wbc\[music\]"'):
        beats(saved(click_track(90.0, 4.0), tmp_path))
