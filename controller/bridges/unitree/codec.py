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
from dataclasses import dataclass
from functools import cache
from typing import Final, final

import numpy as np
from jaxtyping import Shaped

from go2_wbc.errors import CommandError

LITTLE_ENDIAN: Final = b"\x00\x01\x00\x00"
"""Encapsulation header of little-endian CDR."""
_REQUEST_HEAD: Final = struct.Struct("<qqqi?")
_RESPONSE_HEAD: Final = struct.Struct("<qqi")
_LENGTH: Final = struct.Struct("<I")


@final
class StructCodec:
    """Encodes and decodes messages of one layout."""

    def __init__(self, layout: np.dtype[np.void]) -> None:
        """Work out where each byte goes."""
        self._layout = layout
        pairs, length = _byte_pairs(layout)
        source, target = np.array(pairs).T
        # A byte that the other side does not have is taken from the spare zero byte at the end.
        self._gather = np.full(length, layout.itemsize)
        self._gather[target] = source
        self._scatter = np.full(layout.itemsize, length)
        self._scatter[source] = target
        self.size = len(LITTLE_ENDIAN) + length

    def encode(self, message: Shaped[np.ndarray, "1"]) -> bytes:
        """The wire's bytes of a message."""
        padded = np.append(message.view(np.uint8), np.uint8(0))
        return LITTLE_ENDIAN + padded[self._gather].tobytes()

    def decode(self, data: bytes) -> Shaped[np.ndarray, "1"]:
        """The message of the wire's bytes.

        Raises:
            CommandError: if they are too short, or not little-endian CDR.
        """
        if len(data) < self.size or data[:2] != LITTLE_ENDIAN[:2]:
            raise CommandError(f"{len(data)} bytes are no message of {self.size} bytes of CDR")
        body = np.frombuffer(data, np.uint8, self.size - 4, 4)
        return np.append(body, np.uint8(0))[self._scatter].view(self._layout)


def _byte_pairs(layout: np.dtype[np.void]) -> tuple[list[tuple[int, int]], int]:
    """Pairs (byte of the C struct, byte of the CDR body), and the body's length."""
    pairs: list[tuple[int, int]] = []

    def walk(kind: np.dtype[np.generic], offset: int, at: int) -> int:
        if kind.fields is not None:
            for field, start, *_ in kind.fields.values():
                at = walk(field, offset + start, at)
        elif kind.subdtype is not None:
            item, shape = kind.subdtype
            for index in range(int(np.prod(shape))):
                at = walk(item, offset + index * item.itemsize, at)
        else:
            at += -at % kind.itemsize
            pairs.extend((offset + byte, at + byte) for byte in range(kind.itemsize))
            at += kind.itemsize
        return at

    length = walk(layout, 0, 0)
    return pairs, length


@cache
def codec_of(layout: np.dtype[np.void]) -> StructCodec:
    """The codec of a layout; made once."""
    return StructCodec(layout)


@dataclass(frozen=True, slots=True)
class Request:
    """A remote procedure call.

    Attributes:
        id: chosen by the client, repeated in the response.
        api_id: which procedure.
        lease_id: of a client that asked for sole control, else 0.
        wants_reply: whether the client waits for a response.
        parameter: JSON, or empty.
    """

    id: int
    api_id: int
    lease_id: int = 0
    wants_reply: bool = True
    parameter: str = ""


@dataclass(frozen=True, slots=True)
class Response:
    """The answer to a call: 0 or an error code, and JSON data or nothing."""

    id: int
    api_id: int
    code: int = 0
    data: str = ""


Reply = Callable[[int, str], None]
"""Answers a request: code and data. Any thread may call it, once."""


def encode_request(request: Request) -> bytes:
    """The wire's bytes of a request."""
    head = _REQUEST_HEAD.pack(
        request.id, request.api_id, request.lease_id, 0, not request.wants_reply
    )
    return LITTLE_ENDIAN + _with_text(head, request.parameter)


def decode_request(data: bytes) -> Request:
    """The request of the wire's bytes.

    Raises:
        CommandError: if they are none.
    """
    number, api_id, lease_id, _, no_reply = _unpack(_REQUEST_HEAD, data)
    text = _text(data, 4 + _REQUEST_HEAD.size)
    return Request(number, api_id, lease_id, not no_reply, text)


def encode_response(response: Response) -> bytes:
    """The wire's bytes of a response."""
    head = _RESPONSE_HEAD.pack(response.id, response.api_id, response.code)
    return LITTLE_ENDIAN + _with_text(head, response.data)


def decode_response(data: bytes) -> Response:
    """The response of the wire's bytes.

    Raises:
        CommandError: if they are none.
    """
    number, api_id, code = _unpack(_RESPONSE_HEAD, data)
    return Response(number, api_id, code, _text(data, 4 + _RESPONSE_HEAD.size))


def _unpack(head: struct.Struct, data: bytes) -> tuple[int, ...]:
    try:
        return head.unpack_from(data, len(LITTLE_ENDIAN))
    except struct.error as error:
        raise CommandError(f"{len(data)} bytes are no message of the RPC: {error}") from error


def _with_text(head: bytes, text: str) -> bytes:
    """``head``, then ``text`` as a CDR string, then an empty sequence of octets."""
    encoded = text.encode() + b"\0"
    body = _aligned(head) + _LENGTH.pack(len(encoded)) + encoded
    return _aligned(body) + _LENGTH.pack(0)


def _aligned(body: bytes) -> bytes:
    return body + bytes(-len(body) % 4)


def _text(data: bytes, start: int) -> str:
    start += -start % 4
    try:
        (length,) = _LENGTH.unpack_from(data, start)
        encoded = data[start + 4 : start + 4 + length]
        if len(encoded) != length:
            raise CommandError(f"a string of {length} bytes is cut off after {len(encoded)}")
        return encoded.rstrip(b"\0").decode()
    except (struct.error, UnicodeDecodeError) as error:
        raise CommandError(f"the string of a message of the RPC is broken: {error}") from error
