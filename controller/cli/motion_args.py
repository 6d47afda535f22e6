"""What the motion commands share: which motions are meant, with which parameters, in which file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from go2_wbc.errors import CommandError, unknown_name

if TYPE_CHECKING:
    from collections.abc import Sequence

    from go2_wbc.world import World
    from motions import CompiledPlan, FeasibilityReport, Motion, Timeline
    from motions.authoring import Parameter, Value

SAVED_MOTION, SAVED_PLAN = ".json", ".plan"
"""Endings of the files that ``save_motion`` and ``save_plan`` write."""
MOTION_HELP = "a name of the library, FILE.py[:NAME], or a saved FILE.json or FILE.plan"


def add_motion(parser: argparse.ArgumentParser, *, many: bool = False) -> None:
    """Add the argument for one motion, or any number, and the option for parameters."""
    number = "*" if many else None
    parser.add_argument("motion", metavar="MOTION", nargs=number, help=MOTION_HELP)
    add_values(parser)


def add_values(parser: argparse.ArgumentParser) -> None:
    """Add the option for parameters of a motion."""
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        dest="values",
        help="a parameter of the motion; see `go2-wbc list`",
    )


def add_world(parser: argparse.ArgumentParser) -> None:
    """Add the options that say in which world a motion is done."""
    parser.add_argument("--friction", metavar="MU", type=float, help="of feet and floor")
    parser.add_argument("--payload", metavar="KG", type=float, help="extra mass on the trunk")


def world_of(args: argparse.Namespace, usual: World | None = None) -> World:
    """The world that the options say; what they do not, is as in ``usual``.

    Raises:
        ConfigError: if it is out of range.
    """
    from go2_wbc.world import World

    return World.of(args.friction, args.payload, usual)


def meant(words: list[str], settings: list[str]) -> list[Timeline | CompiledPlan]:
    """The motions, or saved plans, that are meant; the whole library if there is no word.

    Raises:
        CommandError: for an unknown name or a setting that cannot be read.
        TimelineError: for a file that cannot be used or a parameter out of range.
        MotionFileError: for a saved motion or plan that cannot be used.
    """
    from motions import motion_names
    from motions.authoring import parse_values

    values = parse_values(settings)
    return [line for word in words or motion_names() for line in _meant_by(word, values)]


def the_motion(word: str, settings: list[str]) -> Timeline | CompiledPlan:
    """The one motion or plan that is meant; raises as ``meant``, and CommandError for several."""
    found = meant([word], settings)
    if len(found) > 1:
        names = ", ".join(line.name for line in found)
        raise CommandError(f"{word} has several motions, choose FILE.py:NAME: {names}")
    return found[0]


def _meant_by(word: str, values: dict[str, Value]) -> Sequence[Timeline | CompiledPlan]:
    from motions import load_motion, load_plan

    if word.endswith(SAVED_PLAN):
        if values:
            raise CommandError(f"{word}: a saved plan has no parameters, got {', '.join(values)}")
        return [load_plan(word)]
    if word.endswith(SAVED_MOTION):
        return [load_motion(word, **values)]
    return [motion(**values) for motion in motions_of(word)]


def motions_of(word: str) -> list[Motion]:
    """The motion of the library with that name, or those of a file: FILE.py or FILE.py:NAME.

    Raises:
        CommandError: for an unknown name.
        TimelineError: for a file that cannot be used.
    """
    from motions import find_motion, load_file

    path, _, name = word.partition(":")
    if not path.endswith(".py"):
        return [find_motion(word)]
    own = load_file(path)
    if name and name not in own:
        raise CommandError(f"{path}: {unknown_name('motion', name, own)}")
    return [own[name]] if name else list(own.values())


def print_verdict(report: FeasibilityReport) -> None:
    """Print a line about a motion, and one for each limit that it breaks."""
    lines = [report.summary(), *(f"     {finding}" for finding in report.failures)]
    print("\n".join(lines), flush=True)


class MotionSource:
    """Makes a motion anew whenever its file was saved.

    Attributes:
        path: the file.
        name: of the motion.
        parameters: those that it had when it was made last, with what was chosen for each; a saved
            motion has none.
    """

    def __init__(self, word: str, settings: list[str]) -> None:
        """Find the one motion that is meant; raises as ``the_motion``."""
        is_saved = word.endswith((SAVED_MOTION, SAVED_PLAN))
        own = word if is_saved else word.partition(":")[0]
        if not (is_saved or own.endswith(".py")):
            # of the library: read its file too, as if it were one's own
            (motion,) = motions_of(word)
            own = motion.source.rpartition(":")[0]
            word = f"{own}:{word}"
        self._word, self._settings, self.path = word, settings, Path(own)
        self._is_saved, self._is_new_choice = is_saved, False
        self._chosen: dict[str, Value] = {}
        self.parameters: dict[Parameter, Value] = {}
        self._seen = self._last = self._signature()
        self.name = self.motion().name

    def motion(self) -> Timeline | CompiledPlan:
        """The motion as its file says now, with what was chosen; raises as ``the_motion``."""
        from motions.authoring import parse_values

        if self._is_saved:
            return the_motion(self._word, self._settings)
        found = motions_of(self._word)
        if len(found) > 1:
            names = ", ".join(motion.name for motion in found)
            raise CommandError(f"{self._word} has several motions, choose FILE.py:NAME: {names}")
        parameters = {parameter.name: parameter for parameter in found[0].parameters}
        chosen = {name: value for name, value in self._chosen.items() if name in parameters}
        values = {**parse_values(self._settings), **chosen}
        self.parameters = {
            item: values.get(name, item.default) for name, item in parameters.items()
        }
        return found[0](**values)

    def choose(self, values: dict[str, Value]) -> None:
        """Take other values for parameters; any thread may call."""
        self._chosen, self._is_new_choice = values, True

    def has_changed(self) -> bool:
        """Whether other values were chosen, or the file was saved and rested since the call before.

        A save takes a moment, in which the file may be empty, cut short or away.
        """
        if self._is_new_choice:
            self._is_new_choice = False
            return True
        now = self._signature()
        has_rested, self._last = now == self._last, now
        if now is None or now == self._seen or not has_rested:
            return False
        self._seen = now
        return True

    def _signature(self) -> tuple[int, int, int] | None:
        try:
            status = self.path.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size, status.st_ino
