"""Public names that are imported when they are first used.

A package's ``__init__`` runs for every import of one of its modules, so an eager one would load
Pinocchio and MuJoCo for a command line that only prints its help.
"""

from __future__ import annotations

import ast
import gc
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType


def lazy_exports(package: str) -> Callable[[str], object]:
    """The module-level ``__getattr__`` (PEP 562) of ``package``.

    Its public names are those that its ``__init__`` imports ``if TYPE_CHECKING``: type checkers
    follow these imports, and whoever runs the program makes each when its name is first used. That
    is how lazy_loader (SPEC 1 of Scientific Python) reads its stubs.

    Args:
        package: its dotted name.

    Raises:
        ImportError: by what is returned, if a module cannot be imported.
    """

    @cache
    def homes() -> dict[str, str]:
        source = Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8")
        blocks = [s for s in ast.parse(source).body if isinstance(s, ast.If)]
        imports = [s for block in blocks for s in block.body if isinstance(s, ast.ImportFrom)]
        return {name.name: str(item.module) for item in imports for name in item.names}

    def load(name: str) -> object:
        if name not in homes():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        with without_collecting():
            module = _imported(homes()[name])
        return getattr(module, name)

    return load


def moved_names(module: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """The module-level ``__getattr__`` of a module that others still ask for what it had.

    Args:
        module: its dotted name.
        homes: the modules that define the names now.
    """

    def load(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        told = f"{module}.{name} has moved: import it from {homes[name]}"
        warnings.warn(told, DeprecationWarning, stacklevel=2)
        return getattr(_imported(homes[name]), name)

    return load


def _imported(name: str) -> ModuleType:
    """The module of that name; an ``AttributeError`` of its own is told as what it is.

    ``from package import name`` takes one that leaves ``__getattr__`` for a missing name, and drops
    its story.
    """
    try:
        return import_module(name)
    except AttributeError as error:
        raise ImportError(f"{name} cannot be imported: {error}", name=name) from error


@contextmanager
def without_collecting() -> Iterator[None]:
    """Does not look for garbage while something is imported.

    Imports leave next to none, and looking through all that they make takes a tenth of their time.
    What they made counts as old afterwards, so that it is not looked through then. That costs
    nothing if there was nothing left to import.
    """
    if not gc.isenabled():
        yield
        return
    known = len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        # A program's own frozen objects stay so; to count them takes tens of ms.
        if len(sys.modules) != known and not gc.get_freeze_count():
            gc.freeze()
            gc.unfreeze()  # into the oldest generation
        gc.enable()
