"""Unitree's messages: as they lie in memory, and as CDR, the bytes on the wire.

In memory they are structured arrays with the layout of the C structs. Legs stand in Unitree's order
FR, FL, RR, RL; the first twelve of the twenty motors are the legs', hip, thigh, calf. Names are
Unitree's (unitree_go IDL of unitree_sdk2), so that their documentation applies.

CDR (OMG DDS-XTypes 1.3, sec. 7.4.3, PLAIN_CDR) writes the fields of a struct in order and aligns
each number to its own size, but does not pad the end of a nested struct as C does. So one is a
fixed rearrangement of the other's bytes, worked out once per layout: 6 us a message instead of the
200 us of the DDS library's own codec, byte-identical. The RPC messages hold strings and are packed
one by one.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import astuple, dataclass
from functools import cache
from typing import Any, Final, TypeVar

import numpy as np
from jaxtyping import Int, Shaped

from go2_wbc.errors import CommandError
from go2_wbc.legs import Leg

FEET_SWAPPED: Final = np.array([Leg.FR, Leg.FL, Leg.RR, Leg.RL])
JOINTS_SWAPPED: Final = np.array([3 * leg + part for leg in FEET_SWAPPED for part in range(3)])
"""Take a per-leg array, or one of twelve joints or motors, from our order into Unitree's, and back:
both orders differ in left and right only."""
MOTORS: Final = 12  #: Motors that exist; a message has room for twenty
HEAD: Final = (0xFE, 0xEF)  #: First bytes of every low-level message
LOW_LEVEL: Final = 0xFF  #: ``level_flag`` of low-level control
SERVO: Final = 0x01  #: ``mode`` of a motor that obeys: field-oriented control
POSITION_STOP: Final = 2.146e9  #: A desired angle that means: no position control (``PosStopF``)
VELOCITY_STOP: Final = 16000.0  #: A desired speed that means: no speed control (``VelStopF``)
KP_MAX, KD_MAX = 500.0, 50.0
TAU_MAX, SPEED_MAX = 100.0, 100.0

STRUCTS: Final[Mapping[str, str]] = {
    "IMUState_": "f4 quaternion[4] gyroscope[3] accelerometer[3] rpy[3]; u1 temperature",
    "MotorState_": "u1 mode; f4 q dq ddq tau_est q_raw dq_raw ddq_raw; u1 temperature;"
    "u4 lost reserve[2]",
    "BmsState_": "u1 version_high version_low status soc; i4 current; u2 cycle;"
    "u1 bq_ntc[2] mcu_ntc[2]; u2 cell_vol[15]",
    "LowState_": "u1 head[2] level_flag frame_reserve; u4 sn[2] version[2]; u2 bandwidth;"
    "IMUState_ imu_state; MotorState_ motor_state[20]; BmsState_ bms_state;"
    "i2 foot_force[4] foot_force_est[4]; u4 tick; u1 wireless_remote[40] bit_flag; f4 adc_reel;"
    "u1 temperature_ntc1 temperature_ntc2; f4 power_v power_a; u2 fan_frequency[4];"
    "u4 reserve crc",
    "MotorCmd_": "u1 mode; f4 q dq tau kp kd; u4 reserve[3]",
    "BmsCmd_": "u1 off reserve[3]",
    "LowCmd_": "u1 head[2] level_flag frame_reserve; u4 sn[2] version[2]; u2 bandwidth;"
    "MotorCmd_ motor_cmd[20]; BmsCmd_ bms_cmd; u1 wireless_remote[40] led[12] fan[2] gpio;"
    "u4 reserve crc",
    "TimeSpec_": "i4 sec; u4 nanosec",
    "PathPoint_": "f4 t_from_start x y yaw vx vy vyaw",
    "SportModeState_": "TimeSpec_ stamp; u4 error_code; IMUState_ imu_state; u1 mode; f4 progress;"
    "u1 gait_type; f4 foot_raise_height position[3] body_height velocity[3] yaw_speed"
    " range_obstacle[4]; i2 foot_force[4]; f4 foot_position_body[12] foot_speed_body[12];"
    "PathPoint_ path_point[10]",
}
"""Their structs: a kind (NumPy's name of a number, or a struct) and its fields, kind by kind."""


def fields_of(struct: str) -> Iterator[tuple[str, str, tuple[int, ...]]]:
    """Name, kind and shape of each field of a struct that is written as in ``STRUCTS``."""
    for group in struct.split(";"):
        kind, *names = group.split()
        for name, _, length in (name.rstrip("]").partition("[") for name in names):
            yield name, kind, (int(length),) if length else ()


def _layout(name: str) -> np.dtype[np.void]:
    return np.dtype(
        [
            (field, _layout(kind) if kind in STRUCTS else f"<{kind}", shape)
            for field, kind, shape in fields_of(STRUCTS[name])
        ],
        align=True,
    )


LOW_STATE: Final = _layout("LowState_")
LOW_CMD: Final = _layout("LowCmd_")
SPORT_STATE: Final = _layout("SportModeState_")  #: ``rt/sportmodestate``; it carries no checksum


_MIRRORED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def checksum(message: Shaped[np.ndarray, "1"]) -> int:
    """What the field ``crc`` of a low-level message must be.

    CRC-32 over the 32-bit words of the C struct, the last one excepted: polynomial 0x04C11DB7,
    initial value 0xFFFFFFFF, most significant bit first, no final inversion (``crc32_core`` of
    unitree_sdk2). ``zlib`` has the same polynomial with all bits reversed, so the words are fed to
    it mirrored: a hundred times faster than the loop, and bit by bit the same.
    """
    words = message.view("<u4")[:-1].byteswap().tobytes()
    mirrored = zlib.crc32(words.translate(_MIRRORED)) ^ 0xFFFFFFFF
    return int.from_bytes(mirrored.to_bytes(4, "little").translate(_MIRRORED), "big")


def seal(message: Shaped[np.ndarray, "1"]) -> None:
    """Write the checksum into a message."""
    message["crc"] = checksum(message)


def is_intact(message: Shaped[np.ndarray, "1"]) -> bool:
    """Whether a message carries the checksum of its content."""
    return int(message["crc"][0]) == checksum(message)


LITTLE_ENDIAN: Final = b"\x00\x01\x00\x00"  #: Encapsulation header of little-endian CDR
_LENGTH: Final = struct.Struct("<I")
_SPARE: Final = np.uint8(0)  #: Stands at the end for every byte that the other side does not have


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
    """A remote procedure call."""

    id: int  #: chosen by the client, repeated in the response
    api_id: int  #: which procedure
    lease_id: int = 0  #: of a client that asked for sole control, else 0
    is_one_way: bool = False  #: whether the client waits for no response
    parameter: str = ""  #: JSON, or empty


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
