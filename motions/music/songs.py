"""Sounds from and to files, and synthetic songs: a click track, and drums with bass and chords.

Beat trackers and dances are measured on the latter: nothing needs to be downloaded, and the times
of their beats are known exactly.
"""

from __future__ import annotations

import io
import wave
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, MissingDependency, install_line
from go2_wbc.files import checked_output, write_atomically
from motions.arguments import positive

RATE = 22050
"""Samples per second that are kept, or made: librosa's default, half of a compact disc's."""
LONGEST = 900.0
"""Length [s] of the longest song: a quarter of an hour, so that no file fills the memory."""
COMPRESSION = 0.7  #: How far an MP3 file is made smaller, from 0 to 1: about 7 kB for a second
LEAD_IN = 0.5  #: Silence [s] before the first beat of a click track
CLICK_PITCH, ACCENT_PITCH = 1000.0, 1500.0  #: Pitch [Hz] of a click, and of the first one of a bar
METRES = (2, 3, 4)  #: Beats that a bar may have: 3 are a waltz's
LOUDNESS = 0.8  #: Greatest amplitude of a song, of 1
DRIFT = 0.01  #: By which share a made song's tempo rises or falls until its end, at most
JITTER = 0.004  #: Standard deviation [s] of a played note from its place: what good players have
SWING = 0.08  #: By which share of a beat the off-beats come late, at most

Sound = Float[np.ndarray, " m"]  #: Amplitudes from -1 to 1, ``RATE`` a second
Note = Float[np.ndarray, " j"]


def read_sound(path: Path | str) -> Sound:
    """The sound of a WAV, FLAC, OGG or MP3 file, as one channel.

    Raises:
        CommandError: if the file is missing, no sound, or longer than a quarter of an hour.
        MissingDependency: without the extra ``[music]``.
    """
    path = Path(path)
    try:
        import librosa
        import soundfile
    except (ImportError, OSError) as error:  # soundfile: OSError without its C library
        line = install_line("music")
        raise MissingDependency(f"music needs librosa ({error}): {line}") from error
    if not path.is_file():
        raise CommandError(f"{path}: there is no such file; give a song, such as song.wav")
    try:
        length = soundfile.info(str(path)).duration
        if length > LONGEST:
            raise CommandError(
                f"{path.name} is {length:.0f} s long, {LONGEST:.0f} s at most: cut it"
            )
        channels, rate = soundfile.read(str(path), dtype="float32", always_2d=True)
    except (RuntimeError, OSError) as error:  # soundfile's own error is a RuntimeError
        raise CommandError(
            f"{path.name} is no song that can be read; valid: WAV, FLAC, OGG, MP3 ({error})"
        ) from error
    if not np.isfinite(channels).all():
        raise CommandError(f"{path.name} is no song: it has samples that are no numbers")
    sound = channels.mean(axis=1)
    return librosa.resample(sound, orig_sr=rate, target_sr=RATE) if rate != RATE else sound


def mp3_of(sound: Sound) -> bytes:
    """The sound as an MP3 file."""
    import soundfile

    stream = io.BytesIO()
    soundfile.write(stream, sound, RATE, format="MP3", compression_level=COMPRESSION)
    return stream.getvalue()


@dataclass(frozen=True, slots=True)
class Song:
    """A sound with its beats.

    Attributes:
        name, samples, rate: for a person; amplitudes from -1 to 1; samples per second.
        beats: instants [s] of its beats.
    """

    name: str
    samples: Sound
    rate: int
    beats: Float[np.ndarray, " k"]

    @property
    def duration(self) -> float:
        """Length [s]."""
        return len(self.samples) / self.rate

    def wav(self) -> bytes:
        """The file, one channel of 16 bits."""
        stream = io.BytesIO()
        with wave.open(stream, "wb") as file:
            file.setnchannels(1)
            file.setsampwidth(2)
            file.setframerate(self.rate)
            file.writeframes(np.round(32767 * self.samples).astype("<i2").tobytes())
        return stream.getvalue()

    def save(self, path: Path | str) -> Path:
        """Write the WAV file.

        Raises:
            ConfigError: if it cannot be written, or its name does not end in ``.wav``.
        """
        return write_atomically(checked_output(path, [".wav"]), self.wav())


def click_track(bpm: float, seconds: float, metre: int = 4) -> Song:
    """A metronome: a click on every beat, a higher one on the first of each bar.

    Raises:
        TimelineError: for a tempo or a length that is not a number greater than 0.
        CommandError: for a bar that has not 2, 3 or 4 beats.
    """
    checked_metre(metre)
    positive("seconds", seconds)
    beats = np.arange(LEAD_IN, seconds - 0.1, 60.0 / positive("bpm", bpm))
    sound = np.zeros(round(seconds * RATE))
    for number, beat in enumerate(beats.tolist()):
        pitch = CLICK_PITCH if number % metre else ACCENT_PITCH
        _add(sound, beat, _tone(pitch, 0.03, decay=150.0))
    return Song(f"clicks at {bpm:g} beats/min", _levelled(sound), RATE, beats)


def checked_metre(metre: int) -> int:
    """How many beats a bar has, if one can have so many.

    Raises:
        CommandError: otherwise.
    """
    if metre not in METRES:
        raise CommandError(f"a bar has 2, 3 (a waltz) or 4 beats, got metre {metre!r}")
    return metre


def made_song(bpm: float, seconds: float, seed: int, metre: int = 4) -> Song:
    """Drums, bass and chords; ``seed`` chooses the patterns, the key and how it is played.

    The tempo drifts by up to 1 %, off-beats may swing, and no note is played exactly in its place;
    the beats are those of the score, and its first bar begins on the first one.

    Raises:
        TimelineError: for a tempo or a length that is not a number greater than 0.
        CommandError: for a bar that has not 2, 3 or 4 beats.
    """
    rng = np.random.default_rng(seed)
    beats = _score(positive("bpm", bpm), positive("seconds", seconds), rng)
    sound = np.zeros(round(seconds * RATE))
    player = _Player(sound, beats, rng, checked_metre(metre))
    player.drums()
    player.bass_and_chords()
    sound += 0.003 * rng.standard_normal(len(sound))
    return Song(f"made song {seed} at {bpm:g} beats/min", _levelled(sound), RATE, beats)


def _score(bpm: float, seconds: float, rng: np.random.Generator) -> Float[np.ndarray, " k"]:
    """Instants [s] of the beats, until shortly before the end."""
    first, drift = rng.uniform(0.1, 0.9), rng.uniform(-DRIFT, DRIFT)
    number = np.arange(int(seconds * bpm / 60.0 * (1.0 + DRIFT)) + 1)
    share = number / max(len(number), 1)
    beats = first + 60.0 / bpm * number * (1.0 + 0.5 * drift * share)
    return beats[beats < seconds - 0.1]


KICKS = {
    2: ((0,), (0, 1), (0, 1.5)),
    3: ((0,), (0,), (0, 2.5), (0, 1.5)),
    4: ((0, 2), (0, 2, 2.5), (0, 1, 2, 3), (0, 0.5, 2), (0, 1.5, 2)),
}
"""Beats of a bar on which the bass drum may play, by metre; one of these patterns."""
SNARES = {
    2: ((1,), (1, 1.5)),
    3: ((1, 2), (1, 2), (2,), (1, 2, 2.5)),
    4: ((1, 3), (1, 3), (1, 3, 3.5), (2,)),
}
HATS = (0.5, 1.0, 0.5, 0.25)  #: Beats from one stroke of the cymbal to the next
CHORDS = ((0, 5, 7, 0), (0, 9, 5, 7), (0, 7, 9, 5), (9, 5, 0, 7), (2, 7, 0, 0))
"""Roots, in semitones above the key, of four bars."""


@dataclass(frozen=True, slots=True)
class _Player:
    sound: Sound
    beats: Float[np.ndarray, " k"]
    rng: np.random.Generator
    metre: int

    def drums(self) -> None:
        rng, drums, claps = self.rng, KICKS[self.metre], SNARES[self.metre]
        kicks, snares = drums[rng.integers(len(drums))], claps[rng.integers(len(claps))]
        hats, swing = HATS[rng.integers(len(HATS))], rng.uniform(0.0, SWING)
        hat_gain = rng.uniform(0.05, 0.25)
        for bar in range(0, len(self.beats), self.metre):
            for place in kicks:
                self._play(bar + place, _kick(), rng.uniform(0.8, 1.0), swing)
            for place in snares:
                self._play(bar + place, _noise(rng, 0.15, 25.0), rng.uniform(0.3, 0.5), swing)
            for place in np.arange(0.0, self.metre, hats).tolist():
                self._play(bar + place, _noise(rng, 0.05, 90.0), hat_gain, swing)

    def bass_and_chords(self) -> None:
        rng = self.rng
        key, roots = 110.0 * 2 ** (rng.integers(-5, 6) / 12), CHORDS[rng.integers(len(CHORDS))]
        places = 0.5 * np.arange(2 * self.metre)
        line = tuple(rng.choice(places, 3, replace=False)) + (0,)
        for number, bar in enumerate(range(0, len(self.beats), self.metre)):
            root = key * 2 ** (roots[number % len(roots)] / 12)
            for place in line:
                self._play(bar + place, _tone(root / 2, 0.3, decay=6.0), 0.5, 0.0)
            length = min(self._when(bar + self.metre) - self._when(bar), 4.0)
            chord = sum(_tone(root * 2 ** (step / 12), length, decay=1.0) for step in (0, 4, 7))
            self._play(bar, np.asarray(chord), 0.12, 0.0)

    def _when(self, place: float) -> float:
        """Instant [s] of a beat of the score, or between two."""
        whole = int(min(place, len(self.beats) - 2))
        first, second = self.beats[whole], self.beats[whole + 1]
        return float(first + (place - whole) * (second - first))

    def _play(self, place: float, note: Note, gain: float, swing: float) -> None:
        if place > len(self.beats) - 1:
            return
        late = swing if place % 1.0 else 0.0
        when = self._when(place + late) + self.rng.normal(0.0, JITTER)
        _add(self.sound, when, gain * note)


def _tone(pitch: float, seconds: float, *, decay: float) -> Sound:
    t = np.arange(round(seconds * RATE)) / RATE
    waves = sum(np.sin(2 * np.pi * pitch * k * t) / k for k in (1, 2, 3))
    return np.minimum(t / 0.002, 1.0) * np.exp(-decay * t) * np.asarray(waves)


def _kick() -> Sound:
    t = np.arange(round(0.2 * RATE)) / RATE
    return np.exp(-18.0 * t) * np.sin(2 * np.pi * (50.0 * t + 4.0 * (1.0 - np.exp(-30.0 * t))))


def _noise(rng: np.random.Generator, seconds: float, decay: float) -> Sound:
    t = np.arange(round(seconds * RATE)) / RATE
    return np.exp(-decay * t) * rng.standard_normal(len(t))


def _add(sound: Sound, when: float, note: Note) -> None:
    start = max(round(when * RATE), 0)
    end = min(start + len(note), len(sound))
    sound[start:end] += note[: max(end - start, 0)]


def _levelled(sound: Sound) -> Sound:
    return LOUDNESS * sound / max(float(np.abs(sound).max()), 1e-9)
