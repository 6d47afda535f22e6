"""Bad values for every public parameter, option and key, made from signatures and schemas.

    python -m tests.test_bad_inputs              prints those that are not refused as they must be
    python -m tests.test_bad_inputs --only hold  of these names

Each is wrong in type, not finite, huge, negative, empty or unknown. It must end in an error of our
own that says what was wrong, or in a warning; on the command line with the exit code of wrong
usage. It runs without the checks of types that the tests have, since users have none.
"""

import argparse
import contextlib
import dataclasses
import importlib
import inspect
import io
import logging
import math
import os
import re
import signal
import sys
import types
import typing
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.cli.common import ExitCode, folder
from controller.sweeps.engine import ONE_THREAD
from go2_wbc.errors import Go2WbcError
from motions import deg, find_motion
from tests.good_inputs import (
    EXEMPT,
    EXEMPT_HUGE,
    GOOD,
    LEGAL,
    LIKE,
    MADE_INSIDE,
    OWNERS,
    THINGS,
    WITH,
    place,
    thing,
)
from tests.script_server import ROOT, run_script

PACKAGES = ("go2_wbc", "controller", "motions", "viz")
LONGEST = 5.0  # s of CPU; a refusal takes no time
HUGE = (1e300, -1e300, 10**400)
NUMBERS = ("three", None, [], True, math.nan, math.inf, np.zeros(2), *HUGE)
NO_PATHS = ("", 300 * "n", "a\0b", "\ud800")  # no file system has these
BAD: dict[object, tuple[object, ...]] = {
    float: NUMBERS,
    int: ("three", None, [], math.nan, 1.5, 10**400, -(10**400)),
    bool: ("yes", None, 2, []),
    str: (5, None, [], np.zeros(2)),
    Path: (5, [], *NO_PATHS),
}
NEVER_NEGATIVE = {
    *("over", "duration", "seconds", "period", "rate", "factor", "amplitude", "hold", "flight"),
    *("longest", "shift_time", "payload", "friction", "timestep", "control_period", "mass_scale"),
    *("n", "first_seed", "workers", "times", "fps", "speed", "beats_per_minute", "delay", "until"),
}
WORDS = {
    *("gait", "side", "kind", "at", "sensors", "robot", "backend", "engine", "leg", "joint"),
    *("physics", "motor", "solver", "motion", "stance", "frame", "ease"),
}
"""Of texts that stand for something."""
Call = Callable[[], object]


@dataclass(frozen=True, slots=True)
class Case:
    """One bad value."""

    where: str  #: what it is given to
    value: object  #: it
    call: Call  #: gives it
    code: int | None = None  #: with which a command must end; None for what is no command

    def __str__(self) -> str:
        return f"{self.where} = {self.value!r:.40}"


def bad_values(kind: object) -> list[object]:
    """Values that the type ``kind`` does not take."""
    parts = typing.get_args(kind)
    if isinstance(kind, types.UnionType) or typing.get_origin(kind) is typing.Union:
        each = [bad_values(part) for part in parts if part is not types.NoneType]
        common = [value for value in each[0] if all(_holds(value, other) for other in each[1:])]
        common += NO_PATHS[1:] if Path in parts else ()
        return [v for v in common or [object()] if v is not None or types.NoneType not in parts]
    if kind in BAD:
        return list(BAD[kind])
    origin = typing.get_origin(kind) or kind
    if origin is tuple or (inspect.isclass(origin) and issubclass(origin, Iterable)):
        if inspect.isclass(origin) and issubclass(origin, Enum):
            return [5, "nonsense"]
        return [5, object(), *([[None]] if parts else [])]
    if getattr(kind, "array_type", None) is np.ndarray:
        return [5, "three", None, np.zeros((2, 3, 5, 7))]
    if kind in (Any, object) or isinstance(kind, typing.TypeVar | str):
        return []
    return [5, "nonsense", object()]


def _holds(value: object, values: list[object]) -> bool:
    told = {(type(other), repr(other)) for other in values}
    return any(value is other for other in values) or (type(value), repr(value)) in told


def public() -> Iterator[tuple[str, Callable[..., Any], Callable[[], object] | None]]:
    """Every public function and method: its name, it, and what makes the object it is of.

    Public is what a package names, and what a parameter of that takes or a property of it gives.
    """
    modules = {name: importlib.import_module(name) for name in PACKAGES}
    named = {f"{p}.{n}": getattr(modules[p], n) for p in PACKAGES for n in modules[p].__all__}
    items = {v: k for k, v in named.items() if inspect.isclass(v) or inspect.isfunction(v)}
    queue = [*items]
    for item in queue:
        is_class = inspect.isclass(item) and not issubclass(item, Enum | Exception)
        calls = [*_calls(items[item], item)] if is_class or inspect.isfunction(item) else []
        yield from calls
        further = [kind for _, call, _ in calls for kind in _taken(call)]
        if is_class:
            further += [kind for value in vars(item).values() for kind in _taken(value, "return")]
        for kind in further:
            if kind not in items:
                items[kind] = f"{kind.__module__.partition('.')[0]}.{kind.__name__}"
                queue.append(kind)


def _calls(
    where: str,
    item: Any,  # noqa: ANN401
) -> Iterator[tuple[str, Callable[..., Any], Callable[[], object] | None]]:
    if not inspect.isclass(item) or not (inspect.isabstract(item) or item.__name__ in MADE_INSIDE):
        yield where, item, None
    if inspect.isclass(item):
        yield from _methods(where, item)


def _taken(call: Any, only: str = "") -> Iterator[type]:  # noqa: ANN401
    """Our classes that its parameters take; those of an abstract one are all of its kind."""
    if only and not isinstance(call, property):
        return
    hints = _hints(call.fget or print if isinstance(call, property) else call)
    kinds = [kind for name, kind in hints.items() if (name == "return") == bool(only)]
    for kind in kinds:
        kinds += typing.get_args(kind)
        if inspect.isclass(kind) and kind.__module__.partition(".")[0] in PACKAGES:
            kinds += kind.__subclasses__() if inspect.isabstract(kind) else []
            if getattr(importlib.import_module(kind.__module__), kind.__name__) is kind:
                yield kind  # and not what a dataclass with slots was made of


def _methods(where: str, owner: type) -> Iterator[tuple[str, Any, Callable[[], object] | None]]:
    make = THINGS.get(owner.__name__)
    for name in sorted(vars(owner).keys() | set().union(*(vars(c) for c in owner.__mro__))):
        static = inspect.getattr_static(owner, name)
        if name.startswith("_") or not isinstance(
            static, types.FunctionType | staticmethod | classmethod
        ):
            continue
        if isinstance(static, types.FunctionType):
            if make is not None:
                yield f"{where}.{name}", static, OWNERS.get(f"{where}.{name}", make)
        else:
            yield f"{where}.{name}", getattr(owner, name), None


def of_signatures() -> Iterator[Case]:
    """A case for each bad value of each parameter."""
    for where, function, make in public():
        if where.split(".")[-1] in MADE_INSIDE or where in EXEMPT:
            continue
        hints = _hints(function)
        parameters = list(inspect.signature(function).parameters.values())[make is not None :]
        for parameter in parameters:
            if parameter.name.startswith("_") or parameter.kind is parameter.VAR_KEYWORD:
                continue
            values = bad_values(hints.get(parameter.name, Any))
            values += (
                [-1] if parameter.name in NEVER_NEGATIVE and float in map(type, values) else []
            )
            values += ["nonsense", ""] if parameter.name in WORDS else []
            for value in values:
                label = f"{where}({parameter.name})"
                if (
                    value is parameter.default
                    or label in EXEMPT
                    or (where in EXEMPT_HUGE and any(value is huge for huge in HUGE[:2]))
                ):
                    continue
                yield Case(label, value, partial(_given, where, function, make, parameter, value))


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    target: Any = function.__init__ if inspect.isclass(function) else function
    if dataclasses.is_dataclass(function):
        target = function
    try:
        hints = typing.get_type_hints(target)
    except NameError:
        return {}
    return {
        name: hint.type if isinstance(hint, dataclasses.InitVar) else hint
        for name, hint in hints.items()
    }


def _given(
    where: str,
    function: Callable[..., Any],
    make: Callable[[], object] | None,
    bad: inspect.Parameter,
    value: object,
) -> object:
    owner = [] if make is None else [make()]
    keywords: dict[str, object] = {}
    rest: list[object] = []
    for parameter in list(inspect.signature(function).parameters.values())[len(owner) :]:
        if parameter.kind is parameter.VAR_POSITIONAL:
            rest = [value] if parameter.name == bad.name else []
        elif parameter.name == bad.name:
            keywords[parameter.name] = value
        elif parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD:
            keywords[parameter.name] = good(where, parameter.name)
    keywords = {**WITH.get(where, {}), **keywords}
    result = function(*owner, *rest, **keywords) if rest else function(*owner, **keywords)
    if inspect.isgenerator(result):
        return next(result)
    return result


def good(where: str, name: str) -> object:
    """A good value of a parameter that must be given."""
    owner = where.rpartition(".")[2]
    if owner in LIKE:
        return getattr(LIKE[owner](), name)
    return GOOD[f"{where}({name})" if f"{where}({name})" in GOOD else name]()


def of_keys() -> Iterator[Case]:
    """A case for each bad value of each key of a configuration."""
    from go2_wbc import Config

    yield from _keys_of((), Config())


def _keys_of(path: tuple[str, ...], part: object) -> Iterator[Case]:
    from go2_wbc.planning.command import VelocityEnvelope

    for field in dataclasses.fields(part):  # type: ignore[arg-type]
        value, names = getattr(part, field.name), (*path, field.name)
        value = VelocityEnvelope() if value is None else value
        if dataclasses.is_dataclass(value):
            yield from _keys_of(names, value)
            value = object()
        label = f"TOML {'.'.join(names)}"
        for text in BAD_TOML.get(type(value), ('"three"', "[]", "5")):
            if (label, text) not in LEGAL:
                yield Case(label, text, partial(_configured, names, text))


def _configured(names: tuple[str, ...], text: str) -> object:
    from go2_wbc import load_config

    *tables, key = names
    head = f"[{'.'.join(tables)}]\n" if tables else ""
    file = place() / "numbers.toml"
    file.write_text(f"{head}{key} = {text}\n", encoding="utf-8")
    return load_config(file)


BAD_TOML = {
    float: ('"three"', "nan", "inf", "1e300", "-1e300", "[]", "true", "{}"),
    int: ('"three"', "nan", "1.5", "-1", "9" * 30, "[]", "true"),
    bool: ('"yes"', "5", "[]"),
    str: ("5", '""', '"nonsense"', "[]"),
    tuple: ('"three"', "5", "[]", "[nan, nan, nan]", "[1e300, 1e300, 1e300]", "{}"),
}


def of_options() -> Iterator[Case]:
    """A case for each bad text of each option and argument of ``go2-wbc``."""
    from controller.cli import main as cli

    program = cli.Program(cli.PROGRAM, "", cli.COMMANDS, "x")
    for command in cli.COMMANDS:
        parser = cli.build_parser(program, command.name)
        (subparsers,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
        actions = subparsers.choices[command.name]._actions
        needed = [a for a in actions if a.required]
        for action in actions:
            if action.nargs == 0 or isinstance(action, argparse._HelpAction):
                continue
            for text in _bad_texts(action):
                words = [command.name]
                for other in needed:
                    words += _words(other, text if other is action else NEEDED[other.dest])
                if action not in needed:
                    words += _words(action, text)
                label = f"go2-wbc {command.name} {'/'.join(action.option_strings) or action.dest}"
                if (label, text) not in LEGAL:
                    yield Case(label, text, partial(_commanded, words), ExitCode.USAGE)


def _words(action: argparse.Action, text: str) -> list[str]:
    return (
        [f"{action.option_strings[-1]}={text}"]
        if action.option_strings and action.nargs is None
        else [*action.option_strings, text]
    )


def _bad_texts(action: argparse.Action) -> tuple[str, ...]:
    if action.choices or action.type is str:
        return ("", "nonsense", "5")
    if action.type in (int, float):
        return ("", "three", "nan", "inf", "-1", "1e400", "9" * 30)
    if action.type is folder:
        return ("", "/dev/null/at.all")
    if action.type is Path:
        return ("", "/dev/null/at.all")
    return ("", "three", "nan", "-1", "9" * 30, "/dev/null/at.all")


class Reached(Exception):
    """The work has begun: what was given was taken for good."""


def _commanded(words: list[str]) -> object:
    from controller.cli.main import main

    with (
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()) as said,
    ):
        code = main(words)
    if "Traceback" in said.getvalue():
        last = said.getvalue().strip().splitlines()[-2]
        raise (Reached if "Reached" in last else AssertionError)(last)
    if code != ExitCode.OK and not said.getvalue().strip():
        raise AssertionError(f"exit code {code}, and nothing said")
    if code == ExitCode.RUNTIME and "install" in said.getvalue():  # an extra, which comes first
        return ExitCode.USAGE
    return code


NEEDED = {
    "motion": "bow",
    "what": "bow",
    "song": "song.wav",
    "out": "bow.csv",
    "name": "greet",
    "file": "bow.sqlite",
    "row": "3",
    "interface": "lo",
}


@cache
def stop_before_work() -> None:
    """Let a command end with ``Reached`` once it has taken everything it was given."""

    def reached(*_: object, **__: object) -> object:
        raise Reached

    for where, *methods in (
        ("go2_wbc.plant.mujoco.plant:MujocoPlant", "write"),
        ("motions.feasibility.check:FeasibilityChecker", "evaluate", "check", "plan"),
        ("controller.sweeps.engine:LocalEngine", "run"),
    ):
        module, _, name = where.partition(":")
        for method in methods:
            setattr(getattr(importlib.import_module(module), name), method, reached)


class _TooLong(BaseException):
    pass


def verdict(case: Case) -> str:
    """What is wrong with how a case ended; nothing if all is well."""
    records: list[logging.LogRecord] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = records.append  # type: ignore[method-assign]
    logging.getLogger().addHandler(handler)
    if case.code is not None:
        stop_before_work()
    before = signal.signal(signal.SIGPROF, _too_long)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            result = case.call()
    except Go2WbcError as error:
        told, name = str(error), re.split(r"[ .(]", case.where.strip(")"))[-1]
        given = repr(case.value).strip("[]")[:6] or "[]"
        is_told = any(word in told for word in (name, given, "valid: "))
        return "" if is_told else f"neither the value nor what it is for: {told}"
    except _TooLong:
        return f"still busy after {LONGEST:g} s"
    except Reached:
        return "silent: the work begins"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"[:160]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
        logging.getLogger().removeHandler(handler)
    if case.code is not None:
        return "" if result == case.code else f"exit code {result}"
    return "" if warned or records else "silent"


def _too_long(*_: object) -> None:
    raise _TooLong


def main() -> int:
    """Try every case; print those that do not end as they must, and how many there are."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", default="")
    only = parser.parse_args().only
    os.chdir(place())
    _ = thing("go2"), thing("checked")  # what takes long at the first time does it now
    cases = [*of_signatures(), *of_keys(), *of_options()]
    cases = [case for case in cases if only in case.where]
    wrong = {str(case): said for case in cases if (said := verdict(case))}
    for case, said in wrong.items():
        print(f"{case}: {said}")
    print(f"{len(cases)} bad inputs, {len(wrong)} not refused as they must be")
    return int(bool(wrong))


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: None, "silent"),
        (lambda: {}["a"], "KeyError: 'a'"),
        (lambda: find_motion("three"), ""),
        (lambda: deg(1) / 0, "ZeroDivisionError: float division by zero"),
    ],
)
def test_what_is_silent_or_not_ours_is_noticed(call: Call, said: str) -> None:
    assert verdict(Case("motions.find_motion(name)", "three", call)) == said


def test_every_bad_input_is_refused_with_what_was_wrong(tmp_path: Path) -> None:
    words = ["-c", "import sys; from tests.test_bad_inputs import main; sys.exit(main())"]
    done = run_script(words, tmp_path, {**os.environ, **ONE_THREAD, "PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(done.stdout.split()[0]) > 6000


if __name__ == "__main__":
    sys.exit(main())
