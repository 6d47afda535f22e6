"""Public names that are imported when they are first used.

A package's ``__init__`` runs for every import of one of its modules, so an eager one would load
Pinocchio and MuJoCo for a command line that only prints its help. Meanwhile garbage is not looked
for: imports leave next to none, and looking through all that they make takes a tenth of their time.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module


def lazy_exports(package: str, homes: Mapping[str, Sequence[str]]) -> Callable[[str], object]:
    """The module-level ``__getattr__`` (PEP 562) of ``package``.

    Args:
        package: its dotted name.
        homes: the public names by the module that defines them, relative to ``package``.
    """
    home_of = {name: home for home, names in homes.items() for name in names}

    def load(name: str) -> object:
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        is_collecting = gc.isenabled()
        gc.disable()
        try:
            module = import_module(f"{package}.{home_of[name]}")
        finally:
            if is_collecting:
                gc.enable()
        return getattr(module, name)

    return load
