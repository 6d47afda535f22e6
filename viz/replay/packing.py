"""Arrays with a header as one block of bytes, and of a block only what another one has not.

Layout, little-endian: length of the header (uint32), header (JSON, UTF-8), padding, arrays. A
message of changes is laid out likewise: its header says what is taken from the other block, the
bytes that follow fill the gaps between.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, final

import numpy as np
from jaxtyping import Shaped, UInt8

_ALIGNMENT = 8  # [bytes] typed arrays in a browser must start at a multiple of their item size
_QUANTISED_LEVELS = 65535  # of an unsigned 16-bit number
_LENGTH = 4  # [bytes] of the header's length
_LEAST_SAME = 64  # bytes; less is not worth a line of the table
_BEGINNING = 64  # [bytes] by which most arrays are told apart


@dataclass(frozen=True, slots=True)
class Packed:
    """A block."""

    data: bytes  #: all of it
    places: Mapping[str, tuple[int, int]]  #: start and end [bytes] of header and arrays, by name


@final
class Pack:
    """Collects arrays; one that is equal to another is kept once."""

    def __init__(self) -> None:
        self._blobs: list[bytes] = []
        self._entries: dict[str, dict[str, object]] = {}
        self._places: dict[str, tuple[int, int]] = {}
        self._starts: dict[tuple[int, bytes], list[tuple[int, int]]] = {}
        self._size = 0

    def add(
        self, name: str, array: Shaped[np.ndarray, "..."], extra: Mapping[str, object] | None = None
    ) -> None:
        """Store an array of one of the types that a browser knows; ``extra`` is told with it."""
        blob = np.ascontiguousarray(array).tobytes()
        start = self._start_of(blob)
        entry = {"type": _kind(array.dtype), "shape": array.shape, "offset": start}
        self._entries[name] = {**entry, **(extra or {})}
        if start == self._size:
            self._places[name] = start, start + len(blob)
            padding = b"\0" * (-len(blob) % _ALIGNMENT)
            self._blobs += [blob, padding]
            self._size += len(blob) + len(padding)

    def _start_of(self, blob: bytes) -> int:
        """Where an equal one is, or this one will be; to hash all of it would take longer."""
        alike = self._starts.setdefault((len(blob), blob[:_BEGINNING]), [])
        for start, place in alike:
            if self._blobs[place] == blob:
                return start
        alike.append((self._size, len(self._blobs)))
        return self._size

    def add_quantised(self, name: str, array: Shaped[np.ndarray, "n k"]) -> None:
        """Store each column as 16-bit numbers between its own extremes."""
        columns = np.array(array.T, float, order="C")  # extremes of rows take a tenth of the time
        low = columns.min(axis=1, initial=0.0)
        span = np.maximum(columns.max(axis=1, initial=0.0) - low, 1e-9)
        columns -= low[:, None]  # in place: most of the time is that of new memory
        columns /= span[:, None]
        columns *= _QUANTISED_LEVELS
        levels = np.rint(columns, out=columns).astype(np.uint16).T
        scale = span / _QUANTISED_LEVELS
        self.add(name, levels, {"low": low.tolist(), "scale": scale.tolist()})

    def packed(self, header: Mapping[str, object]) -> Packed:
        """Everything, with ``header`` beside the table of the arrays."""
        head = _json({**header, "arrays": self._entries})
        start = _LENGTH + len(head)
        padding = b"\0" * (-start % _ALIGNMENT)
        first = start + len(padding)
        places = {name: (first + a, first + b) for name, (a, b) in self._places.items()}
        parts = (_length(head), head, padding, *self._blobs)
        return Packed(b"".join(parts), {"": (0, start), **places})


@cache
def _kind(dtype: np.dtype[Any]) -> str:
    """Of a browser's array: of float32 it is Float32Array."""
    return f"{dtype.name.capitalize()}Array"


def compressed_text(content: bytes) -> str:
    """Gzipped and base64; the same content always gives the same text."""
    return base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii")


def message(told: Mapping[str, object], new: Packed, old: Packed | None = None) -> bytes:
    """What a page needs to make ``new`` of ``old``, and what it is ``told`` besides.

    The header has ``size``, of the whole, and ``copies``: where in it, from where in ``old``, and
    how many bytes.
    """
    copies = [] if old is None else _copies(new, old)
    head = _json({**told, "size": len(new.data), "copies": copies})
    gaps, done = list[bytes](), 0
    for start, _, count in copies:
        gaps.append(new.data[done:start])
        done = start + count
    return b"".join([_length(head), head, *gaps, new.data[done:]])


def _copies(new: Packed, old: Packed) -> list[tuple[int, int, int]]:
    """What begins or ends as it was, of every array: an edit leaves what is before and after it."""
    copies = list[tuple[int, int, int]]()
    now, before = (np.frombuffer(one.data, np.uint8) for one in (new, old))
    for name, (start, end) in new.places.items():
        first, last = old.places.get(name, (0, 0))
        count = min(end - start, last - first)
        ahead = _same(now[start : start + count], before[first : first + count])
        rest = count - ahead
        behind = _same(now[end - rest : end][::-1], before[last - rest : last][::-1])
        copies += [(start, first, ahead)] * (ahead >= _LEAST_SAME)
        copies += [(end - behind, last - behind, behind)] * (behind >= _LEAST_SAME)
    return copies


def _same(one: UInt8[np.ndarray, " n"], other: UInt8[np.ndarray, " n"]) -> int:
    """How many bytes at the beginning are equal."""
    differ = one != other
    return int(differ.argmax()) if differ.any() else len(differ)


def _json(head: Mapping[str, object]) -> bytes:
    return json.dumps(head, separators=(",", ":")).encode()


def _length(head: bytes) -> bytes:
    return len(head).to_bytes(_LENGTH, "little")
