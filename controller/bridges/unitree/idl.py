"""The DDS types of Unitree's topics, for the DDS library's type negotiation.

Octets are declared as ``byte``. Declared as ``uint8``, CycloneDDS 11 announces a kind of type that
CycloneDDS 0.10.2 does not know, and every 0.10.2 peer (the C++ SDK, the robot itself) crashes when
it discovers ours. With ``byte`` the type identifiers equal the vendor's. The samples themselves are
encoded by ``codec.py``.
"""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl import types as kinds

from controller.bridges.unitree.layout import STRUCTS, fields_of

_KINDS: Final[Mapping[str, Any]] = {
    "u1": kinds.byte,
    "u2": kinds.uint16,
    "u4": kinds.uint32,
    "i2": kinds.int16,
    "i4": kinds.int32,
    "i8": kinds.int64,
    "f4": kinds.float32,
    "bool": bool,
    "string": str,
    "octets": kinds.sequence[kinds.byte],
}
_RPC_STRUCTS: Final[Mapping[str, str]] = {
    "RequestIdentity_": "i8 id api_id",
    "RequestLease_": "i8 id",
    "RequestPolicy_": "i4 priority; bool noreply",
    "RequestHeader_": "RequestIdentity_ identity; RequestLease_ lease; RequestPolicy_ policy",
    "Request_": "RequestHeader_ header; string parameter; octets binary",
    "ResponseStatus_": "i4 code",
    "ResponseHeader_": "RequestIdentity_ identity; ResponseStatus_ status",
    "Response_": "ResponseHeader_ header; string data; octets binary",
}
_STRUCT_OF_TOPIC: Final = {
    "lowstate": "LowState_",
    "lowcmd": "LowCmd_",
    "sportmodestate": "SportModeState_",
    "request": "Request_",
    "response": "Response_",
}
"""By the last part of the topic's name; every service has its requests and responses."""


def type_of(topic: str) -> type:
    """The DDS type of a topic's samples."""
    return _struct(_STRUCT_OF_TOPIC[topic.rpartition("/")[2]])


@cache
def _struct(name: str) -> type:
    module, structs = ("api", _RPC_STRUCTS) if name in _RPC_STRUCTS else ("go", STRUCTS)
    fields: dict[str, object] = {}
    for field, kind, shape in fields_of(structs[name]):
        item = _KINDS.get(kind) or _struct(kind)
        fields[field] = kinds.array[item, shape[0]] if shape else item
    body = {"__annotations__": fields, "__module__": __name__}
    keywords = {"typename": f"unitree_{module}.msg.dds_.{name}"}
    made = types.new_class(name, (IdlStruct,), keywords, lambda space: space.update(body))
    return annotations.final(annotations.autoid("sequential")(dataclass(made)))
