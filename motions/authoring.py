"""``@motion``: turns a function that returns a ``Timeline`` into a motion with checked parameters.

    @motion
    def nod(times: Annotated[int, Range(1, 5)] = 2) -> Timeline:
        \"\"\"Nod: the trunk says yes.\"\"\"

A parameter's annotation says which values are valid, its default what is taken otherwise.
"""

from __future__ import annotations

import importlib
import inspect
import pickle
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from go2_wbc.arguments import typed
from go2_wbc.brief import cut
from go2_wbc.errors import CommandError, TimelineError, unknown_name
from motions.arguments import is_number
from motions.language.timeline import Timeline

Value = float | int | str | bool


def parse_values(texts: Sequence[str]) -> dict[str, Value]:
    """``["hold=2.0", "side=left"]`` as parameters of a motion.

    Raises:
        CommandError: for one that is not NAME=VALUE.
    """
    return dict(_parse_value(text) for text in texts)


def _parse_value(text: str) -> tuple[str, Value]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise CommandError(f"a parameter is set by NAME=VALUE, got {text!r}")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


@typed(error=TimelineError)
@dataclass(frozen=True, slots=True)
class Range:
    """Numbers from ``low`` to ``high``, in ``unit``."""

    low: float
    high: float
    unit: str = ""

    def __post_init__(self) -> None:
        """Raise TimelineError if it is empty."""
        if not self.low <= self.high:
            raise TimelineError(f"Range: low must not be above high, got {self.low}, {self.high}")

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g} {self.unit}".strip()


@dataclass(frozen=True, slots=True, init=False)
class Choice:
    """One of some words."""

    words: tuple[str, ...]

    @typed(error=TimelineError)
    def __init__(self, *words: str) -> None:
        if not words:
            raise TimelineError("Choice: one word at least must be given")
        object.__setattr__(self, "words", words)

    def __str__(self) -> str:
        return " or ".join(self.words)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a motion: its name, what is valid, and what is taken by default."""

    name: str
    valid: Range | Choice
    default: Value

    def check(self, value: Value) -> Value:
        """``value``, as a number of the kind of the default.

        Raises:
            TimelineError: if it is not valid.
        """
        if isinstance(self.valid, Choice):
            if str(value) not in self.valid.words:
                raise TimelineError(unknown_name(self.name, str(value), self.valid.words))
            return value
        if not (is_number(value) and self.valid.low <= float(value) <= self.valid.high):
            raise TimelineError(f"{self.name} must be {self.valid}, got {value!r}")
        if isinstance(self.default, int) and not float(value).is_integer():
            raise TimelineError(f"{self.name} must be a whole number, got {value!r}")
        return type(self.default)(value)

    def __str__(self) -> str:
        shown = f"{self.default:g}" if isinstance(self.default, float) else str(self.default)
        return f"{self.name}={shown} ({self.valid})"


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion that can be made with other parameters.

    Attributes:
        name, summary: what users call it, and the first line of its docstring.
        parameters: what can be chosen.
        source: file and line where it is written.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    source: str
    _make: Callable[..., Timeline]

    def __repr__(self) -> str:
        return cut(f"Motion({', '.join([repr(self.name), *map(str, self.parameters)])})")

    def __reduce__(self) -> tuple[Callable[..., Motion], tuple[str, str]]:
        """By its module and name, as functions are: what a process pool needs."""
        names = (self._make.__module__, self._make.__qualname__)
        try:
            is_found = _motion_named(*names) == self
        except (ImportError, AttributeError):
            is_found = False
        if not is_found:
            raise pickle.PicklingError(
                f"motion {self.name!r} is not found as {names[1]} in module {names[0]}: pickle "
                "motions of files that can be imported, or the Timeline that they make"
            )
        return _motion_named, names

    def __call__(self, **values: Value) -> Timeline:
        """The timeline for these parameters.

        Raises:
            TimelineError: for an unknown parameter or a value that is not valid.
        """
        known = {parameter.name: parameter for parameter in self.parameters}
        checked: dict[str, Any] = {}
        for name, value in values.items():
            if name not in known:
                raise TimelineError(f"{self.name}: {unknown_name('parameter', name, known)}")
            checked[name] = known[name].check(value)
        try:
            timeline = self._make(**checked)
        except (Exception, SystemExit) as error:
            raise TimelineError(self._told(error)) from error
        if not isinstance(timeline, Timeline):
            raise TimelineError(
                f"{self.name}() must return a Timeline, it returned {type(timeline).__name__}"
            )
        return replace(timeline, name=self.name)

    def _told(self, error: BaseException) -> str:
        """``error`` with the line of the motion's file that caused it."""
        file, _, first = self.source.rpartition(":")
        where = f"{self.name} ({Path(file).name}, line {last_line(error, file) or first})"
        return f"{where}: {error if isinstance(error, TimelineError) else in_words(error)}"


def _motion_named(module: str, name: str) -> Motion:
    found: Motion = attrgetter(name)(importlib.import_module(module))
    return found


def in_words(error: BaseException) -> str:
    """What an error of a motion's file was."""
    if isinstance(error, SystemExit):
        return "the file ends the program (sys.exit): a file of motions must not"
    return f"{type(error).__name__}: {error}"


def last_line(error: BaseException, file: str) -> int | None:
    """Line of ``file`` that was running when ``error`` came, if one was."""
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == file]
    return lines[-1] if lines else None


@typed(error=TimelineError)
def motion(function: Callable[..., Timeline]) -> Motion:
    """Makes a motion of ``function``, which is named after it.

    Raises:
        TimelineError: if a parameter lacks its range or its default.
    """
    hints = get_type_hints(function, include_extras=True)
    parameters = tuple(
        _parameter(function.__name__, item, hints)
        for item in inspect.signature(function).parameters.values()
    )
    summary = (inspect.getdoc(function) or function.__name__).splitlines()[0]
    code = inspect.unwrap(function).__code__
    source = f"{code.co_filename}:{code.co_firstlineno}"
    return Motion(function.__name__, summary, parameters, source, function)


def _parameter(name: str, item: inspect.Parameter, hints: Mapping[str, object]) -> Parameter:
    hint = hints.get(item.name)
    valid = get_args(hint)[1] if get_origin(hint) is Annotated else None
    if not isinstance(valid, Range | Choice) or item.default is inspect.Parameter.empty:
        raise TimelineError(
            f"{name}: parameter {item.name!r} needs a range and a default, such as "
            f"{item.name}: Annotated[float, Range(0.0, 1.0)] = 0.5"
        )
    parameter = Parameter(item.name, valid, item.default)
    parameter.check(item.default)
    return parameter
