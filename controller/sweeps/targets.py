"""What is swept: words of the command line, functions, motions; as functions that workers load.

And what the rows depend on besides the seeds: code, libraries, Python.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.metadata
import inspect
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING

from controller.sweeps.sweep_file import Row, row_of
from go2_wbc.errors import CommandError, Go2WbcError, SweepError, unknown_name

if TYPE_CHECKING:
    from go2_wbc.world import World


ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("go2_wbc", "motions", "controller")  #: Packages whose code decides what a run gives
LIBRARIES = ("mujoco", "pin", "placo", "proxsuite", "numpy")
_SHOWN = 12  #: Digits of a digest that are kept


def digest(content: bytes) -> str:
    """A short name for ``content``, which nothing else has."""
    return hashlib.sha256(content).hexdigest()[:_SHOWN]


def code_digest(root: Path = ROOT, packages: Sequence[str] = SOURCES) -> str:
    """A short name for the code of the packages in ``root``."""
    code = hashlib.sha256()
    for file in sorted(file for name in packages for file in (root / name).rglob("*.py")):
        code.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes())
    return code.hexdigest()[:_SHOWN]


def identity(root: Path = ROOT, packages: Sequence[str] = SOURCES) -> dict[str, str]:
    """What results depend on besides what was run: two runs that agree in it give equal rows."""
    return {
        "version": importlib.metadata.version("go2-wbc"),
        "python": platform.python_version(),
        "libraries": ", ".join(f"{n} {importlib.metadata.version(n)}" for n in LIBRARIES),
        "code": code_digest(root, packages),
    }


FORMS = (
    "a motion (a name of the library, FILE.py[:NAME], a saved FILE.json or FILE.plan), "
    "gait:NAME[@VX[,VY[,WZ]]], push:IMPULSE[@SPEED], or a function (seed) -> row as "
    "FILE.py:NAME or MODULE:NAME"
)
SPEED = 0.5  #: Speed [m/s] of a gait or a pushed robot of which nothing is said


@dataclass(frozen=True, slots=True)
class Target:
    """What is swept."""

    name: str  #: as a person calls it
    function: Callable[[int], object]  #: from a seed to a row; can be pickled
    about: Mapping[str, str | bytes] = field(default_factory=dict)
    """What its rows depend on besides the project's code."""

    @property
    def call(self) -> Callable[[int], Row]:
        """What workers call."""
        return partial(checked_row, self.function, own_code())


def checked_row(function: Callable[[int], object], code: tuple[str, str], seed: int) -> Row:
    """The row of a seed, by a worker of the same code and libraries as its parent.

    Raises:
        SweepError: if it has others, or what the function gives is no row.
    """
    if (own := own_code()) != code:
        raise SweepError(
            f"this worker has other code than the sweep: {' and '.join(own)}, not "
            f"{' and '.join(code)}; install the same version everywhere"
        )
    return row_of(function(seed))


@cache
def own_code() -> tuple[str, str]:
    """The code and libraries of this process."""
    own = identity()
    return own["code"], own["libraries"]


@dataclass(frozen=True, slots=True)
class LoadedFunction:
    """A function of a module or file, found again in every process."""

    place: str  #: the dotted name of a module, or the path of a file
    name: str  #: of the function
    content: str  #: digest of the file

    def __call__(self, seed: int) -> object:
        """What the function gives.

        Raises:
            SweepError: if the file has changed since the sweep began.
        """
        module, content = _loaded(self.place)
        if content != self.content:
            raise SweepError(f"{self.place} has changed since the sweep began: begin anew")
        return getattr(module, self.name)(seed)


@cache
def _loaded(place: str) -> tuple[ModuleType, str]:
    """A module, and the digest of its file; loaded once in each process.

    Raises:
        CommandError: if there is none, or it does not run.
    """
    try:
        if not place.endswith(".py"):
            module = importlib.import_module(place)
            return module, digest(Path(inspect.getfile(module)).read_bytes())
        return _loaded_file(Path(place))
    except Go2WbcError:
        raise
    except (Exception, SystemExit) as error:
        raise CommandError(f"cannot load {place}: {type(error).__name__}: {error}") from error


def _loaded_file(file: Path) -> tuple[ModuleType, str]:
    content = file.read_bytes()
    module = ModuleType(f"_swept_{file.stem}")
    module.__file__ = str(file)
    sys.modules[module.__name__] = module  # dataclasses look there
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))  # what lies beside it can be imported
    exec(compile(content, str(file), "exec"), module.__dict__)
    return module, digest(content)


def target_of(what: object) -> Target:
    """What ``what`` stands for.

    Args:
        what: a word of the command line (see ``FORMS``), a function of a module, a ``Playable``.

    Raises:
        CommandError: for what stands for nothing; says what is valid.
        TimelineError, MotionFileError: for a motion that cannot be used.
    """
    if isinstance(what, Target):
        return what
    if not isinstance(what, str):
        return _of_callable(what) if isinstance(what, FunctionType) else motion_target(what)
    kind, _, rest = what.partition(":")
    if kind == "gait":
        return _gait(what, rest)
    if kind == "push":
        return _push(what, rest)
    if rest or kind.endswith(".py"):
        return _of_file(what, kind, rest)
    return motion_target(what)


def motion_target(motion: object, name: str = "", world: World | None = None) -> Target:
    """The target that plays a motion in samples of a world, by default ``DOUBTFUL``.

    ``motion`` is a ``Playable``, and compiled here.

    Raises:
        CommandError: for what stands for no motion, or starts lying.
        TimelineError, MotionFileError: for a motion that cannot be used.
    """
    from controller.sweeps.motion_study import MotionStudy, archive_of, text_of
    from go2_wbc.motion_plan import Posture
    from go2_wbc.robot.model import RobotModel
    from go2_wbc.world import DOUBTFUL
    from motions import CompiledPlan
    from motions.feasibility import compile_motion

    plan = compile_motion(motion, RobotModel())
    if not isinstance(plan, CompiledPlan):
        raise CommandError(f"only a compiled plan can be swept, got {type(plan).__name__}")
    if plan.entry not in (Posture.STAND, Posture.SIT):
        raise CommandError(f"{plan.name} starts from {plan.entry.value}: cannot be swept")
    archive = archive_of(plan)
    world = DOUBTFUL if world is None else world
    about: dict[str, str | bytes] = {"kind": "motion", "plan": archive, "world": text_of(world)}
    return Target(name or plan.name, MotionStudy(archive, world), about)


def _of_callable(function: FunctionType) -> Target:
    module, name = inspect.getmodule(function), function.__qualname__
    place = None if module is None else module.__name__
    if place == "__main__":
        place = getattr(module, "__file__", None)
        place = place and str(Path(place).resolve())
    if not place or not name.isidentifier():
        raise CommandError(
            f"{name} cannot be found by other processes: write it as a function of a module or file"
        )
    return _function(f"{place}:{name}", place, name)


def _of_file(word: str, place: str, name: str) -> Target:
    """A function or a motion of a file, or a function of a module."""
    if not place.endswith(".py"):
        return _function(word, place, name)
    path = Path(place).resolve()
    if not path.is_file():
        raise CommandError(f"there is no file {place}")
    module, _ = _loaded(str(path))
    if name and inspect.isroutine(getattr(module, name, None)):
        return _function(word, str(path), name)
    from motions import Motion, load_file  # takes its time

    if name and not isinstance(getattr(module, name, None), Motion):
        return _function(word, str(path), name)  # which tells what there is
    own = load_file(path)
    if not name and len(own) > 1:
        raise CommandError(f"{place} has several motions, choose one: {', '.join(own)}")
    return motion_target(own[name or next(iter(own))], word)


def _function(word: str, place: str, name: str) -> Target:
    module, content = _loaded(place)
    functions = [key for key, value in vars(module).items() if inspect.isroutine(value)]
    if name not in functions:
        raise CommandError(f"{place}: {unknown_name('function', name, functions)}")
    about = {"kind": "function", "content": content}
    return Target(word, LoadedFunction(place, name, content), about)


def _gait(word: str, rest: str) -> Target:
    from controller.sweeps.trials import GaitStudy
    from go2_wbc.contacts import find_gait
    from go2_wbc.planning.command import VelocityCommand

    name, _, speeds = rest.partition("@")
    gait = find_gait(name).name
    command = VelocityCommand(*_numbers(word, speeds, 3)) if speeds else VelocityCommand(SPEED)
    return Target(word, GaitStudy(gait, command), {"kind": "gait", "command": repr(command)})


def _push(word: str, rest: str) -> Target:
    from controller.sweeps.trials import PushStudy

    impulse, _, speed = rest.partition("@")
    (newton_seconds,) = _numbers(word, impulse, 1)
    (metres_per_second,) = _numbers(word, speed, 1) if speed else (SPEED,)
    study = PushStudy(newton_seconds, metres_per_second)
    return Target(word, study, {"kind": "push", "push": repr(study)})


def _numbers(word: str, text: str, most: int) -> list[float]:
    from go2_wbc.planning.command import finite_number

    try:
        values = [finite_number(word, float(part)) for part in text.split(",")]
    except ValueError as error:
        raise CommandError(f"{word}: {text!r} is no finite number; valid: {FORMS}") from error
    if len(values) > most:
        raise CommandError(f"{word}: at most {most} numbers, got {len(values)}; valid: {FORMS}")
    return values
