"""Unitree's messages: layout, checksum and wire format. Needs no DDS library."""

import struct
from dataclasses import replace

import numpy as np
import pytest

from controller.bridges.unitree import messages
from controller.bridges.unitree.messages import (
    Request,
    Response,
    checksum,
    decode_call,
    decode_message,
    encode_call,
    encode_message,
    is_intact,
    seal,
)
from go2_wbc.errors import CommandError
from go2_wbc.legs import JOINT_NAMES, LEGS, Leg

# Sizes of the C structs in unitree_sdk2's headers and motor order of its examples.
LOW_STATE_SIZE, LOW_CMD_SIZE = 1180, 812
MOTOR_ORDER = [
    f"{leg}_{part}_joint" for leg in ("FR", "FL", "RR", "RL") for part in ("hip", "thigh", "calf")
]


def random_message(kind: np.dtype[np.void], seed: int) -> np.ndarray:
    """All bytes of all fields drawn; the padding between them stays zero."""
    rng = np.random.default_rng(seed)
    message = np.zeros(1, kind)

    def fill(part: np.ndarray) -> None:
        for name in part.dtype.names or ():
            if part[name].dtype.names:
                fill(part[name])
            elif part[name].dtype.kind == "f":
                part[name] = rng.normal(size=part[name].shape)
            else:
                part[name] = rng.integers(0, 100, part[name].shape)

    fill(message)
    return message


def crc_bit_by_bit(message: np.ndarray) -> int:
    """``crc32_core`` of unitree_sdk2, line by line."""
    crc, polynomial = 0xFFFFFFFF, 0x04C11DB7
    for word in message.view("<u4")[:-1].tolist():
        bit = 1 << 31
        for _ in range(32):
            crc = ((crc << 1) & 0xFFFFFFFF) ^ (polynomial if crc & 0x80000000 else 0)
            if word & bit:
                crc ^= polynomial
            bit >>= 1
    return crc


@pytest.mark.parametrize("kind", [messages.LOW_STATE, messages.LOW_CMD])
def test_the_checksum_is_the_one_of_the_sdk(kind: np.dtype[np.void]) -> None:
    for seed in range(3):
        message = random_message(kind, seed)
        assert checksum(message) == crc_bit_by_bit(message)


def test_a_message_that_is_cut_changed_or_big_endian_is_not_intact() -> None:
    message = random_message(messages.LOW_CMD, 1)
    seal(message)
    assert is_intact(message)
    message["motor_cmd"]["mode"][0, 5] ^= 1
    assert not is_intact(message)
    data = encode_message(np.zeros(1, messages.LOW_CMD))
    for broken in (data[:-1], b"", b"\x00\x00" + data[2:]):
        with pytest.raises(CommandError, match="no message"):
            decode_message(messages.LOW_CMD, broken)


def test_the_structs_have_the_sizes_and_the_order_of_the_sdk() -> None:
    assert messages.LOW_STATE.itemsize == LOW_STATE_SIZE
    assert messages.LOW_CMD.itemsize == LOW_CMD_SIZE
    assert [JOINT_NAMES[index] for index in messages.JOINTS_SWAPPED] == MOTOR_ORDER
    joints, feet = np.arange(12), np.array(LEGS)
    assert np.array_equal(joints[messages.JOINTS_SWAPPED][messages.JOINTS_SWAPPED], joints)
    assert np.array_equal(feet[messages.FEET_SWAPPED], [Leg.FR, Leg.FL, Leg.RR, Leg.RL])
    assert np.array_equal(feet[messages.FEET_SWAPPED][messages.FEET_SWAPPED], feet)
    message = np.zeros(1, messages.LOW_CMD)
    message["motor_cmd"]["mode"][0, :2] = 1, 2
    message["motor_cmd"]["q"][0, 0] = 0.5
    body = encode_message(message)[4:]
    # head 2, flags 2, sn 8, version 8, bandwidth 2: the first motor begins at 22
    assert body[22] == 1
    assert struct.unpack_from("<f", body, 24) == (0.5,)
    assert body[24 + 5 * 4 + 3 * 4] == 2


@pytest.mark.parametrize("kind", [messages.LOW_STATE, messages.LOW_CMD, messages.SPORT_STATE])
def test_what_is_encoded_comes_back(kind: np.dtype[np.void]) -> None:
    message = random_message(kind, 2)
    assert np.array_equal(decode_message(kind, encode_message(message)), message)


@pytest.mark.parametrize("text", ["", "{}", '{"x": 0.5}', "abc", "ä"])
def test_requests_and_responses_come_back(text: str) -> None:
    request = Request(2**62, 1008, lease_id=7, is_one_way=True, parameter=text)
    assert decode_call(Request, encode_call(request)) == request
    response = Response(-5, 1016, 4205, text)
    assert decode_call(Response, encode_call(response)) == response
    answered = replace(request, is_one_way=False)
    assert not decode_call(Request, encode_call(answered)).is_one_way


@pytest.mark.parametrize("size", [0, 3, 20, 38, 41])
def test_a_request_that_is_cut_off_is_refused(size: int) -> None:
    data = encode_call(Request(1, 1008, parameter='{"x": 1}'))
    with pytest.raises(CommandError):
        decode_call(Request, data[:size])


def test_a_request_with_bytes_that_are_no_text_is_refused() -> None:
    data = encode_call(Request(1, 1008, parameter="abcd")).replace(b"abcd", b"\xff\xfe\xfd\xfc")
    with pytest.raises(CommandError, match="broken"):
        decode_call(Request, data)
