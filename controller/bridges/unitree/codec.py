"""Memory layout <-> CDR, the bytes on the wire.

CDR (OMG DDS-XTypes 1.3, sec. 7.4.3, PLAIN_CDR) writes the fields of a struct in order and aligns
each number to its own size, but does not pad the end of a nested struct as C does. So one is a
fixed rearrangement of the other's bytes, worked out once per layout: 6 us a message instead of the
200 us of the DDS library's own codec, byte-identical. The RPC messages hold strings and are packed
one by one.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import astuple, dataclass
from functools import cache
from typing import Any, Final, TypeVar

import numpy as np
from jaxtyping import Int, Shaped

from go2_wbc.errors import CommandError

LITTLE_ENDIAN: Final = b"\x00\x01\x00\x00"
"""Encapsulation header of little-endian CDR."""
_LENGTH: Final = struct.Struct("<I")
_SPARE: Final = np.uint8(0)
"""Stands at the end for every byte that the other side does not have."""


def encode_message(message: Shaped[np.ndarray, "1"]) -> bytes:
    """The wire's bytes of a message of any layout."""
    gather, _ = _byte_maps(message.dtype)
    return LITTLE_ENDIAN + np.append(message.view(np.uint8), _SPARE)[gather].tobytes()


def decode_message(layout: np.dtype[np.void], data: bytes) -> Shaped[np.ndarray, "1"]:
    """The message of the wire's bytes; CommandError if they are no CDR, or too few."""
    gather, scatter = _byte_maps(layout)
    size = len(LITTLE_ENDIAN) + gather.size
    if len(data) < size or data[:2] != LITTLE_ENDIAN[:2]:
        raise CommandError(f"{len(data)} bytes are no message of {size} bytes of CDR")
    return np.append(np.frombuffer(data, np.uint8)[4:size], _SPARE)[scatter].view(layout)


@cache
def _byte_maps(layout: np.dtype[np.void]) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " m"]]:
    """Where in the C struct each byte of the CDR body is found, and the other way round."""
    gather: list[int] = []

    def walk(kind: np.dtype[np.generic], offset: int) -> None:
        if kind.fields is not None:
            for field, start, *_ in kind.fields.values():
                walk(field, offset + start)
        elif kind.subdtype is not None:
            item, (count,) = kind.subdtype
            for index in range(count):
                walk(item, offset + index * item.itemsize)
        else:
            gather.extend([layout.itemsize] * (-len(gather) % kind.itemsize))
            gather.extend(range(offset, offset + kind.itemsize))

    walk(layout, 0)
    scatter = np.full(layout.itemsize + 1, len(gather))
    scatter[gather] = np.arange(len(gather))
    return np.array(gather), scatter[:-1]


@dataclass(frozen=True, slots=True)
class Request:
    """A remote procedure call.

    Attributes:
        id: chosen by the client, repeated in the response.
        api_id: which procedure.
        lease_id: of a client that asked for sole control, else 0.
        is_one_way: whether the client waits for no response.
        parameter: JSON, or empty.
    """

    id: int
    api_id: int
    lease_id: int = 0
    is_one_way: bool = False
    parameter: str = ""


@dataclass(frozen=True, slots=True)
class Response:
    """The answer to a call: 0 or an error code, and JSON data or nothing."""

    id: int
    api_id: int
    code: int = 0
    data: str = ""


Call = TypeVar("Call", Request, Response)
Reply = Callable[[int, str], None]
"""Answers a request: code and data. Any thread may call it, once."""
_HEADS: Final = {Request: struct.Struct("<qqq4x?3x"), Response: struct.Struct("<qqi")}
"""What goes before the text; of a request without its priority, which nobody uses."""


def encode_call(call: Request | Response) -> bytes:
    """The wire's bytes: numbers, the text as a CDR string, an empty sequence of octets."""
    *numbers, text = astuple(call)
    encoded = text.encode() + b"\0"
    body = _HEADS[type(call)].pack(*numbers) + _LENGTH.pack(len(encoded)) + encoded
    return LITTLE_ENDIAN + body + bytes(-len(body) % 4) + _LENGTH.pack(0)


def decode_call(kind: type[Call], data: bytes) -> Call:
    """The request or response of the wire's bytes; CommandError if they are none."""
    head = _HEADS[kind]
    start = len(LITTLE_ENDIAN) + head.size + _LENGTH.size
    try:
        numbers = head.unpack_from(data, len(LITTLE_ENDIAN))
        (length,) = _LENGTH.unpack_from(data, start - _LENGTH.size)
        encoded = data[start : start + length]
        if len(encoded) != length:
            raise CommandError(f"a string of {length} bytes is cut off after {len(encoded)}")
        fields: list[Any] = [*numbers, encoded.rstrip(b"\0").decode()]
        return kind(*fields)
    except (struct.error, UnicodeDecodeError) as error:
        raise CommandError(f"{len(data)} bytes are a broken message of the RPC: {error}") from error
