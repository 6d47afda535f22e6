"""Public names that are imported when they are first used.

A package's ``__init__`` runs for every import of one of its modules, so an eager one would load
Pinocchio and MuJoCo for a command line that only prints its help.
"""

from __future__ import annotations

import gc
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType


def lazy_exports(package: str, homes: Mapping[str, Sequence[str]]) -> Callable[[str], object]:
    """The module-level ``__getattr__`` (PEP 562) of ``package``.

    Args:
        package: its dotted name.
        homes: the public names by the module that defines them, relative to ``package``.

    Raises:
        ImportError: by what is returned, if a module cannot be imported.
    """
    home_of = {name: f"{package}.{home}" for home, names in homes.items() for name in names}

    def load(name: str) -> object:
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        with without_collecting():
            module = _imported(home_of[name])
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
