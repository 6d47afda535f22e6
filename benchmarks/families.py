"""All families of the behaviour bench, in the order of the report."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks import (
    goals,
    high_fives,
    library,
    model,
    postures,
    sequence,
    slaps,
    trotting,
)
from benchmarks.rows import Family
from go2_wbc.errors import CommandError, unknown_name

FAMILIES: tuple[Family, ...] = (
    model.AGREEMENT,
    model.SOLUTIONS,
    postures.STAND,
    postures.PUSHES,
    trotting.TROT,
    trotting.PUSHES,
    goals.FAMILY,
    high_fives.FAMILY,
    slaps.FAMILY,
    library.FAMILY,
    sequence.FAMILY,
)


def find_families(names: Sequence[str]) -> tuple[Family, ...]:
    """The families of those names, in the order of the report; all if there is no name.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    valid = [family.name for family in FAMILIES]
    for name in names:
        if name not in valid:
            raise CommandError(unknown_name("row", name, valid))
    return tuple(family for family in FAMILIES if not names or family.name in names)
