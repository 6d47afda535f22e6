"""The world that the page has chosen: a motion is checked and played in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from go2_wbc.errors import ConfigError, StudioError
from go2_wbc.world import RANGES, SENSORS, World

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


def shown(world: World) -> dict[str, object]:
    """As the page needs it, with what may be chosen."""
    return {
        **{name: getattr(world, name) for name in (*NUMBERS, "sensors")},
        "told": str(world),
        "is_usual": world == World(),
        "ranges": {name: RANGES[name] for name in NUMBERS},
        "choices": SENSORS,
    }
