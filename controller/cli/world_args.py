"""The options that say in which world: friction and load."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from go2_wbc.errors import CommandError

if TYPE_CHECKING:
    from go2_wbc import World


def add_world(parser: argparse.ArgumentParser) -> None:
    """Add ``--friction``, ``--payload`` and ``--payload-at``."""
    parser.add_argument(
        "--friction", metavar="MU", type=float, help="of feet and ground, default 0.5"
    )
    parser.add_argument("--payload", metavar="KG", type=float, help="extra mass, default none")
    parser.add_argument(
        "--payload-at", metavar="X,Y,Z", help="its place [m] in the frame of the base"
    )


def the_world(args: argparse.Namespace) -> World:
    """The world that is meant.

    Raises:
        CommandError: for a place that is not three numbers.
        ConfigError: for a number that is out of range.
    """
    from go2_wbc import World

    given = {name: getattr(args, name) for name in ("friction", "payload")}
    settings = {name: value for name, value in given.items() if value is not None}
    if args.payload_at is not None:
        settings["payload_place"] = _place(args.payload_at)
    return World(**settings)


def _place(text: str) -> tuple[float, ...]:
    try:
        place = tuple(float(part) for part in text.split(","))
    except ValueError:
        place = ()
    if len(place) != 3:
        raise CommandError(f"--payload-at needs three numbers such as 0.1,0,0.05, got {text!r}")
    return place
