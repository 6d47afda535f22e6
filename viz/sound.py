"""A sound as numbers, and as small as a page wants it."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd

import numpy as np
from jaxtyping import Float, UInt8
from scipy.signal import resample_poly

from go2_wbc.errors import ConfigError

PAGE_SAMPLE_RATE = 22050
"""Samples a second on a page: own choice, half of a CD's; enough for the beat and the tune."""
_COMPRESSION = 255.0  # mu of the mu-law of ITU-T G.711
_LEVELS = 127.0  # of a sign and seven bits


@dataclass(frozen=True, slots=True)
class Sound:
    """One channel of sound.

    Attributes:
        samples: (n,) between -1 and 1.
        rate: samples a second.
    """

    samples: Float[np.ndarray, " n"]
    rate: int

    def __post_init__(self) -> None:
        """Raise ConfigError for a rate that is none, or samples that are not finite."""
        if self.rate < 1:
            raise ConfigError(f"a sound needs 1 sample a second or more, got {self.rate}")
        if not np.isfinite(self.samples).all():
            raise ConfigError("a sound has samples that are not finite")


def packed_sound(sound: Sound, duration: float) -> UInt8[np.ndarray, " m"]:
    """The first ``duration`` seconds, a byte a sample, ``PAGE_SAMPLE_RATE`` of them a second.

    The bytes go with the logarithm of the amplitude (the continuous mu-law): 128 is silence, and
    quiet sounds keep as much of their detail as loud ones.
    """
    samples = sound.samples[: int(np.ceil(duration * sound.rate))]
    shared = gcd(PAGE_SAMPLE_RATE, sound.rate)
    if len(samples) and sound.rate != PAGE_SAMPLE_RATE:
        samples = resample_poly(samples, PAGE_SAMPLE_RATE // shared, sound.rate // shared)
    loudness = np.log1p(_COMPRESSION * np.minimum(np.abs(samples), 1.0)) / np.log1p(_COMPRESSION)
    return (128.0 + np.round(_LEVELS * np.sign(samples) * loudness)).astype(np.uint8)
