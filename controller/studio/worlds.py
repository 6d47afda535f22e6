"""The world that the page has chosen: a motion is checked in it, and played there, on its ground.

The page asks for it by ``friction``, ``payload``, ``sensors``; and ``ground``, ``size``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from controller.studio import grounds
from controller.studio.grounds import PlayedGround
from go2_wbc.errors import ConfigError, StudioError
from go2_wbc.world import RANGES, SENSORS, World

if TYPE_CHECKING:
    from viz.content import ReplayContent

NUMBERS = ("friction", "payload")


def world_of(order: Mapping[str, object]) -> World:
    """The one that a page asks for; what it leaves out is as usual.

    Raises:
        StudioError: for what is no number, no such word, or out of range.
    """
    values = dict[str, float]()
    for name in NUMBERS:
        value = order.get(name, getattr(World(), name))
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise StudioError(f"{name} must be a number, got {value!r:.40}")
        values[name] = value
    try:
        world = World.of(values["friction"], values["payload"])
        return replace(world, sensors=str(order.get("sensors", world.sensors)))
    except ConfigError as error:
        raise StudioError(str(error).replace("World.", "")) from error


def told(world: World, ground: PlayedGround) -> str:
    """What a motion is played in, in words."""
    return ", ".join(filter(None, (str(world), str(ground))))


def judged(content: ReplayContent, ground: PlayedGround) -> ReplayContent:
    """It with a verdict that says what ground it is of, where physics plays on another one."""
    if content.verdict is None or ground == PlayedGround():
        return content
    verdict = replace(content.verdict, world=f"{content.verdict.world}, level ground")
    return replace(content, verdict=verdict)


def shown(world: World, ground: PlayedGround) -> dict[str, object]:
    """As the page needs it, with what may be chosen."""
    return {
        **{name: getattr(world, name) for name in (*NUMBERS, "sensors")},
        **grounds.shown(ground),
        "told": told(world, ground),
        "is_usual": (world, ground) == (World(), PlayedGround()),
        "ranges": {name: RANGES[name] for name in NUMBERS},
        "choices": SENSORS,
    }
