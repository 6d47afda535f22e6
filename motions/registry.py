"""Finds motions: those of the library by name, and those in a user's own file."""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from go2_wbc.arguments import typed
from go2_wbc.errors import CommandError, TimelineError, unknown_name
from motions.authoring import Motion, Value, in_words, last_line
from motions.language.timeline import Timeline
from motions.saved.files import MOTION_FORMAT, read_motion

LIBRARY = Path(__file__).with_name("library")
"""The folder of the library, whose files are as users write theirs."""


def motion_names() -> tuple[str, ...]:
    """Names of the motions in the library."""
    return tuple(_homes())


@cache
def _homes() -> Mapping[str, str]:
    """The module of each motion of the library, by name: a file is read, not run, for its names."""
    found = {
        node.name: file.stem
        for file in LIBRARY.glob("*.py")
        for node in ast.parse(file.read_bytes()).body
        if isinstance(node, ast.FunctionDef) and node.decorator_list
    }
    return dict(sorted(found.items()))


@typed(error=CommandError)
def find_motion(name: str) -> Motion:
    """The motion of the library with that name.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    if name not in _homes():
        stem = Path(name).stem
        own = f"; of your own file: from {stem} import NAME" if name.endswith(".py") else ""
        raise CommandError(unknown_name("motion", name, _homes()) + own)
    module = importlib.import_module(f"motions.library.{_homes()[name]}")
    return getattr(module, name)


def load_motion(name: str | Path, **values: Value) -> Timeline:
    """The timeline of a motion of the library, with these parameters, or of a ``.json`` file.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
        TimelineError: for a parameter that is not valid; a file has none.
        MotionFileError: if the file is missing, damaged, or not what ``save_motion`` wrote.
    """
    if not str(name).endswith(MOTION_FORMAT.suffix):
        return find_motion(str(name))(**values)
    if values:
        raise TimelineError(f"{name}: a saved motion has no parameters, got {', '.join(values)}")
    return read_motion(name)


@typed()
def load_file(path: Path | str) -> Mapping[str, Motion]:
    """The motions that a Python file defines, by name.

    Raises:
        TimelineError: if the file cannot be read, does not run (says the line), has no motion, or
            two of one name.
    """
    file = Path(path)
    if not file.is_file():
        raise TimelineError(f"there is no file {file}")
    if file.suffix != ".py":
        raise TimelineError(f"{file} is not a Python file: its name must end in .py")
    return load_text(file, file.read_bytes())


def load_text(file: Path, data: bytes) -> Mapping[str, Motion]:
    """The motions that ``file`` would define if it held ``data``; raises as ``load_file``."""
    path = str(file.resolve())
    made, tree = _run(file, path, data)
    own = {
        item.name: item
        for item in made.values()
        if isinstance(item, Motion) and item.source.startswith(path)
    }
    if not own:
        raise TimelineError(f"{file} defines no motion: write a function with @motion")
    _require_own_names(file, tree, set(own))
    return own


def _require_own_names(file: Path, tree: ast.Module, names: set[str]) -> None:
    """The second of two functions of one name would silently take the place of the first."""
    first_lines: dict[str, int] = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name in names:
            if node.name in first_lines:
                lines = f"lines {first_lines[node.name]} and {node.lineno}"
                raise TimelineError(f"{file} has two motions named {node.name!r}, {lines}")
            first_lines[node.name] = node.lineno


def _run(file: Path, path: str, data: bytes) -> tuple[Mapping[str, Any], ast.Module]:
    """What the text sets, and its tree.

    Never cached bytecode, which would miss two saves within a second.
    """
    module = ModuleType(f"_motion_file_{file.stem}")
    module.__file__ = path
    sys.modules[module.__name__] = module  # dataclasses look their annotations up there
    try:
        tree = ast.parse(data, path)
        exec(compile(tree, path, "exec"), vars(module))
    except (Exception, SystemExit) as error:
        raise TimelineError(f"{_place(file, error)}: {in_words(error)}") from error
    finally:
        sys.modules.pop(module.__name__, None)
    return vars(module), tree


def _place(file: Path, error: BaseException) -> str:
    """``file`` and the line of it that was running, or that cannot be read."""
    path = str(file.resolve())
    line = last_line(error, path)
    if isinstance(error, SyntaxError) and error.filename == path:
        line = error.lineno
    return f"{file}, line {line}" if line else str(file)
