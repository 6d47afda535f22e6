"""Takes the robot from its sport service, which would fight the low-level commands otherwise."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from typing import Final

from controller.bridges.unitree.bus import Bus
from controller.bridges.unitree.rpc import Client
from controller.bridges.unitree.sport_api import SWITCHER_SERVICE, Code, SwitcherApi
from go2_wbc.errors import PlantError

_log = logging.getLogger(__name__)

DISCOVERY: Final = 1.0
"""Time [s] in which the service must be found."""
RELEASE_LIMIT: Final = 5.0
"""Time [s] in which it must let go."""
PAUSE: Final = 0.2
"""Time [s] between two requests."""


def release_sport(bus: Bus, require_lying: Callable[[], None], *, may_lack: bool) -> None:
    """Release whatever motion service has the robot.

    Args:
        bus: the robot's.
        require_lying: called before each release; raises if the robot does not lie any more.
        may_lack: whether the robot may have no motion switcher, as some simulators.

    Raises:
        PlantError: if the service keeps the robot, or there is no switcher although there must.
    """
    client = Client(bus, SWITCHER_SERVICE)
    if not client.wait_for_server(DISCOVERY):
        if not may_lack:
            raise PlantError(
                "no motion switcher answers, so nobody can tell what else moves this robot"
            )
        _log.warning("no motion switcher answers: taking for granted that nobody has the robot")
        return
    deadline = time.monotonic() + RELEASE_LIMIT
    while name := _active_service(client):
        if time.monotonic() > deadline:
            raise PlantError(
                f"the motion service {name!r} keeps the robot: lay it down and end what runs there"
            )
        require_lying()
        client.call(SwitcherApi.RELEASE_MODE)
        time.sleep(PAUSE)


def _active_service(client: Client) -> str:
    response = client.ask(SwitcherApi.CHECK_MODE)
    if response.code != Code.OK:
        raise PlantError(f"the motion switcher answered {response.code} to CheckMode")
    try:
        return str(json.loads(response.data).get("name") or "")
    except (ValueError, AttributeError) as error:
        raise PlantError(f"the motion switcher said {response.data!r}") from error
