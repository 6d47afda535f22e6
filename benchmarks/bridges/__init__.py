"""The benches of the bridges: other people's protocols between real processes on the loopback."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchmarks.bridges import ros2, ros2_faults, unitree, unitree_faults
from benchmarks.rows import Family
from controller.bridges.unitree.extra import require_dds
from go2_wbc.errors import CommandError, unknown_name


@dataclass(frozen=True, slots=True)
class Door:
    """A middleware through which the robot is reached.

    Attributes:
        name: what the command line takes.
        families: what is measured of it.
        require: raises ``MissingDependency`` if what it needs is not installed.
    """

    name: str
    families: tuple[Family, ...]
    require: Callable[[], None]


DOORS: tuple[Door, ...] = (
    Door("ros2", (ros2.FAMILY, ros2_faults.FAMILY), ros2.require),
    Door("unitree", (*unitree.FAMILIES, unitree_faults.FAMILY), require_dds),
)


def find_doors(names: Sequence[str]) -> tuple[Door, ...]:
    """The doors, each with the families that are named, by themselves or by their door.

    Args:
        names: of doors or families; none means all.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    valid = [name for door in DOORS for name in (door.name, *(f.name for f in door.families))]
    for name in names:
        if name not in valid:
            raise CommandError(unknown_name("bench", name, valid))
    chosen = []
    for door in DOORS:
        is_whole = not names or door.name in names
        families = tuple(f for f in door.families if is_whole or f.name in names)
        if families:
            chosen.append(Door(door.name, families, door.require))
    return tuple(chosen)
