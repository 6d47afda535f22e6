"""Robots that are on a domain already: two would answer every call, and talk over each other."""

from __future__ import annotations

from typing import Final

from controller.bridges.unitree import idl
from controller.bridges.unitree.bus import Bus
from go2_wbc.errors import BridgeError

DISCOVERY: Final = 0.5
"""Time [s] that a robot gets to be heard; some hundredths on an idle machine."""


def require_no_robot(domain: int, interface: str) -> None:
    """Make sure that nobody publishes ``rt/lowstate``.

    Raises:
        BridgeError: if somebody does.
        CommandError: for a domain or interface that does not exist.
    """
    states = Bus(domain, interface).reader("rt/lowstate", idl.low_state(), depth=1)
    if states.wait(DISCOVERY):  # not its writer: the C++ SDK has one and uses it for nothing
        raise BridgeError(
            f"a robot is already on DDS domain {domain}, interface {interface}; "
            "choose another --domain, or end the other simulator"
        )
