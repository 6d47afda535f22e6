"""Unitree's messages as they lie in memory: structured arrays with the layout of the C structs.

Legs stand in Unitree's order FR, FL, RR, RL; the first twelve of the twenty motors are the legs',
hip, thigh, calf. Names are Unitree's (unitree_go IDL of unitree_sdk2), so that their documentation
applies.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
from jaxtyping import Shaped

from go2_wbc.legs import Leg

FEET_SWAPPED: Final = np.array([Leg.FR, Leg.FL, Leg.RR, Leg.RL])
JOINTS_SWAPPED: Final = np.array([3 * leg + part for leg in FEET_SWAPPED for part in range(3)])
"""Take a per-leg array, or one of twelve joints or motors, from our order into Unitree's, and back:
both orders differ in left and right only."""
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
"""A desired speed that means: no speed control (``VelStopF``)."""
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
SPORT_STATE: Final = _layout("SportModeState_")
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
