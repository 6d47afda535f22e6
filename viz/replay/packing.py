"""Packs named arrays and a JSON header into one compressed text that a page can carry."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping
from typing import final

import numpy as np
from jaxtyping import Shaped

_ALIGNMENT = 8  # [bytes] typed arrays in a browser must start at a multiple of their item size
_QUANTISED_LEVELS = 65535  # of an unsigned 16-bit number


@final
class Pack:
    """Collects arrays; ``packed`` gives them as one gzipped base64 text.

    Layout, little-endian: length of the header (uint32), header (JSON, UTF-8), padding, arrays.
    """

    def __init__(self) -> None:
        """Start empty."""
        self._blobs: list[bytes] = []
        self._entries: dict[str, dict[str, object]] = {}
        self._size = 0

    def add(
        self, name: str, array: Shaped[np.ndarray, "..."], extra: Mapping[str, object] | None = None
    ) -> None:
        """Store an array of one of the types that a browser knows; ``extra`` is told with it."""
        blob = np.ascontiguousarray(array).tobytes()
        kind = f"{array.dtype.name.capitalize()}Array"  # float32 is a browser's Float32Array
        entry = {"type": kind, "shape": array.shape, "offset": self._size}
        self._entries[name] = {**entry, **(extra or {})}
        blob += b"\0" * (-len(blob) % _ALIGNMENT)
        self._blobs.append(blob)
        self._size += len(blob)

    def add_quantised(self, name: str, array: Shaped[np.ndarray, "n k"]) -> None:
        """Store each column as 16-bit numbers between its own extremes."""
        low = array.min(axis=0, initial=0.0)
        span = np.maximum(array.max(axis=0, initial=0.0) - low, 1e-9)
        levels = np.round((array - low) / span * _QUANTISED_LEVELS).astype(np.uint16)
        scale = span / _QUANTISED_LEVELS
        self.add(name, levels, {"low": low.tolist(), "scale": scale.tolist()})

    def packed(self, header: dict[str, object]) -> str:
        """Everything, with ``header`` beside the table of the arrays."""
        table = json.dumps({**header, "arrays": self._entries}, separators=(",", ":"))
        head = table.encode()
        start = 4 + len(head)
        padding = b"\0" * (-start % _ALIGNMENT)
        content = len(head).to_bytes(4, "little") + head + padding + b"".join(self._blobs)
        return compressed_text(content)


def compressed_text(content: bytes) -> str:
    """Gzipped and base64; the same content always gives the same text."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")
