"""The DDS types of Unitree's topics, for the DDS library's type negotiation.

Octets are declared as ``byte``. Declared as ``uint8``, CycloneDDS 11 announces a kind of type that
CycloneDDS 0.10.2 does not know, and every 0.10.2 peer (the C++ SDK, the robot itself) crashes when
it discovers ours. With ``byte`` the type identifiers equal the vendor's. The samples themselves are
encoded by ``codec.py``.
"""

from __future__ import annotations

import types
from dataclasses import dataclass
from typing import Final

import numpy as np
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl import types as kinds

from controller.bridges.unitree import layout

_KINDS: Final = {
    "u1": kinds.byte,
    "u2": kinds.uint16,
    "u4": kinds.uint32,
    "i2": kinds.int16,
    "i4": kinds.int32,
    "f4": kinds.float32,
}
_NESTED: Final = {
    "imu_state": "IMUState_",
    "motor_state": "MotorState_",
    "bms_state": "BmsState_",
    "motor_cmd": "MotorCmd_",
    "bms_cmd": "BmsCmd_",
    "stamp": "TimeSpec_",
    "path_point": "PathPoint_",
}
"""Unitree's name of the struct that a field holds."""
_made: dict[str, type] = {}


def low_state() -> type:
    """Type of ``rt/lowstate``."""
    return _from_layout("LowState_", layout.LOW_STATE)


def low_cmd() -> type:
    """Type of ``rt/lowcmd``."""
    return _from_layout("LowCmd_", layout.LOW_CMD)


def sport_state() -> type:
    """Type of ``rt/sportmodestate``."""
    return _from_layout("SportModeState_", layout.SPORT_STATE)


def request() -> type:
    """Type of a service's requests."""
    identity, lease, policy = _identity(), _api("RequestLease_", id=kinds.int64), _policy()
    header = _api("RequestHeader_", identity=identity, lease=lease, policy=policy)
    return _api("Request_", header=header, parameter=str, binary=kinds.sequence[kinds.byte])


def response() -> type:
    """Type of a service's responses."""
    status = _api("ResponseStatus_", code=kinds.int32)
    header = _api("ResponseHeader_", identity=_identity(), status=status)
    return _api("Response_", header=header, data=str, binary=kinds.sequence[kinds.byte])


def _identity() -> type:
    return _api("RequestIdentity_", id=kinds.int64, api_id=kinds.int64)


def _policy() -> type:
    return _api("RequestPolicy_", priority=kinds.int32, noreply=bool)


def _from_layout(name: str, struct: np.dtype[np.void]) -> type:
    kinds_by_name = {key: _kind(key, struct[key]) for key in struct.names or ()}
    return _made_once("unitree_go", name, kinds_by_name)


def _kind(field: str, kind: np.dtype[np.generic]) -> object:
    if kind.subdtype is not None:
        item, shape = kind.subdtype
        return kinds.array[_kind(field, item), shape[0]]
    if kind.fields is not None:
        return _from_layout(_NESTED[field], kind)  # type: ignore[arg-type]
    return _KINDS[kind.str[1:]]


def _api(name: str, **fields: object) -> type:
    return _made_once("unitree_api", name, fields)


def _made_once(module: str, name: str, fields: dict[str, object]) -> type:
    if name not in _made:
        body = {"__annotations__": fields, "__module__": __name__}
        keywords = {"typename": f"{module}.msg.dds_.{name}"}
        made = types.new_class(name, (IdlStruct,), keywords, lambda space: space.update(body))
        _made[name] = annotations.final(annotations.autoid("sequential")(dataclass(made)))
    return _made[name]
