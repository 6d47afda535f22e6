"""``beats``: the tempo, the beats and the bars of a song, found with librosa (extra ``[music]``).

librosa computes the onset strength and places beats by dynamic programming (Ellis, "Beat Tracking
by Dynamic Programming", 2007). In addition, the tempo is chosen among several by how well it fits
the whole song, and every beat is placed by the onsets around it, so that the error is a few
milliseconds and not a frame of the analysis.

A bar begins where the bass is strong and the harmony changes (Goto and Muraoka, "Real-time Beat
Tracking for Drumless Audio Signals", 1999). So of all metres and first beats the one is taken for
which both are highest above the other beats, in standard errors. Where there is no bass, as of
clicks, strokes that are louder or higher begin the bars.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import CommandError
from motions.music.songs import RATE, Sound, checked_metre, read_sound

HOP, WINDOW = 128, 512
"""Samples from one frame to the next (5.8 ms), and of a frame (23 ms): short, to tell when a note
begins; librosa's defaults are 512 and 2048."""
BANDS = 40  #: Bands of pitch whose rises in loudness are added up
LATENESS = 0.0061
"""How late [s] the beginning of a note is found, beyond librosa's own correction: mean of 71
songs of ``songs``, the tuning seeds 0 to 59 and eleven click tracks; 0.5 ms from song to song."""
LEAST_BEATS = 4  #: A bar: fewer are no song
SILENCE = 1e-4  #: Amplitude, of 1, below which all is silent: the last step of 14 bits
QUIET = 0.01  #: Share of the greatest amplitude below which a song has not begun, or is over
SLOWEST, FASTEST = 50.0, 210.0  #: Tempi [beats/min] that are looked for
USUAL_TEMPO, TEMPO_SPREAD = 120.0, 1.5
"""Where tempi are likely [beats/min], and how far [octaves]: librosa's mean; the spread was chosen
on the tuning seeds, of which it finds 66 of 71 as they are counted, 3 by halves, 2 doubled."""
MULTIPLES = 8  #: How many beats later a song is still compared with itself
CANDIDATES = 8  #: Tempi that are tried
TIGHTNESS = 300.0  #: How little the tempo may change from beat to beat; librosa's default is 100
LEAST_AGREEMENT = 0.08
"""Mean correlation of a song with itself 1 to 8 beats later, below which it has no beat."""
LEAST_RISE = 0.5
"""Rise in loudness [dB] at the mean beat, below which it is none: songs have 6 and more, a steady
tone 0.02."""
SNAP = 0.05  #: How far [s] the loudest beginning of a note may be from a beat that it tells
NEIGHBOURS = 8  #: Beats before and after one that say with it where it is
OUTLIER = 0.01  #: Distance [s] from a straight line of beats from which on a note counts less

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
        metre: beats of a bar, 3 for a waltz, 6 for one that is counted twice as fast; 1 where no
            bars are known.
        downbeat: number of the beat, from 0, on which the first bar begins.
    """

    tempo: float
    times: Times
    strengths: Times
    duration: float
    agreement: float
    metre: int = 1
    downbeat: int = 0

    __repr__ = brief


@typed()
def beats(path: Path | str, metre: int | None = None) -> Beats:
    """The beats and the bars of a song: a WAV, FLAC, OGG or MP3 file.

    A song may be counted twice as fast or half as fast as its players did; that is no error.

    Args:
        path: the file.
        metre: beats of a bar, 2, 3 or 4; by default 3 or 4, whichever is heard.

    Raises:
        CommandError: if the file is missing, no sound, longer than a quarter of an hour, silent, or
            has no four beats or no steady ones; for another metre.
        MissingDependency: without the extra ``[music]``.
    """
    if metre is not None:
        checked_metre(metre)
    sound, name = read_sound(path), Path(path).name
    if len(sound) < WINDOW or float(np.abs(sound).max()) < SILENCE:
        raise CommandError(f"{name} is silent: there is no beat in it")
    onsets = _onsets(sound)
    agreement, frames = _best_beats(onsets, name)
    times = _placed(frames, onsets) - LATENESS
    heard = np.flatnonzero(np.abs(sound) > QUIET * np.abs(sound).max()) / RATE
    times = times[(times >= max(heard[0] - SNAP, 0.0)) & (times <= heard[-1])]
    frames = np.round((times + LATENESS) * RATE / HOP).astype(int)
    strengths = _near(onsets, np.minimum(frames, len(onsets) - 1))
    if len(times) < LEAST_BEATS:
        raise CommandError(f"{name} has {len(times)} beats, a song has {LEAST_BEATS} or more")
    in_a_bar, downbeat = bars(sound, times, metre)
    return Beats(
        tempo=60.0 * (len(times) - 1) / float(times[-1] - times[0]),
        times=times,
        strengths=strengths / max(float(strengths.max()), 1e-9),
        duration=len(sound) / RATE,
        agreement=agreement,
        metre=in_a_bar,
        downbeat=downbeat,
    )


def _onsets(sound: Sound) -> Frames:
    """How strongly notes begin, in every frame."""
    import librosa

    power = librosa.feature.melspectrogram(
        y=sound, sr=RATE, n_fft=WINDOW, hop_length=HOP, n_mels=BANDS
    )
    return librosa.onset.onset_strength(
        S=librosa.power_to_db(power), sr=RATE, hop_length=HOP, n_fft=WINDOW
    )


def _best_beats(onsets: Frames, name: str) -> tuple[float, Int[np.ndarray, " k"]]:
    """How well the song agrees with its tempo, and the frames of its beats.

    Of the tempi at which the song is like itself, the one whose beats meet the strongest notes.
    """
    import librosa

    best, found = 0.0, None
    for bpm, agreement in _tempi(onsets):
        _, frames = librosa.beat.beat_track(
            onset_envelope=onsets, sr=RATE, hop_length=HOP, bpm=bpm, tightness=TIGHTNESS, trim=False
        )
        likely = np.exp(-0.5 * (np.log2(bpm / USUAL_TEMPO) / TEMPO_SPREAD) ** 2)
        if len(frames) < LEAST_BEATS:
            continue
        rise = float(_near(onsets, frames).mean())
        score = agreement * rise * float(likely)
        if rise > LEAST_RISE and score > best:
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


def _near(onsets: Frames, frames: Int[np.ndarray, " k"]) -> Times:
    """How strongly notes begin about these frames."""
    hat = np.hanning(9)
    return np.convolve(onsets, hat / hat.sum(), "same")[frames]


def _placed(frames: Int[np.ndarray, " k"], onsets: Frames) -> Float[np.ndarray, " j"]:
    """Instants [s] of all beats of the song, from those that were found.

    Dynamic programming loses the beat where a song begins and ends. So only its most regular
    stretch is kept, and followed from there to both ends.
    """
    near = [_note(frame, onsets) for frame in frames.tolist()]
    notes, weights = map(np.array, zip(*near, strict=True))
    length = min(2 * NEIGHBOURS + 1, len(notes))
    first = min(range(len(notes) - length + 1), key=lambda i: _unevenness(notes[i : i + length]))
    stretch = slice(first, first + length)
    notes, weights = _followed(notes[stretch], weights[stretch], onsets)
    last = len(onsets) - 1.0
    turned = _followed((last - notes)[::-1], weights[::-1], onsets[::-1])
    notes, weights = (last - turned[0])[::-1], turned[1][::-1]
    rows = np.arange(len(notes))
    parts = [slice(max(row - NEIGHBOURS, 0), row + NEIGHBOURS + 1) for row in rows.tolist()]
    placed = [_line(rows[part] - row, notes[part], weights[part]) for row, part in enumerate(parts)]
    return np.array([line[1] for line in placed]) * (HOP / RATE)


def _followed(
    notes: Times, weights: Times, onsets: Frames
) -> tuple[Float[np.ndarray, " j"], Float[np.ndarray, " j"]]:
    """Notes [frames] on the beat, and their weights, to the end of the song."""
    while True:
        numbers = np.arange(-min(NEIGHBOURS, len(notes)), 0)
        interval, place = _line(numbers, notes[numbers], weights[numbers])
        following = place if place > notes[-1] else notes[-1] + interval
        if not (interval > 1.0 and following < len(onsets)):
            return notes, weights
        note, weight = _note(following, onsets)
        notes, weights = np.append(notes, note), np.append(weights, weight)


def _note(place: float, onsets: Frames) -> tuple[float, float]:
    """Frame and strength of the note that is meant by the beat at the frame ``place``."""
    reach, middle = round(SNAP * RATE / HOP), round(place)
    rows = np.arange(max(middle - reach, 0), min(middle + reach + 1, len(onsets)))
    likely = onsets[rows] * np.cos(0.5 * np.pi * (rows - place) / (reach + 1))
    best = int(likely.argmax())
    if likely[best] <= 0.0:
        return place, 1e-6
    return float(rows[best]), float(likely[best])


def _unevenness(notes: Times) -> float:
    """How far notes are from equal distances: the median of the distances from a line."""
    number = np.arange(len(notes))
    return float(np.median(np.abs(notes - np.polyval(np.polyfit(number, notes, 1), number))))


def _line(numbers: Int[np.ndarray, " k"], notes: Times, weights: Times) -> Float[np.ndarray, "2"]:
    """Slope and value at 0 of a line through notes [frames], on which outliers have little say.

    Iteratively reweighted least squares with Cauchy's weights.
    """
    share, line = np.ones(len(notes)), np.zeros(2)
    for _ in range(5):
        line = np.polyfit(numbers, notes, 1, w=np.sqrt(weights * share))
        off = (notes - np.polyval(line, numbers)) * (HOP / RATE)
        share = 1.0 / (1.0 + (off / OUTLIER) ** 2)
    return line


HEARD = (4, 3, 6)
"""Metres that are told apart, 6 of a waltz that is counted twice as fast as it is played; the first
one where nothing tells."""
BAR_WINDOW, BAR_HOP = 2048, 512
"""Samples of a frame (93 ms), long enough to tell tones apart, and from one to the next."""
BASS = slice(1, 15)  #: Rows of the spectrum up to 150 Hz
LEAST_BASS = 0.01  #: Share of a song's power, below which its bass tells no bars: own choice
STROKE = 6  #: Frames (0.14 s) after a beat in which its bass is looked for

PerBeat = Float[np.ndarray, " k"]


def bars(sound: Sound, times: PerBeat, metre: int | None = None) -> tuple[int, int]:
    """Beats of a bar, and the number of the beat on which the first bar begins.

    Args:
        sound: of the song.
        times: instants [s] of its beats.
        metre: if it is known.
    """
    import librosa

    power = np.abs(librosa.stft(sound, n_fft=BAR_WINDOW, hop_length=BAR_HOP)) ** 2
    frames = np.minimum(np.round(times * RATE / BAR_HOP).astype(int), power.shape[1] - 1)
    chroma = librosa.feature.chroma_stft(S=power, sr=RATE, n_fft=BAR_WINDOW)
    loudness = power[BASS].sum(axis=0)
    near = [loudness[max(k - 2, 0) : k + STROKE].max() + 1e-6 for k in frames.tolist()]
    heard = _standard(np.log(near)) + _standard(_changes(chroma, frames))
    if loudness.sum() < LEAST_BASS * power.sum():
        heard = _accents(power, frames)
    places = [(m, first) for m in ([metre] if metre else HEARD) for first in range(m)]
    return max(places, key=lambda place: _evidence(heard, *place))


def _accents(power: Float[np.ndarray, "b n"], frames: Int[np.ndarray, " k"]) -> PerBeat:
    """How much louder, or higher, the stroke of each beat is than others: of clicks and claps."""
    strokes = np.stack([power[:, k : k + STROKE].sum(axis=1) for k in frames.tolist()], axis=1)
    whole = strokes.sum(axis=0) + 1e-9
    height = np.arange(len(power)) @ strokes / whole + 1e-9
    return np.log(whole) + np.log(height)


def _changes(chroma: Float[np.ndarray, "12 n"], frames: Int[np.ndarray, " k"]) -> PerBeat:
    """How much the harmony of each beat differs from that of the one before: 1 - cosine."""
    parts = zip(frames.tolist(), [*frames[1:].tolist(), chroma.shape[1]], strict=True)
    means = np.array([chroma[:, k : max(end, k + 1)].mean(axis=1) for k, end in parts])
    means /= np.maximum(np.linalg.norm(means, axis=1, keepdims=True), 1e-9)
    changes = 1.0 - np.sum(means[1:] * means[:-1], axis=1)
    return np.append(np.median(changes), changes)


def _standard(values: PerBeat) -> PerBeat:
    return (values - values.mean()) / max(float(values.std()), 1e-9)


def _evidence(heard: PerBeat, metre: int, first: int) -> float:
    """How far the first beats of bars are above the others, in standard errors."""
    begins = np.arange(len(heard)) % metre == first
    return float((heard[begins].mean() - heard[~begins].mean()) * np.sqrt(begins.sum()))
