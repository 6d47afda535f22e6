"""``beats``: the tempo and the beats of a song, found with librosa (extra ``[music]``).

librosa reads how strongly notes begin and places beats by dynamic programming (Ellis, "Beat
Tracking by Dynamic Programming", 2007). Around that: the tempo is chosen among several by how well
all of the song agrees with it, and every beat is placed where the notes around it say, so that the
error is a few milliseconds and no frame of the analysis.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, MissingDependency

INSTALL_LINE = 'python -m pip install "go2-wbc[music]"'
RATE = 22050
"""Samples per second that are looked at: librosa's default."""
HOP, WINDOW = 128, 512
"""Samples from one frame to the next (5.8 ms), and of a frame (23 ms): short, to tell when a note
begins; librosa's defaults are 512 and 2048."""
BANDS = 40
"""Bands of pitch whose rises in loudness are added up."""
LATENESS = 0.0061
"""How late [s] the beginning of a note is found, beyond librosa's own correction: mean of 71
songs of ``songs``, the tuning seeds 0 to 59 and eleven click tracks; 0.5 ms from song to song."""
LONGEST = 900.0
"""Length [s] of the longest song: a quarter of an hour, so that no file fills the memory."""
LEAST_BEATS = 4
"""A bar: fewer are no song."""
SILENCE = 1e-4
"""Amplitude, of 1, below which all is silent: the last step of 14 bits."""
SLOWEST, FASTEST = 50.0, 210.0
"""Tempi [beats/min] that are looked for."""
USUAL_TEMPO, TEMPO_SPREAD = 120.0, 1.5
"""Where tempi are likely [beats/min], and how far [octaves]: librosa's mean; the spread was chosen
on the tuning seeds, of which it finds 66 of 71 as they are counted, 3 by halves, 2 doubled."""
MULTIPLES = 8
"""How many beats later a song is still compared with itself."""
CANDIDATES = 8
"""Tempi that are tried."""
TIGHTNESS = 300.0
"""How little the tempo may change from beat to beat; librosa's default is 100."""
LEAST_AGREEMENT = 0.08
"""Mean correlation of a song with itself 1 to 8 beats later, below which it has no beat."""
SNAP = 0.05
"""How far [s] the loudest beginning of a note may be from a beat that it tells."""
NEIGHBOURS = 8
"""Beats before and after one that say with it where it is."""
OUTLIER = 0.01
"""Distance [s] from a straight line of beats from which on a note counts less."""

Frames = Float[np.ndarray, " n"]
Times = Float[np.ndarray, " k"]


@dataclass(frozen=True, slots=True)
class Beats:
    """The beats of a song.

    Attributes:
        tempo: mean tempo [beats/min].
        times: instants [s] of the beats, from the start of the file.
        strengths: how strongly notes begin there, 1 for the strongest.
        duration: length [s] of the song.
        agreement: how regular it is: its mean correlation with itself 1 to 8 beats later, at
            most 1.
    """

    tempo: float
    times: Times
    strengths: Times
    duration: float
    agreement: float


def beats(path: Path | str) -> Beats:
    """The beats of a song: a WAV, FLAC, OGG or MP3 file.

    A song may be counted twice as fast or half as fast as its players did; that is no error.

    Raises:
        CommandError: if the file is missing, no sound, longer than a quarter of an hour, silent, or
            has no four beats or no steady ones.
        MissingDependency: without the extra ``[music]``.
    """
    sound, name = _read(Path(path)), Path(path).name
    if len(sound) < WINDOW or float(np.abs(sound).max()) < SILENCE:
        raise CommandError(f"{name} is silent: there is no beat in it")
    onsets = _onsets(sound)
    agreement, frames = _best_beats(onsets, name)
    placed = _placed(frames, onsets)
    times = placed - LATENESS
    kept = (times >= 0.0) & (times <= len(sound) / RATE)
    times, strengths = times[kept], _near(onsets, frames)[kept]
    if len(times) < LEAST_BEATS:
        raise CommandError(
            f"{name} has {len(times)} beats, {LEAST_BEATS} are needed: is it cut short?"
        )
    return Beats(
        tempo=60.0 * (len(times) - 1) / float(times[-1] - times[0]),
        times=times,
        strengths=strengths / max(float(strengths.max()), 1e-9),
        duration=len(sound) / RATE,
        agreement=agreement,
    )


def _read(path: Path) -> Frames:
    """The sound of a file, one channel, ``RATE`` samples a second."""
    try:
        import librosa
        import soundfile
    except (ImportError, OSError) as error:  # soundfile: OSError without its C library
        raise MissingDependency(f"music needs librosa ({error}): {INSTALL_LINE}") from error
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


def _onsets(sound: Frames) -> Frames:
    """How strongly notes begin, in every frame."""
    import librosa

    power = librosa.feature.melspectrogram(
        y=sound, sr=RATE, n_fft=WINDOW, hop_length=HOP, n_mels=BANDS
    )
    return librosa.onset.onset_strength(
        S=librosa.power_to_db(power), sr=RATE, hop_length=HOP, n_fft=WINDOW
    )


def _best_beats(onsets: Frames, name: str) -> tuple[float, Float[np.ndarray, " k"]]:
    """How well the song agrees with its tempo, and the frames of its beats.

    Of the tempi at which the song is like itself, the one whose beats meet the strongest notes.
    """
    import librosa

    best, found = 0.0, None
    for bpm, agreement in _tempi(onsets):
        _, frames = librosa.beat.beat_track(
            onset_envelope=onsets,
            sr=RATE,
            hop_length=HOP,
            bpm=bpm,
            tightness=TIGHTNESS,
            trim=False,
        )
        likely = np.exp(-0.5 * (np.log2(bpm / USUAL_TEMPO) / TEMPO_SPREAD) ** 2)
        if len(frames) < LEAST_BEATS:
            continue
        score = agreement * float(_near(onsets, frames).mean()) * float(likely)
        if score > best:
            best, found = score, (agreement, np.asarray(frames))
    if found is None:
        raise CommandError(
            f"{name} has no steady beat: it does not repeat at any tempo from {SLOWEST:.0f} to "
            f"{FASTEST:.0f} beats/min for {LEAST_BEATS} beats"
        )
    return found


def _tempi(onsets: Frames) -> list[tuple[float, float]]:
    """Tempi [beats/min] at which the song is like itself, and how much; the best first."""
    import librosa

    rate, centred = RATE / HOP, onsets - onsets.mean()
    longest = int(MULTIPLES * 60.0 / SLOWEST * rate) + 2
    likeness = librosa.autocorrelate(centred, max_size=longest)
    likeness = likeness / max(float(likeness[0]), 1e-9)
    bpm = np.geomspace(SLOWEST, FASTEST, 600)
    lags = np.outer(60.0 * rate / bpm, np.arange(1, MULTIPLES + 1))
    means = np.interp(lags, np.arange(len(likeness)), likeness, right=0.0).mean(axis=1)
    inner = means[1:-1]
    peaks = 1 + np.flatnonzero((inner > means[:-2]) & (inner >= means[2:]))
    peaks = peaks[means[peaks] > LEAST_AGREEMENT]
    in_order = peaks[np.argsort(-means[peaks])][:CANDIDATES]
    return [(float(bpm[peak]), float(means[peak])) for peak in in_order]


def _near(onsets: Frames, frames: Float[np.ndarray, " k"]) -> Times:
    """How strongly notes begin about these frames."""
    hat = np.hanning(9)
    return np.convolve(onsets, hat / hat.sum(), "same")[frames]


def _placed(frames: Float[np.ndarray, " k"], onsets: Frames) -> Times:
    """Instants [s] of the beats: on a line through the notes that begin about each."""
    reach = round(SNAP * RATE / HOP)
    rows = frames[:, None] + np.arange(-reach, reach + 1)
    around = np.where(
        (rows >= 0) & (rows < len(onsets)), onsets[np.clip(rows, 0, len(onsets) - 1)], 0.0
    )
    notes = (frames - reach + around.argmax(axis=1)) * (HOP / RATE)
    weights = around.max(axis=1) + 1e-9
    return np.array([_on_line(row, notes, weights) for row in range(len(frames))])


def _on_line(row: int, notes: Times, weights: Times) -> float:
    """Where beat ``row`` is, by itself and its neighbours: a line, from which outliers count little.

    Iteratively reweighted least squares with Cauchy's weights.
    """
    first, last = max(row - NEIGHBOURS, 0), row + NEIGHBOURS + 1
    number, note, weight = (
        np.arange(first, first + len(notes[first:last])) - row,
        *(values[first:last] for values in (notes, weights)),
    )
    share = np.ones(len(note))
    line = np.zeros(2)
    for _ in range(5):
        line = np.polyfit(number, note, 1, w=np.sqrt(weight * share))
        share = 1.0 / (1.0 + ((note - np.polyval(line, number)) / OUTLIER) ** 2)
    return float(line[1])
