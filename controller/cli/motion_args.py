"""What the motion commands share: which motions are meant, with which parameters, in which file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

from go2_wbc.brief import counted
from go2_wbc.errors import CommandError, unknown_name

if TYPE_CHECKING:
    from controller.cli.common import ProgressLine
    from go2_wbc.config import Config
    from go2_wbc.world import World
    from motions import CompiledPlan, FeasibilityChecker, FeasibilityReport, Motion, Timeline
    from motions.authoring import Parameter, Value

    T = TypeVar("T", Motion, Timeline | CompiledPlan)

SAVED_MOTION, SAVED_PLAN = ".json", ".plan"
"""Endings of the files that ``save_motion`` and ``save_plan`` write."""
MOTION_HELP = "a name of the library, FILE.py[:NAME], or a saved FILE.json or FILE.plan"
MotionWord = Annotated[str, "MOTION", MOTION_HELP]
Settings = Annotated[Sequence[str], "NAME=VALUE", "a parameter of the motion; see `go2-wbc list`"]
Friction = Annotated[float | None, "MU", "of feet and floor"]
Payload = Annotated[float | None, "KG", "extra mass on the trunk"]
Sensors = Annotated[str, "WHAT", "what the robot feels: ideal, noisy, or imu for its own sensors"]


def meant(words: Sequence[str], settings: Sequence[str]) -> list[Timeline | CompiledPlan]:
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


def the_motion(word: str, settings: Sequence[str]) -> Timeline | CompiledPlan:
    """The one motion or plan that is meant; raises as ``meant``, and CommandError for several."""
    return _only(word, meant([word], settings))


def _only(word: str, found: Sequence[T]) -> T:
    if len(found) > 1:
        names = ", ".join(motion.name for motion in found)
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
    broken = [f"     {finding}" for finding in report.failures]
    number = counted(len(broken), "limit")
    head = report.summary() if report.ok else f"no   {report.motion:<15} {number} broken"
    print("\n".join([head, *broken]), flush=True)


def checker_of(config: Config, world: World, line: ProgressLine) -> FeasibilityChecker:
    """The check of a robot with these numbers in ``world``; ``line`` shows how solving goes."""
    from go2_wbc.robot.model import RobotModel
    from motions import FeasibilityChecker

    model = RobotModel(motor=config.motor)
    return FeasibilityChecker(model, config.feasibility, world=world, progress=line.solving)


class MotionSource:
    """Makes a motion anew whenever its file was saved.

    Attributes:
        path: the file.
        name: of the motion.
        parameters: those that it had when it was made last, with what was chosen for each; a saved
            motion has none.
    """

    def __init__(self, word: str, settings: Sequence[str]) -> None:
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
        motion = _only(self._word, motions_of(self._word))
        parameters = {parameter.name: parameter for parameter in motion.parameters}
        chosen = {name: value for name, value in self._chosen.items() if name in parameters}
        values = {**parse_values(self._settings), **chosen}
        self.parameters = {
            item: values.get(name, item.default) for name, item in parameters.items()
        }
        return motion(**values)

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
