"""Unitree's messages as they lie in memory: structured arrays with the layout of the C structs.

Legs stand in Unitree's order FR, FL, RR, RL; the first
twelve of the twenty motors are the legs', hip, thigh, calf. Field names are Unitree's (unitree_go
IDL of unitree_sdk2), so that their documentation applies.
"""

from __future__ import annotations

import zlib
from typing import Final

import numpy as np
from jaxtyping import Shaped

from go2_wbc.legs import LEGS, Leg

UNITREE_LEGS: Final = (Leg.FR, Leg.FL, Leg.RR, Leg.RL)
"""Unitree's order of the legs."""
FEET_TO_UNITREE: Final = np.array([int(leg) for leg in UNITREE_LEGS])
"""Takes a per-leg array of ours into Unitree's order."""
FEET_FROM_UNITREE: Final = np.array([UNITREE_LEGS.index(leg) for leg in LEGS])
"""Takes a per-leg array of Unitree's into our order."""
JOINTS_TO_UNITREE: Final = np.array([3 * leg + part for leg in UNITREE_LEGS for part in range(3)])
"""Takes a (12,) joint array of ours into Unitree's order."""
JOINTS_FROM_UNITREE: Final = np.argsort(JOINTS_TO_UNITREE)
"""Takes a (12,) motor array of Unitree's into our order."""
MOTORS: Final = 12
"""Motors that exist; a message has room for twenty."""
HEAD: Final = (0xFE, 0xEF)
"""First bytes of every low-level message."""
LOW_LEVEL: Final = 0xFF
"""``level_flag`` of low-level control."""
SERVO: Final = 0x01
"""``mode`` of a motor that obeys: field-oriented control."""
POSITION_STOP: Final = 2.146e9
"""A desired angle that means: no position control (``PosStopF``)."""
VELOCITY_STOP: Final = 16000.0
KP_MAX, KD_MAX = 500.0, 50.0
TAU_MAX, SPEED_MAX = 100.0, 100.0
"""A desired speed that means: no speed control (``VelStopF``)."""

_U1, _U2, _U4, _I2, _I4, _F4 = "u1", "<u2", "<u4", "<i2", "<i4", "<f4"


def _struct(*fields: tuple[object, ...]) -> np.dtype[np.void]:
    return np.dtype(list(fields), align=True)


MOTOR_STATE: Final = _struct(
    ("mode", _U1),
    ("q", _F4),
    ("dq", _F4),
    ("ddq", _F4),
    ("tau_est", _F4),
    ("q_raw", _F4),
    ("dq_raw", _F4),
    ("ddq_raw", _F4),
    ("temperature", _U1),
    ("lost", _U4),
    ("reserve", _U4, 2),
)
IMU_STATE: Final = _struct(
    ("quaternion", _F4, 4),
    ("gyroscope", _F4, 3),
    ("accelerometer", _F4, 3),
    ("rpy", _F4, 3),
    ("temperature", _U1),
)
BMS_STATE: Final = _struct(
    ("version_high", _U1),
    ("version_low", _U1),
    ("status", _U1),
    ("soc", _U1),
    ("current", _I4),
    ("cycle", _U2),
    ("bq_ntc", _U1, 2),
    ("mcu_ntc", _U1, 2),
    ("cell_vol", _U2, 15),
)
_HEAD_FIELDS: Final = (
    ("head", _U1, 2),
    ("level_flag", _U1),
    ("frame_reserve", _U1),
    ("sn", _U4, 2),
    ("version", _U4, 2),
    ("bandwidth", _U2),
)
LOW_STATE: Final = _struct(
    *_HEAD_FIELDS,
    ("imu_state", IMU_STATE),
    ("motor_state", MOTOR_STATE, 20),
    ("bms_state", BMS_STATE),
    ("foot_force", _I2, 4),
    ("foot_force_est", _I2, 4),
    ("tick", _U4),
    ("wireless_remote", _U1, 40),
    ("bit_flag", _U1),
    ("adc_reel", _F4),
    ("temperature_ntc1", _U1),
    ("temperature_ntc2", _U1),
    ("power_v", _F4),
    ("power_a", _F4),
    ("fan_frequency", _U2, 4),
    ("reserve", _U4),
    ("crc", _U4),
)
MOTOR_CMD: Final = _struct(
    ("mode", _U1),
    ("q", _F4),
    ("dq", _F4),
    ("tau", _F4),
    ("kp", _F4),
    ("kd", _F4),
    ("reserve", _U4, 3),
)
LOW_CMD: Final = _struct(
    *_HEAD_FIELDS,
    ("motor_cmd", MOTOR_CMD, 20),
    ("bms_cmd", _struct(("off", _U1), ("reserve", _U1, 3))),
    ("wireless_remote", _U1, 40),
    ("led", _U1, 12),
    ("fan", _U1, 2),
    ("gpio", _U1),
    ("reserve", _U4),
    ("crc", _U4),
)
_PATH_POINT: Final = _struct(
    *((name, _F4) for name in ("t_from_start", "x", "y", "yaw", "vx", "vy", "vyaw"))
)
SPORT_STATE: Final = _struct(
    ("stamp", _struct(("sec", _I4), ("nanosec", _U4))),
    ("error_code", _U4),
    ("imu_state", IMU_STATE),
    ("mode", _U1),
    ("progress", _F4),
    ("gait_type", _U1),
    ("foot_raise_height", _F4),
    ("position", _F4, 3),
    ("body_height", _F4),
    ("velocity", _F4, 3),
    ("yaw_speed", _F4),
    ("range_obstacle", _F4, 4),
    ("foot_force", _I2, 4),
    ("foot_position_body", _F4, 12),
    ("foot_speed_body", _F4, 12),
    ("path_point", _PATH_POINT, 10),
)
"""``rt/sportmodestate``; it carries no checksum."""


def new_message(layout: np.dtype[np.void]) -> Shaped[np.ndarray, "1"]:
    """One message, all zero."""
    return np.zeros(1, layout)


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
