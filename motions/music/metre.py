"""The bars of a song: how many beats one has, and on which beat the first begins.

A bar begins where the bass is strong and the harmony changes (Goto and Muraoka, "Real-time Beat
Tracking for Drumless Audio Signals", 1999). So of every metre and every first beat the one is taken
on whose beats both are farthest above the others', in standard errors.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from motions.music.songs import RATE, Sound

HEARD = (4, 3, 6)
"""Metres that are told apart, 6 of a waltz that is counted twice as fast as it is played; the first
one where nothing tells."""
WINDOW, HOP = 2048, 512
"""Samples of a frame (93 ms), long enough to tell tones apart, and from one to the next."""
BASS = slice(1, 15)
"""Rows of the spectrum up to 150 Hz."""
STROKE = 6
"""Frames (0.14 s) after a beat in which its bass is looked for."""

PerBeat = Float[np.ndarray, " k"]


def bars(sound: Sound, times: PerBeat, metre: int | None = None) -> tuple[int, int]:
    """Beats of a bar, and the number of the beat on which the first bar begins.

    Args:
        sound: of the song.
        times: instants [s] of its beats.
        metre: if it is known.
    """
    import librosa

    power = np.abs(librosa.stft(sound, n_fft=WINDOW, hop_length=HOP)) ** 2
    frames = np.minimum(np.round(times * RATE / HOP).astype(int), power.shape[1] - 1)
    chroma = librosa.feature.chroma_stft(S=power, sr=RATE, n_fft=WINDOW)
    heard = _standard(_bass(power[BASS].sum(axis=0), frames)) + _standard(_changes(chroma, frames))
    places = [(m, first) for m in ([metre] if metre else HEARD) for first in range(m)]
    return max(places, key=lambda place: _evidence(heard, *place))


def _bass(loudness: Float[np.ndarray, " n"], frames: Int[np.ndarray, " k"]) -> PerBeat:
    """How loud [log of power] the bass is about each beat."""
    return np.log([loudness[max(k - 2, 0) : k + STROKE].max() + 1e-6 for k in frames.tolist()])


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
