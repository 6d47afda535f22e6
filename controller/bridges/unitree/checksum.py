"""Unitree's checksum: CRC-32 over the 32-bit words of the C struct, the last one excepted.

Polynomial 0x04C11DB7, initial value 0xFFFFFFFF, most significant bit first, no final inversion
(``crc32_core`` of unitree_sdk2). ``zlib`` has the same polynomial with all bits reversed, so the
words are fed to it mirrored: a hundred times faster than the loop, and bit by bit the same.
"""

from __future__ import annotations

import zlib
from typing import Final

import numpy as np
from jaxtyping import Shaped

_MIRRORED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def checksum(message: Shaped[np.ndarray, "1"]) -> int:
    """What the field ``crc`` of a low-level message must be."""
    words = message.view("<u4")[:-1].byteswap().tobytes()
    mirrored = zlib.crc32(words.translate(_MIRRORED)) ^ 0xFFFFFFFF
    return int.from_bytes(mirrored.to_bytes(4, "little").translate(_MIRRORED), "big")


def seal(message: Shaped[np.ndarray, "1"]) -> None:
    """Write the checksum into a message."""
    message["crc"] = checksum(message)


def is_intact(message: Shaped[np.ndarray, "1"]) -> bool:
    """Whether a message carries the checksum of its content."""
    return int(message["crc"][0]) == checksum(message)
