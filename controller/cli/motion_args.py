"""What the motion commands share: which motions are meant, with which parameters."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from go2_wbc.errors import CommandError, unknown_name

if TYPE_CHECKING:
    from motions import Motion, Timeline
    from motions.authoring import Value

MOTION_HELP = "a name of the library, FILE.py, or FILE.py:NAME"


def add_motion(parser: argparse.ArgumentParser, *, many: bool = False) -> None:
    """Add the argument for one motion, or any number, and the option for parameters."""
    if many:
        parser.add_argument("motion", metavar="MOTION", nargs="*", help=MOTION_HELP)
    else:
        parser.add_argument("motion", metavar="MOTION", help=MOTION_HELP)
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        dest="values",
        help="a parameter of the motion; see `go2-wbc list`",
    )


def timelines(words: list[str], settings: list[str]) -> list[Timeline]:
    """The motions that are meant; the whole library if there is no word.

    Raises:
        CommandError: for an unknown name or a setting that cannot be read.
        TimelineError: for a file that cannot be used or a parameter out of range.
    """
    from motions import motion_names

    values = dict(_setting(text) for text in settings)
    found = [motion for word in words or motion_names() for motion in _motions(word)]
    return [motion(**values) for motion in found]


def the_motion(word: str, settings: list[str]) -> Timeline:
    """The one motion that is meant.

    Raises:
        CommandError: for an unknown name, a setting that cannot be read, or several motions.
        TimelineError: for a file that cannot be used or a parameter out of range.
    """
    found = timelines([word], settings)
    if len(found) > 1:
        names = ", ".join(line.name for line in found)
        raise CommandError(f"{word} has several motions, choose FILE.py:NAME: {names}")
    return found[0]


def _motions(word: str) -> list[Motion]:
    from motions import find_motion, load_file

    path, _, name = word.partition(":")
    if not path.endswith(".py"):
        return [find_motion(word)]
    own = load_file(path)
    if not name:
        return list(own.values())
    if name not in own:
        raise CommandError(f"{path}: {unknown_name('motion', name, own)}")
    return [own[name]]


def _setting(text: str) -> tuple[str, Value]:
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise CommandError(f"--set needs NAME=VALUE, got {text!r}")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value
