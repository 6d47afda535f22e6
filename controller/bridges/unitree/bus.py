"""The DDS side, the one file that imports the library: a participant, writers, readers of bytes.

Samples are written and taken encoded, through the library's own C layer, because its Python
codec costs 200 us a message; that layer is private, so the extra pins the library's version.
Readers are polled: a listener's thread builds up a backlog on a loaded machine.

The types of the topics are only for the library's negotiation. Octets are declared as ``byte``.
Declared as ``uint8``, CycloneDDS 11 announces a kind of type that CycloneDDS 0.10.2 does not know,
and every 0.10.2 peer (the C++ SDK, the robot itself) crashes when it discovers ours. With ``byte``
the type identifiers equal the vendor's.
"""

from __future__ import annotations

import threading
import types
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, final

from cyclonedds._clayer import ddspy_take, ddspy_write
from cyclonedds.core import (
    DDSException,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl import types as kinds
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from controller.bridges.unitree.messages import STRUCTS, fields_of
from go2_wbc.errors import CommandError, PlantError

_ANY: Final = SampleState.Any | ViewState.Any | InstanceState.Any
_NEW: Final = ViewState.Any | InstanceState.Any | SampleState.NotRead
_CONFIG: Final = (
    '<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="{}"/></Interfaces>'
    "</General></Domain></CycloneDDS>"
)
_domains: dict[int, tuple[str, Any]] = {}
_lock = threading.Lock()
DOMAINS: Final = 230  #: Numbers of DDS domains that every system's ports have room for, from 0 on


@final
class Writer:
    """Writes the samples of one topic."""

    def __init__(self, writer: DataWriter) -> None:
        """Write by ``writer``, which is kept alive."""
        self._writer = writer

    def write(self, data: bytes) -> None:
        """Send one encoded sample, without waiting for readers; PlantError if it is refused."""
        if ddspy_write(self._writer._ref, data + bytes(-len(data) % 4)) < 0:
            raise PlantError("the DDS library refused to write a sample")

    @property
    def readers(self) -> int:
        """How many readers there are at present."""
        return len(self._writer.get_matched_subscriptions())


@final
class Reader:
    """Takes the samples of one topic."""

    def __init__(self, participant: DomainParticipant, reader: DataReader, depth: int) -> None:
        """Read by ``reader``, which is kept alive and keeps ``depth`` samples."""
        self._reader, self._depth = reader, depth
        self._condition = ReadCondition(reader, _NEW)
        self._waitset = WaitSet(participant)
        self._waitset.attach(self._condition)

    def take(self) -> list[bytes]:
        """All samples that have come, encoded, oldest first; never waits."""
        taken = ddspy_take(self._reader._ref, _ANY, self._depth)
        if isinstance(taken, int):
            return []
        return [bytes(data) for data, info in taken if info.valid_data]

    def wait(self, seconds: float) -> bool:
        """Wait for a sample that has not been taken; returns whether there is one."""
        return bool(self._waitset.wait(duration(nanoseconds=round(1e9 * seconds))))

    @property
    def writers(self) -> int:
        """How many writers there are at present."""
        return len(self._reader.get_matched_publications())


@final
class Bus:
    """A participant in a DDS domain, on one network interface."""

    def __init__(self, domain: int, interface: str) -> None:
        """Join ``domain`` on ``interface``.

        Raises:
            CommandError: for a domain or interface that does not exist, or another interface than
                this process has already joined the domain on.
        """
        if not 0 <= domain < DOMAINS:
            raise CommandError(f"domain must be 0 to {DOMAINS - 1}, got {domain}")
        with _lock:
            _open_domain(domain, interface)
            self._participant = DomainParticipant(domain)

    def writer(self, topic: str) -> Writer:
        """A writer of ``topic``, with the quality of service that Unitree's SDK has."""
        return Writer(DataWriter(self._participant, self._topic(topic)))

    def reader(self, topic: str, *, depth: int, reliable: bool = False) -> Reader:
        """A reader of ``topic`` that keeps the newest ``depth`` samples until they are taken."""
        policies = [Policy.History.KeepLast(depth)]
        if reliable:
            policies.append(Policy.Reliability.Reliable(duration(seconds=1)))
        reader = DataReader(self._participant, self._topic(topic), Qos(*policies))
        return Reader(self._participant, reader, depth)

    def _topic(self, name: str) -> Topic[Any]:
        return Topic(self._participant, name, _struct(_STRUCT_OF_TOPIC[name.rpartition("/")[2]]))


def _open_domain(domain: int, interface: str) -> None:
    """Configure the domain once: the library does it once in a process."""
    if domain in _domains:
        if _domains[domain][0] != interface:
            raise CommandError(
                f"this process has joined domain {domain} on {_domains[domain][0]}; "
                f"{interface} needs another process"
            )
        return
    if not interface.replace(".", "").replace("-", "").replace("_", "").isalnum():
        raise CommandError(f"interface must be a name like lo or eth0, got {interface!r}")
    try:
        _domains[domain] = interface, Domain(domain, _CONFIG.format(interface))
    except DDSException as error:
        raise CommandError(
            f"cannot join DDS domain {domain} on interface {interface!r}: {error}"
        ) from error


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
