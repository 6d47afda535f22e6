"""Sounds from files, and to a file that every browser plays."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, MissingDependency

INSTALL_LINE = 'python -m pip install -e ".[music]"'
RATE = 22050
"""Samples per second that are kept, or made: librosa's default, half of a compact disc's."""
LONGEST = 900.0
"""Length [s] of the longest song: a quarter of an hour, so that no file fills the memory."""
COMPRESSION = 0.7
"""How far an MP3 file is made smaller, from 0 to 1: about 7 kB for a second."""

Sound = Float[np.ndarray, " m"]
"""Amplitudes from -1 to 1, ``RATE`` a second."""


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


def mp3_of(sound: Sound) -> bytes:
    """The sound as an MP3 file."""
    import soundfile

    stream = io.BytesIO()
    soundfile.write(stream, sound, RATE, format="MP3", compression_level=COMPRESSION)
    return stream.getvalue()
