"""A sound file beside a motion's, as the page of the studio draws and plays it."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from go2_wbc.errors import Go2WbcError, unknown_name

SUFFIXES = (".wav", ".mp3", ".ogg", ".flac")  #: Of files that are offered
PEAK_RATE = 100  #: Bars of the waveform a second
_LOUDEST = 255  #: of a waveform's byte


def songs_beside(file: Path) -> list[str]:
    """Names of the sound files in the folder of a file."""
    return sorted(path.name for path in file.parent.iterdir() if path.suffix.lower() in SUFFIXES)


def sound_of(path: Path) -> bytes:
    """A song as a page plays it, an MP3 file.

    Raises:
        CommandError: if it cannot be read.
        MissingDependency: without the extra ``[music]``.
    """
    from motions.music.songs import mp3_of, read_sound

    return mp3_of(read_sound(path))


def music(file: Path, order: Mapping[str, object]) -> dict[str, object]:
    """The beats and the sound of the song of this ``name`` beside a file, or why there are none."""
    name, known = order.get("name"), songs_beside(file)
    if not isinstance(name, str) or name not in known:
        return {"error": unknown_name("song", str(name), known)}
    try:
        return heard(file.with_name(name))
    except Go2WbcError as error:
        return {"error": str(error)}


def heard(path: Path) -> dict[str, object]:
    """The beats of a song, its waveform and its sound, as for JSON.

    Raises:
        CommandError: if it cannot be read, or has no steady beat.
        MissingDependency: without the extra ``[music]``.
    """
    from motions.music import beats
    from motions.music.songs import RATE, mp3_of, read_sound

    found, sound = beats(path), read_sound(path)
    step = RATE // PEAK_RATE
    whole = np.abs(np.pad(sound, (0, -len(sound) % step))).reshape(-1, step).max(axis=1)
    peaks = np.round(_LOUDEST * whole / max(float(whole.max()), 1e-9)).astype(np.uint8)
    return {
        "beats": np.round(found.times, 4).tolist(),
        "metre": found.metre,
        "downbeat": found.downbeat,
        "tempo": found.tempo,
        "peaks": base64.b64encode(peaks.tobytes()).decode("ascii"),
        "peak_rate": RATE / step,
        "sound": base64.b64encode(mp3_of(sound)).decode("ascii"),
    }
